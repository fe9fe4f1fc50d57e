"""A sparse factor made for many solves with three right-hand sides.

The elimination tree of a nested dissection is factored block by block, as A = L D L^T with dense
blocks (Duff and Reid 1983, The multifrontal solution of indefinite sparse symmetric linear systems,
without its pivoting: the matrix is positive definite). Each pivot block is inverted and each block
of L multiplied by it, so that a solve is one dense product per block on the way up the tree and one
on the way down. The factor is made in double and kept in single precision, which halves what a
solve must read; a residual in double precision makes up for it (Carson and Higham 2018,
Accelerating the solution of linear systems by iterative refinement in three precisions). A matrix
so badly conditioned that this would not do is kept in double.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numba import prange
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel, one_blas_thread, parallel_kernel
from solvers.linear.laplacian import Floats
from solvers.linear.nested_dissection import Dissection
from solvers.linear.panels import (
    WIDE,
    Indices,
    Offsets,
    Singles,
    lay_panels,
    multiply,
    panels_size,
)

# Subtrees that are solved at the same time. A fixed number: the answer must not depend on the
# number of cores.
TASKS = 4

# The share of an error that a solve in single precision may leave.
_LOST_MOST = 1e-2


class Entries(NamedTuple):
    """A sparse matrix as compressed rows, columns ascending."""

    starts: Indices
    columns: Indices
    values: Floats


class Blocks(NamedTuple):
    """The factor's blocks, children before parents.

    Block b eliminates unknowns firsts[b] to firsts[b + 1], k of them, and touches m later ones;
    `reach`, from reach_starts[b] to reach_starts[b + 1], names its own and those, ascending. With
    G = L D^-1 (m, k), the panels of -G^T (k, m) lie from ups[up_starts[b]] on, and from
    downs[down_starts[b + 1]] on, last block first, those of the pivot block's inverse over
    -G (k + m, k). Both ways are then row vectors times a matrix, read in the order it lies in
    memory: see `solvers.linear.panels`.
    """

    firsts: Indices
    reach_starts: Offsets
    reach: Indices
    up_starts: Offsets
    ups: Singles
    down_starts: Offsets
    downs: Singles


class Schedule(NamedTuple):
    """Which blocks are worked on at the same time.

    Task t is the subtree of blocks task_firsts[t] to task_lasts[t], inclusive; `tops` are the
    blocks above all tasks. A task may not write what it shares with another: it keeps the updates
    of the `shared` unknowns of the top blocks in a copy of its own, at n + t * len(shared). No
    block's matrices have more columns than `widest`, whole panels counted.
    """

    task_firsts: Indices
    task_lasts: Indices
    tops: Indices
    shared: Indices
    widest: int


class Updates(NamedTuple):
    """What a block passes on to its parent while the matrix is factored.

    `reach` is that of the blocks, without private copies. The update of block b, where it is a
    task's last block or a top block, is kept in kept[starts[b]:starts[b + 1]], so that other values
    in one task do not concern the others.
    """

    parents: Indices
    reach: Indices
    starts: Offsets
    kept: Floats


class Work(NamedTuple):
    """Room for a solve: vectors (n + copies, 3), and each task's sums (tasks + 1, 3, widest)."""

    vectors: Singles
    sums: Singles


