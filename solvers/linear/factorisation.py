"""Numerical factorisation, block by block: A = L D L^T with dense blocks.

The multifrontal method: a block gathers the matrix's entries and its children's updates in a dense
front, inverts the pivot block, and passes the Schur complement to its parent.

Source: Duff and Reid 1983, The multifrontal solution of indefinite sparse symmetric linear systems;
without its pivoting, because the matrix is positive definite.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel, run_together
from solvers.linear.blocks import Blocks, Entries, Index, Panels, Schedule, Updates, Values
from solvers.linear.laplacian import Floats
from solvers.linear.panels import Indices, lay_panels


@kernel
def stale_tasks(
    entries: Entries, values: Floats, blocks: Blocks, schedule: Schedule
) -> NDArray[np.bool_]:
    """Which tasks hold an entry whose value changed, (tasks,)."""
    stale = np.zeros(len(schedule.task_firsts), np.bool_)
    for t in range(len(stale)):
        first = blocks.firsts[schedule.task_firsts[t]]
        last = blocks.firsts[schedule.task_lasts[t] + 1]
        for h in range(entries.starts[first], entries.starts[last]):
            if entries.values[h] != values[h]:
                stale[t] = True
                break
    return stale


def factorise(
    entries: Entries,
    stale: NDArray[np.bool_],
    blocks: Blocks,
    values: Values,
    schedule: Schedule,
    updates: Updates,
) -> None:
    """Fill the panels: those of stale tasks at the same time, then those of the blocks above."""

    def fill(first: int, last: int) -> None:
        _factorise_subtree(entries, first, last, blocks, values, updates)

    run_together(fill, schedule.task_firsts[stale].tolist(), schedule.task_lasts[stale].tolist())
    for block in schedule.tops.tolist():
        fill(block, block)


@kernel
def _factorise_subtree(
    entries: Entries, first: int, last: int, blocks: Blocks, values: Values, updates: Updates
) -> None:
    """Fill the blocks from first, a leaf, to last, the root of its subtree, whose update is kept.

    A block above the tasks is called with first = last: its children's updates are kept ones.
    """
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
        for keeper in updates.keepers:
            if updates.parents[keeper] == b:
                child = np.int64(keeper)
                touched = _touched(blocks, updates, child)
                _extend_add(_kept(blocks, updates, child), touched, place, front)
        corner = _eliminate(front, b, blocks, values)
        if b == last:
            _copy(corner, updates.kept[updates.starts[b] : updates.starts[b + 1]])
        elif corner.size:
            if depth + corner.size > len(stack):
                longer = np.empty(2 * (depth + corner.size))
                for i in range(depth):
                    longer[i] = stack[i]
                stack = longer
            _copy(corner, stack[depth : depth + corner.size])
            depth += corner.size
            pending[waiting] = b
            waiting += 1


@kernel
def _copy(matrix: Floats, out: Floats) -> None:
    """Put a matrix into a vector, row after row; numba's own copy compiles for seconds."""
    rows, columns = matrix.shape
    for i in range(rows):
        for j in range(columns):
            out[i * columns + j] = matrix[i, j]


@kernel
def _touched(blocks: Blocks, updates: Updates, block: Index) -> Indices:
    """The later unknowns that a block touches."""
    k = blocks.firsts[block + 1] - blocks.firsts[block]
    begin, end = blocks.reach_starts[block] + k, blocks.reach_starts[block + 1]
    touched: Indices = updates.reach[begin:end]
    return touched


@kernel
def _kept(blocks: Blocks, updates: Updates, block: Index) -> Floats:
    """Where the update of a block is kept, (m, m)."""
    size = len(_touched(blocks, updates, block))
    kept = updates.kept[updates.starts[block] : updates.starts[block + 1]]
    update: Floats = kept.reshape((size, size))
    return update


@kernel
def _front(
    entries: Entries, block: int, blocks: Blocks, updates: Updates, place: Indices
) -> Floats:
    """The matrix's own entries of one block; `place` becomes the row of each of its unknowns."""
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
def _eliminate(front: Floats, block: int, blocks: Blocks, values: Values) -> Floats:
    """Invert the pivot block and store its panels; return the Schur complement (m, m)."""
    k = blocks.firsts[block + 1] - blocks.firsts[block]
    size = len(front)
    inverse = np.linalg.inv(front[:k, :k].copy())
    below = front[k:, :k].copy()
    G = np.dot(below, inverse)
    up, down = np.empty((k, size - k)), np.empty((size, k))
    for i in range(k):
        for j in range(k):
            down[i, j] = inverse[i, j]
        for j in range(size - k):
            up[i, j] = down[k + j, i] = -G[j, i]
    if len(values.double.downs):
        _store(up, down, block, blocks, values.double)
    else:
        _store(up, down, block, blocks, values.single)
    rest: Floats = front[k:, k:].copy()
    passed = np.dot(G, below.T.copy())
    for i in range(size - k):
        for j in range(size - k):
            rest[i, j] -= passed[i, j]
    return rest


@kernel
def _store(up: Floats, down: Floats, block: int, blocks: Blocks, panels: Panels) -> None:
    """Lay the two matrices of a block into its panels."""
    lay_panels(up, panels.ups[blocks.up_starts[block] : blocks.up_starts[block + 1]])
    lay_panels(down, panels.downs[blocks.down_starts[block + 1] : blocks.down_starts[block]])
