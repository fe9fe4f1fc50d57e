"""The data of a block factor: the matrix, its blocks, and which blocks are solved at once.

Every part is a named tuple of arrays, so that kernels can take it as one argument.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.linear.laplacian import Floats
from solvers.linear.panels import Indices, Offsets, Singles

Index = int | np.int64  # kernels are called with int64: for int32 or a constant they compile again


class Entries(NamedTuple):
    """A sparse matrix as compressed rows, columns ascending."""

    starts: Indices
    columns: Indices
    values: Floats


class Blocks(NamedTuple):
    """Where the factor's blocks are, children before parents.

    Block b eliminates the k unknowns from firsts[b] to firsts[b + 1] and touches m later ones.
    `reach`, from reach_starts[b] to reach_starts[b + 1], lists both, ascending. The panels of its
    matrices start at up_starts[b] of `Panels.ups` and at down_starts[b + 1] of `Panels.downs`.
    """

    firsts: Indices
    reach_starts: Offsets
    reach: Indices
    up_starts: Offsets
    down_starts: Offsets


class Panels(NamedTuple):
    """The numbers of the blocks, in panels (see `solvers.linear.panels`).

    With G = L D^-1 (m, k) of a block, `ups` holds -G^T (k, m), and `downs`, last block first, the
    inverse of the pivot block over -G (k + m, k). Both ways of a solve are then row vectors times
    a matrix that is read in the order of memory.
    """

    ups: Singles
    downs: Singles


class Values(NamedTuple):
    """The panels in single and in double precision; those of one precision are empty."""

    single: Panels
    double: Panels


class Schedule(NamedTuple):
    """Which blocks are worked on at the same time.

    Task t is the subtree of blocks task_firsts[t] to task_lasts[t], inclusive; `tops` are the
    blocks above all tasks. A task must not write what it shares with another: it keeps its updates
    of the `shared` unknowns, those of the top blocks, in a copy at n + t * len(shared). No matrix
    of a block has more columns than `widest`, whole panels counted.
    """

    task_firsts: Indices
    task_lasts: Indices
    tops: Indices
    shared: Indices
    widest: int


class Updates(NamedTuple):
    """What a block passes to its parent while the matrix is factored.

    `reach` is that of the blocks, without private copies. The update of block b, where b is one of
    the `keepers`, is kept in kept[starts[b]:starts[b + 1]], so that new values in one task leave
    the other tasks' updates as they are. The keepers, ascending, are the tasks' last blocks and the
    top blocks.
    """

    parents: Indices
    reach: Indices
    keepers: Indices
    starts: Offsets
    kept: Floats


class Workspace(NamedTuple):
    """Memory of a solve: vectors (n + copies, 3), and each task's sums (tasks + 1, 3, widest)."""

    vectors: Singles
    sums: Singles