class BlockFactor:
    """A factored symmetric positive definite matrix (n, n), given in the order of a dissection."""

    def __init__(self, matrix: sp.csr_matrix, tree: Dissection) -> None:
        self._matrix = matrix.sorted_indices()
        starts, columns = self._matrix.indptr.astype(np.int32), self._matrix.indices
        self._entries = Entries(starts, columns.astype(np.int32), self._matrix.data)
        self._plan, self._schedule, self._updates = _plan(self._entries, tree)
        self._fill(np.dtype(np.float32))

    def refactor(self, values: Floats) -> None:
        """Take other values for the matrix's entries, in the order of its compressed rows.

        The order and the blocks stay, and so do the subtrees whose entries are the same.
        """
        stale = _stale_tasks(self._entries, values, self._blocks, self._schedule)
        self._entries.values[:] = values
        with one_blas_thread():
            _factorise(self._entries, stale, self._blocks, self._schedule, self._updates)
            self._check(rounds=1)

    def restore(self, values: Floats, precision: np.dtype[Any]) -> None:
        """Factor these values as `refactor` does, with numbers of the precision of an earlier time.

        The precision is not tested again: it depends on all the values since the first.
        """
        stale = _stale_tasks(self._entries, values, self._blocks, self._schedule)
        self._entries.values[:] = values
        if precision != self.precision:
            self._make_room(precision)
            stale[:] = True
        with one_blas_thread():
            _factorise(self._entries, stale, self._blocks, self._schedule, self._updates)

    def add_solution(self, b: Floats, x: Floats) -> None:
        """Add the solution y of A y = b, both (n, 3), to the first n rows of x."""
        _add_solution(self._blocks, self._schedule, b, x, self._work)

    def solve(self, b: Floats, x: Floats) -> None:
        """Put the solution of A x = b, both (n, 3), into x."""
        x[:] = 0.0
        self.add_solution(b, x)

    @property
    def precision(self) -> np.dtype[Any]:
        """The type of the factor's numbers."""
        return self._blocks.ups.dtype

    @property
    def nbytes(self) -> int:
        """The bytes that a solve reads of the factor."""
        return self._blocks.ups.nbytes + self._blocks.downs.nbytes + 2 * self._blocks.reach.nbytes

    def _make_room(self, precision: np.dtype[Any]) -> None:
        plan, schedule = self._plan, self._schedule
        ups = np.zeros(plan.up_starts[-1], precision)
        downs = np.zeros(plan.down_starts[0], precision)
        self._blocks = plan._replace(ups=ups, downs=downs)
        tasks = len(schedule.task_firsts)
        self._work = Work(
            np.zeros((self._matrix.shape[0] + tasks * len(schedule.shared), 3), precision),
            np.zeros((tasks + 1, 3, schedule.widest), precision),
        )

    def _fill(self, precision: np.dtype[Any]) -> None:
        self._make_room(precision)
        every = np.ones(len(self._schedule.task_firsts), np.bool_)
        with one_blas_thread():
            _factorise(self._entries, every, self._blocks, self._schedule, self._updates)
            self._check(rounds=3)

    def _check(self, rounds: int) -> None:
        """Go over to double precision, for good, where single precision loses too much."""
        if self._blocks.ups.dtype == np.float64:
            return
        if _lost_share(self._matrix, self, rounds) > _LOST_MOST:
            self._fill(np.dtype(np.float64))


def _plan(entries: Entries, tree: Dissection) -> tuple[Blocks, Schedule, Updates]:
    """All that does not depend on the matrix's values; the blocks are empty."""
    reach_starts, reach = _symbolic(entries.starts, entries.columns, tree)
    k, size = np.diff(tree.firsts).astype(np.int64), np.diff(reach_starts)
    m = size - k
    up_starts = np.append(0, np.cumsum(panels_size(k, m)))
    # The way down reads the blocks backwards: let it read memory forwards all the same.
    down_starts = np.append(0, np.cumsum(panels_size(size, k)[::-1]))[::-1].copy()
    schedule = _schedule(tree, k * size, int(np.maximum(k, m).max(initial=0)) + WIDE)
    empty = np.zeros(0, np.float32)
    blocks = Blocks(tree.firsts, reach_starts, reach, up_starts, empty, down_starts, empty)
    keepers = np.concatenate([schedule.task_lasts, schedule.tops])
    sizes = np.zeros(len(k), np.int64)
    sizes[keepers] = m[keepers] ** 2
    starts = np.append(0, np.cumsum(sizes))
    updates = Updates(tree.parents, reach, starts, np.zeros(starts[-1]))
    return (
        blocks._replace(reach=_private_reach(blocks, schedule, len(tree.order))),
        schedule,
        updates,
    )


@lru_cache(maxsize=8)
def _probe(count: int) -> Floats:
    """An error to be solved for (n, 3), always the same."""
    return np.random.default_rng(0).standard_normal((count, 3))


def _lost_share(matrix: sp.csr_matrix, factor: BlockFactor, rounds: int) -> float:
    """The share of an error, in the matrix's norm, that a solve leaves of it; the worst of a few.

    A step that corrects by this solve descends on the quadratic form as long as the share is below
    one. Each round starts from what the last one left, which is what the solve is worst at.
    """
    error = _probe(matrix.shape[0]).copy()
    found = np.empty_like(error)
    worst = 0.0
    for _ in range(rounds):
        image = matrix @ error
        before = float(np.vdot(error, image))
        if not before > 0.0:
            break
        factor.solve(image, found)
        error -= found
        after = float(np.vdot(error, matrix @ error))
        share = math.sqrt(max(after, 0.0) / before)
        worst = max(worst, share if math.isfinite(share) else math.inf)
        error /= math.sqrt(after) if 0.0 < after < math.inf else 1.0
    return worst


def _schedule(tree: Dissection, costs: Offsets, widest: int) -> Schedule:
    """Split the tree at its top until there are TASKS subtrees, always the costliest next."""
    blocks = len(tree.parents)
    sizes, totals = np.ones(blocks, np.int64), costs.copy()
    children: list[list[int]] = [[] for _ in range(blocks)]
    tasks = []
    for b, parent in enumerate(tree.parents):
        if parent < 0:
            tasks.append(b)
            continue
        sizes[parent] += sizes[b]
        totals[parent] += totals[b]
        children[parent].append(b)
    tops = []
    while len(tasks) < TASKS and any(children[b] for b in tasks):
        costliest = max((b for b in tasks if children[b]), key=lambda b: int(totals[b]))
        tasks.remove(costliest)
        tasks += children[costliest]
        tops.append(costliest)
    tasks.sort()
    lasts = np.array(tasks, np.int32)
    tops.sort()
    shared = [np.arange(tree.firsts[b], tree.firsts[b + 1]) for b in tops]
    return Schedule(
        (lasts - sizes[lasts] + 1).astype(np.int32),
        lasts,
        np.array(tops, np.int32),
        np.concatenate([*shared, np.zeros(0)]).astype(np.int32),
        widest,
    )


def _private_reach(blocks: Blocks, schedule: Schedule, count: int) -> Indices:
    """The blocks' reach, with shared unknowns replaced by each task's copies of them."""
    reach = blocks.reach.copy()
    place = np.full(count, -1, np.int64)
    place[schedule.shared] = np.arange(len(schedule.shared))
    for task, (first, last) in enumerate(zip(*schedule[:2], strict=True)):
        own = slice(blocks.reach_starts[first], blocks.reach_starts[last + 1])
        at = place[reach[own]]
        copies = count + task * len(schedule.shared) + at
        reach[own] = np.where(at >= 0, copies, reach[own])
    return reach


@parallel_kernel
def _add_solution(blocks: Blocks, schedule: Schedule, b: Floats, x: Floats, work: Work) -> None:
    """Up all tasks' subtrees at once, up and down the blocks above them, down the subtrees."""
    for task in prange(len(schedule.task_firsts)):
        _climb(blocks, schedule, task, b, work)
    _turn(blocks, schedule, b, x, work)
    for task in prange(len(schedule.task_firsts)):
        _descend(blocks, schedule, task, x, work)


@kernel
def _climb(blocks: Blocks, schedule: Schedule, task: int, b: Floats, work: Work) -> None:
    """Forward substitution in a task's subtree."""
    first, last = schedule.task_firsts[task], schedule.task_lasts[task]
    y = work.vectors
    for v in range(blocks.firsts[first], blocks.firsts[last + 1]):
        y[v, 0], y[v, 1], y[v, 2] = b[v, 0], b[v, 1], b[v, 2]
    copies = len(b) + task * len(schedule.shared)
    y[copies : copies + len(schedule.shared)] = 0.0
    _send_up(blocks, first, last, y, work.sums[task])


@kernel
def _turn(blocks: Blocks, schedule: Schedule, b: Floats, x: Floats, work: Work) -> None:
    """Both substitutions in the blocks above the tasks; the tasks' updates are added in order."""
    shared, tasks = schedule.shared, len(schedule.task_firsts)
    y = work.vectors
    for h in range(len(shared)):
        v = shared[h]
        for d in range(3):
            y[v, d] = b[v, d]
            for t in range(tasks):
                y[v, d] += y[len(b) + t * len(shared) + h, d]
    for block in schedule.tops:
        _send_up(blocks, block, block, y, work.sums[tasks])
    for block in schedule.tops[::-1]:
        _send_down(blocks, block, block, y, work.sums[tasks])
    for h in range(len(shared)):
        v = shared[h]
        for d in range(3):
            x[v, d] += y[v, d]
            for t in range(tasks):
                y[len(b) + t * len(shared) + h, d] = y[v, d]


@kernel
def _descend(blocks: Blocks, schedule: Schedule, task: int, x: Floats, work: Work) -> None:
    """Backward substitution in a task's subtree; the solution is added to x."""
    first, last = schedule.task_firsts[task], schedule.task_lasts[task]
    y = work.vectors
    _send_down(blocks, first, last, y, work.sums[task])
    for v in range(blocks.firsts[first], blocks.firsts[last + 1]):
        for d in range(3):
            x[v, d] += y[v, d]


@kernel
def _send_up(blocks: Blocks, first: int, last: int, y: Singles, sums: Singles) -> None:
    """Forward substitution of blocks first to last: each takes G b from later unknowns."""
    firsts, starts, reach = blocks.firsts, blocks.reach_starts, blocks.reach
    for block in range(first, last + 1):
        begin, end = starts[block], starts[block + 1]
        later = begin + firsts[block + 1] - firsts[block]
        at = blocks.up_starts[block]
        multiply(blocks.ups, at, end - later, y, reach, begin, later, sums)
        for h in range(end - later):
            v = np.uint64(reach[later + h])
            y[v, 0] += sums[0, h]
            y[v, 1] += sums[1, h]
            y[v, 2] += sums[2, h]


@kernel
def _send_down(blocks: Blocks, first: int, last: int, y: Singles, sums: Singles) -> None:
    """Backward substitution of blocks last to first: inverse times b, less G^T times the later."""
    firsts, starts, reach = blocks.firsts, blocks.reach_starts, blocks.reach
    for block in range(last, first - 1, -1):
        begin, end = starts[block], starts[block + 1]
        k = firsts[block + 1] - firsts[block]
        multiply(blocks.downs, blocks.down_starts[block + 1], k, y, reach, begin, end, sums)
        for h in range(k):
            v = np.uint64(reach[begin + h])
            y[v, 0], y[v, 1], y[v, 2] = sums[0, h], sums[1, h], sums[2, h]


@kernel
def _symbolic(starts: Indices, columns: Indices, tree: Dissection) -> tuple[Offsets, Indices]:
    """Each block's own unknowns and the later ones that it touches, ascending."""
    firsts, parents = tree.firsts, tree.parents
    blocks = len(parents)
    seen = np.full(len(tree.order), -1, np.int32)
    reach_starts = np.zeros(blocks + 1, np.int64)
    reach = np.empty(4 * len(tree.order) + 64, np.int32)
    filled = 0
    child = np.full(blocks, -1, np.int32)  # the last child of each block, and its elder siblings
    elder = np.full(blocks, -1, np.int32)
    for b in range(blocks):
        begin, last = filled, firsts[b + 1]
        for v in range(firsts[b], last):
            reach, filled = _append(reach, filled, v)
            for h in range(starts[v], starts[v + 1]):
                u = columns[h]
                if u >= last and seen[u] != b:
                    seen[u] = b
                    reach, filled = _append(reach, filled, u)
        c = child[b]
        while c >= 0:
            for h in range(reach_starts[c], reach_starts[c + 1]):
                u = reach[h]
                if u >= last and seen[u] != b:
                    seen[u] = b
                    reach, filled = _append(reach, filled, u)
            c = elder[c]
        reach[begin:filled].sort()
        reach_starts[b + 1] = filled
        if parents[b] >= 0:
            elder[b], child[parents[b]] = child[parents[b]], b
    return reach_starts, reach[:filled].copy()


@kernel
def _append(reach: Indices, filled: int, value: int) -> tuple[Indices, int]:
    if filled == len(reach):
        longer = np.empty(2 * len(reach), np.int32)
        longer[:filled] = reach
        reach = longer
    reach[filled] = value
    return reach, filled + 1


@kernel
def _stale_tasks(
    entries: Entries, values: Floats, blocks: Blocks, schedule: Schedule
) -> NDArray[np.bool_]:
    """Which tasks hold an entry that is not the same any more."""
    stale = np.zeros(len(schedule.task_firsts), np.bool_)
    for t in range(len(stale)):
        first = blocks.firsts[schedule.task_firsts[t]]
        last = blocks.firsts[schedule.task_lasts[t] + 1]
        for h in range(entries.starts[first], entries.starts[last]):
            if entries.values[h] != values[h]:
                stale[t] = True
                break
    return stale


@parallel_kernel
def _factorise(
    entries: Entries,
    stale: NDArray[np.bool_],
    blocks: Blocks,
    schedule: Schedule,
    updates: Updates,
) -> None:
    """Fill the blocks' values: those of stale tasks at the same time, then the blocks above."""
    for task in prange(len(stale)):
        if stale[task]:
            _factorise_subtree(entries, task, blocks, schedule, updates)
    _factorise_tops(entries, blocks, schedule, updates)


@kernel
def _factorise_subtree(
    entries: Entries, task: int, blocks: Blocks, schedule: Schedule, updates: Updates
) -> None:
    """Fill a task's blocks from the leaves of its subtree to the root, whose update is kept."""
    first, last = schedule.task_firsts[task], schedule.task_lasts[task]
    place = np.empty(len(entries.starts), np.int32)
    pending = np.empty(last - first + 1, np.int64)  # blocks whose update waits for their parent
    waiting = 0
    depth = 0
    stack = np.empty(1 << 16)
    for b in range(first, last + 1):
        front = _front(entries, b, blocks, updates, place)
        while waiting > 0 and updates.parents[pending[waiting - 1]] == b:
            waiting -= 1
            touched = _touched(blocks, updates, pending[waiting])
            size = len(touched)
            depth -= size * size
            update = stack[depth : depth + size * size].reshape((size, size))
            _extend_add(update, touched, place, front)
        corner = _eliminate(front, b, blocks)
        if b == last:
            _kept(blocks, updates, b)[:] = corner
        elif corner.size:
            if depth + corner.size > len(stack):
                longer = np.empty(2 * (depth + corner.size))
                longer[:depth] = stack[:depth]
                stack = longer
            stack[depth : depth + corner.size] = corner.ravel()
            depth += corner.size
            pending[waiting] = b
            waiting += 1


@kernel
def _factorise_tops(entries: Entries, blocks: Blocks, schedule: Schedule, updates: Updates) -> None:
    """Fill the blocks above the tasks."""
    place = np.empty(len(entries.starts), np.int32)
    for b in schedule.tops:
        front = _front(entries, b, blocks, updates, place)
        for c in range(b):
            if updates.parents[c] == b:
                touched = _touched(blocks, updates, c)
                _extend_add(_kept(blocks, updates, c), touched, place, front)
        _kept(blocks, updates, b)[:] = _eliminate(front, b, blocks)


@kernel
def _touched(blocks: Blocks, updates: Updates, block: int) -> Indices:
    """The later unknowns that a block touches."""
    k = blocks.firsts[block + 1] - blocks.firsts[block]
    begin, end = blocks.reach_starts[block] + k, blocks.reach_starts[block + 1]
    touched: Indices = updates.reach[begin:end]
    return touched


@kernel
def _kept(blocks: Blocks, updates: Updates, block: int) -> Floats:
    """Where the update of a block is kept, (m, m)."""
    size = len(_touched(blocks, updates, block))
    kept = updates.kept[updates.starts[block] : updates.starts[block + 1]]
    update: Floats = kept.reshape((size, size))
    return update


@kernel
def _front(
    entries: Entries, block: int, blocks: Blocks, updates: Updates, place: Indices
) -> Floats:
    """The matrix's own entries of one block; `place` gets to know where its unknowns are."""
    first, last = blocks.firsts[block], blocks.firsts[block + 1]
    reach = updates.reach[blocks.reach_starts[block] : blocks.reach_starts[block + 1]]
    for h in range(len(reach)):
        place[reach[h]] = h
    front = np.zeros((len(reach), len(reach)))
    for v in range(first, last):
        for h in range(entries.starts[v], entries.starts[v + 1]):
            u = entries.columns[h]
            if u >= first:
                front[place[u], v - first] = entries.values[h]
    return front


@kernel
def _extend_add(update: Floats, touched: Indices, place: Indices, front: Floats) -> None:
    """Add a child's update, of the unknowns that it touched, to its parent's front."""
    for i in range(len(touched)):
        row = place[touched[i]]
        for j in range(len(touched)):
            front[row, place[touched[j]]] += update[i, j]


@kernel
def _eliminate(front: Floats, block: int, blocks: Blocks) -> Floats:
    """Invert the pivot block, store what both ways need; what is left for the later unknowns."""
    k = blocks.firsts[block + 1] - blocks.firsts[block]
    size = len(front)
    inverse = np.linalg.inv(front[:k, :k].copy())
    below = front[k:, :k].copy()
    G = np.dot(below, inverse)
    lay_panels(-G.T, blocks.ups[blocks.up_starts[block] : blocks.up_starts[block + 1]])
    down = np.empty((size, k))
    down[:k] = inverse
    down[k:] = -G
    lay_panels(down, blocks.downs[blocks.down_starts[block + 1] : blocks.down_starts[block]])
    rest: Floats = front[k:, k:] - np.dot(G, below.T.copy())
    return rest
