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

from solvers.compiled import kernel, one_blas_thread, parallel_kernel
from solvers.laplacian import Floats
from solvers.nested_dissection import Dissection

Indices = NDArray[np.int32]
Offsets = NDArray[np.int64]
Singles = NDArray[np.float32]

# Subtrees that are solved at the same time. A fixed number: the answer must not depend on the
# number of cores.
TASKS = 4
WIDTH = 16  # columns of a panel: what the processor multiplies at once, or a multiple
STEP = 8  # rows of a panel that are added up before their sum is stored

# The share of an error that a solve in single precision may leave.
_LOST_MOST = 1e-2


class Entries(NamedTuple):
    """A sparse matrix as compressed rows, columns ascending."""

    starts: Indices
    columns: Indices
    values: Floats


class Blocks(NamedTuple):
    """The factor's blocks, children before parents.

    Block b eliminates unknowns firsts[b] to firsts[b + 1], k of them, and touches m later ones,
    rows[row_starts[b]:row_starts[b + 1]]. With G = L D^-1 (m, k), `ups` holds -G^T (k, m) at
    up_starts[b]; `downs`, last block first, holds the pivot block's inverse over -G (k + m, k) at
    down_starts[b + 1]. Both ways are then a row vector times a matrix, read in the order it lies in
    memory, panel by panel of WIDTH columns; rows are padded with zeros to a multiple of STEP.
    """

    firsts: Indices
    row_starts: Offsets
    rows: Indices
    up_starts: Offsets
    ups: Singles
    down_starts: Offsets
    downs: Singles


class Schedule(NamedTuple):
    """Which blocks are worked on at the same time.

    Task t is the subtree of blocks task_firsts[t] to task_lasts[t], inclusive; `tops` are the
    blocks above all tasks. A task may not write what it shares with another: it keeps the updates
    of the `shared` unknowns of the top blocks in a copy of its own, at n + t * len(shared).
    """

    task_firsts: Indices
    task_lasts: Indices
    tops: Indices
    shared: Indices
    tallest: int


class Updates(NamedTuple):
    """What a block passes on to its parent while the matrix is factored.

    `rows` are the blocks' rows without private copies. The update of block b, where it is a task's
    last block or a top block, is kept in kept[starts[b]:starts[b + 1]], so that other values in one
    task do not concern the others.
    """

    parents: Indices
    rows: Indices
    starts: Offsets
    kept: Floats


class Work(NamedTuple):
    """Room for a solve: vectors (n + copies, 3); a column of a block and sums, one a task."""

    vectors: Singles
    columns: Singles
    sums: Singles


class BlockFactor:
    """A factored symmetric positive definite matrix (n, n), given in the order of a dissection."""

    def __init__(self, matrix: sp.csr_matrix, tree: Dissection) -> None:
        self._matrix = matrix.sorted_indices()
        starts, columns = self._matrix.indptr.astype(np.int32), self._matrix.indices
        self._entries = Entries(starts, columns.astype(np.int32), self._matrix.data)
        self._plan, self._schedule, self._updates = _plan(self._entries, tree)
        self._fill(np.float32)

    def refactor(self, values: Floats) -> None:
        """Take other values for the matrix's entries, in the order of its compressed rows.

        The order and the blocks stay, and so do the subtrees whose entries are the same.
        """
        stale = _stale_tasks(self._entries, values, self._blocks, self._schedule)
        self._entries.values[:] = values
        with one_blas_thread():
            _factorise(self._entries, stale, self._blocks, self._schedule, self._updates)
            self._check(rounds=1)

    def add_solution(self, b: Floats, x: Floats) -> None:
        """Add the solution y of A y = b, both (n, 3), to the first n rows of x."""
        _add_solution(self._blocks, self._schedule, b, x, self._work)

    def solve(self, b: Floats, x: Floats) -> None:
        """Put the solution of A x = b, both (n, 3), into x."""
        x[:] = 0.0
        self.add_solution(b, x)

    @property
    def nbytes(self) -> int:
        """The bytes that a solve reads of the factor."""
        return self._blocks.ups.nbytes + self._blocks.downs.nbytes + 2 * self._blocks.rows.nbytes

    def _fill(self, precision: type[np.floating[Any]]) -> None:
        plan, schedule = self._plan, self._schedule
        ups = np.zeros(plan.up_starts[-1], precision)
        downs = np.zeros(plan.down_starts[0], precision)
        self._blocks = plan._replace(ups=ups, downs=downs)
        tasks = len(schedule.task_firsts)
        self._work = Work(
            np.zeros((self._matrix.shape[0] + tasks * len(schedule.shared), 3), precision),
            np.zeros((tasks + 1, schedule.tallest, 3), precision),
            np.zeros((tasks + 1, 4 * WIDTH), precision),
        )
        every = np.ones(tasks, np.bool_)
        with one_blas_thread():
            _factorise(self._entries, every, self._blocks, schedule, self._updates)
            self._check(rounds=3)

    def _check(self, rounds: int) -> None:
        """Go over to double precision, for good, where single precision loses too much."""
        if self._blocks.ups.dtype == np.float64:
            return
        if _lost_share(self._matrix, self, rounds) > _LOST_MOST:
            self._fill(np.float64)


def _plan(entries: Entries, tree: Dissection) -> tuple[Blocks, Schedule, Updates]:
    """All that does not depend on the matrix's values; the blocks are empty."""
    row_starts, rows = _symbolic(entries.starts, entries.columns, tree)
    k, m = np.diff(tree.firsts).astype(np.int64), np.diff(row_starts)
    up_starts = np.append(0, np.cumsum(_padded(k, STEP) * _padded(m, WIDTH)))
    # The way down reads the blocks backwards: let it read memory forwards all the same.
    down_sizes = _padded(k + m, STEP) * _padded(k, WIDTH)
    down_starts = np.append(0, np.cumsum(down_sizes[::-1]))[::-1].copy()
    schedule = _schedule(tree, k * (k + m), int((k + m).max(initial=0)) + STEP)
    empty = np.zeros(0, np.float32)
    blocks = Blocks(tree.firsts, row_starts, rows, up_starts, empty, down_starts, empty)
    keepers = np.concatenate([schedule.task_lasts, schedule.tops])
    sizes = np.zeros(len(k), np.int64)
    sizes[keepers] = m[keepers] ** 2
    starts = np.append(0, np.cumsum(sizes))
    updates = Updates(tree.parents, rows, starts, np.zeros(starts[-1]))
    return (
        blocks._replace(rows=_private_rows(blocks, schedule, len(tree.order))),
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


def _padded(size: Offsets, multiple: int) -> Offsets:
    return -(-size // multiple) * multiple


def _schedule(tree: Dissection, costs: Offsets, tallest: int) -> Schedule:
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
        tallest,
    )


def _private_rows(blocks: Blocks, schedule: Schedule, count: int) -> Indices:
    """The blocks' rows, with shared unknowns replaced by each task's copies of them."""
    rows = blocks.rows.copy()
    place = np.full(count, -1, np.int64)
    place[schedule.shared] = np.arange(len(schedule.shared))
    for task, (first, last) in enumerate(zip(*schedule[:2], strict=True)):
        own = slice(blocks.row_starts[first], blocks.row_starts[last + 1])
        at = place[rows[own]]
        copies = count + task * len(schedule.shared) + at
        rows[own] = np.where(at >= 0, copies, rows[own])
    return rows


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
    for block in range(first, last + 1):
        _send_up(blocks, block, y, work.columns[task], work.sums[task])


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
        _send_up(blocks, block, y, work.columns[tasks], work.sums[tasks])
    for block in schedule.tops[::-1]:
        _send_down(blocks, block, y, work.columns[tasks], work.sums[tasks])
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
    for block in range(last, first - 1, -1):
        _send_down(blocks, block, y, work.columns[task], work.sums[task])
    for v in range(blocks.firsts[first], blocks.firsts[last + 1]):
        for d in range(3):
            x[v, d] += y[v, d]


@kernel
def _send_up(blocks: Blocks, block: int, y: Singles, column: Singles, sums: Singles) -> None:
    """Forward substitution of one block: take G b from the later unknowns that it touches."""
    first = blocks.firsts[block]
    k = blocks.firsts[block + 1] - first
    rows = blocks.rows[blocks.row_starts[block] : blocks.row_starts[block + 1]]
    height = (k + STEP - 1) // STEP * STEP
    column[:k] = y[first : first + k]
    column[k:height] = 0.0
    at = blocks.up_starts[block]
    for low in range(0, len(rows), WIDTH):
        _multiply(column, blocks.ups[at : at + height * WIDTH], sums)
        at += height * WIDTH
        for h in range(min(WIDTH, len(rows) - low)):
            v = rows[low + h]
            y[v, 0] += sums[h]
            y[v, 1] += sums[WIDTH + h]
            y[v, 2] += sums[2 * WIDTH + h]


@kernel
def _send_down(blocks: Blocks, block: int, y: Singles, column: Singles, sums: Singles) -> None:
    """Backward substitution of one block: its pivot's inverse times b, less G^T times the later."""
    first = blocks.firsts[block]
    k = blocks.firsts[block + 1] - first
    rows = blocks.rows[blocks.row_starts[block] : blocks.row_starts[block + 1]]
    size = k + len(rows)
    height = (size + STEP - 1) // STEP * STEP
    column[:k] = y[first : first + k]
    for h in range(len(rows)):
        v = rows[h]
        column[k + h, 0], column[k + h, 1], column[k + h, 2] = y[v, 0], y[v, 1], y[v, 2]
    column[size:height] = 0.0
    at = blocks.down_starts[block + 1]
    for low in range(0, k, WIDTH):
        _multiply(column, blocks.downs[at : at + height * WIDTH], sums)
        at += height * WIDTH
        for h in range(min(WIDTH, k - low)):
            v = first + low + h
            y[v, 0], y[v, 1], y[v, 2] = sums[h], sums[WIDTH + h], sums[2 * WIDTH + h]


@kernel
def _multiply(vectors: Singles, panel: Singles, sums: Singles) -> None:
    """Three vectors (n, 3) times a panel (n, WIDTH) into sums (3 WIDTH,).

    The inner loop has a constant length and fetches each sum once for STEP rows, so that it
    compiles to little but fused multiply-adds.
    """
    for h in range(3 * WIDTH):
        sums[h] = 0.0
    for step in range(len(panel) // (STEP * WIDTH)):
        w = panel[step * STEP * WIDTH : (step + 1) * STEP * WIDTH]
        v = vectors[step * STEP : (step + 1) * STEP]
        a0, a1, a2, a3 = v[0, 0], v[1, 0], v[2, 0], v[3, 0]
        a4, a5, a6, a7 = v[4, 0], v[5, 0], v[6, 0], v[7, 0]
        b0, b1, b2, b3 = v[0, 1], v[1, 1], v[2, 1], v[3, 1]
        b4, b5, b6, b7 = v[4, 1], v[5, 1], v[6, 1], v[7, 1]
        c0, c1, c2, c3 = v[0, 2], v[1, 2], v[2, 2], v[3, 2]
        c4, c5, c6, c7 = v[4, 2], v[5, 2], v[6, 2], v[7, 2]
        for h in range(WIDTH):
            w0, w1, w2, w3 = w[h], w[WIDTH + h], w[2 * WIDTH + h], w[3 * WIDTH + h]
            w4, w5 = w[4 * WIDTH + h], w[5 * WIDTH + h]
            w6, w7 = w[6 * WIDTH + h], w[7 * WIDTH + h]
            sums[h] += (w0 * a0 + w1 * a1 + w2 * a2 + w3 * a3) + (
                w4 * a4 + w5 * a5 + w6 * a6 + w7 * a7
            )
            sums[WIDTH + h] += (w0 * b0 + w1 * b1 + w2 * b2 + w3 * b3) + (
                w4 * b4 + w5 * b5 + w6 * b6 + w7 * b7
            )
            sums[2 * WIDTH + h] += (w0 * c0 + w1 * c1 + w2 * c2 + w3 * c3) + (
                w4 * c4 + w5 * c5 + w6 * c6 + w7 * c7
            )


@kernel
def _symbolic(starts: Indices, columns: Indices, tree: Dissection) -> tuple[Offsets, Indices]:
    """The later unknowns that each block touches, ascending."""
    firsts, parents = tree.firsts, tree.parents
    blocks = len(parents)
    seen = np.full(len(tree.order), -1, np.int32)
    row_starts = np.zeros(blocks + 1, np.int64)
    rows = np.empty(4 * len(tree.order) + 64, np.int32)
    filled = 0
    child = np.full(blocks, -1, np.int32)  # the last child of each block, and its elder siblings
    elder = np.full(blocks, -1, np.int32)
    for b in range(blocks):
        begin, last = filled, firsts[b + 1]
        for v in range(firsts[b], last):
            for h in range(starts[v], starts[v + 1]):
                u = columns[h]
                if u >= last and seen[u] != b:
                    seen[u] = b
                    rows, filled = _append(rows, filled, u)
        c = child[b]
        while c >= 0:
            for h in range(row_starts[c], row_starts[c + 1]):
                u = rows[h]
                if u >= last and seen[u] != b:
                    seen[u] = b
                    rows, filled = _append(rows, filled, u)
            c = elder[c]
        rows[begin:filled].sort()
        row_starts[b + 1] = filled
        if parents[b] >= 0:
            elder[b], child[parents[b]] = child[parents[b]], b
    return row_starts, rows[:filled].copy()


@kernel
def _append(rows: Indices, filled: int, value: int) -> tuple[Indices, int]:
    if filled == len(rows):
        longer = np.empty(2 * len(rows), np.int32)
        longer[:filled] = rows
        rows = longer
    rows[filled] = value
    return rows, filled + 1


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
    rows: Indices = updates.rows[blocks.row_starts[block] : blocks.row_starts[block + 1]]
    return rows


@kernel
def _kept(blocks: Blocks, updates: Updates, block: int) -> Floats:
    """Where the update of a block is kept, (m, m)."""
    size = blocks.row_starts[block + 1] - blocks.row_starts[block]
    kept = updates.kept[updates.starts[block] : updates.starts[block + 1]]
    update: Floats = kept.reshape((size, size))
    return update


@kernel
def _front(
    entries: Entries, block: int, blocks: Blocks, updates: Updates, place: Indices
) -> Floats:
    """The matrix's own entries of one block; `place` gets to know where its unknowns are."""
    first, last = blocks.firsts[block], blocks.firsts[block + 1]
    touched = _touched(blocks, updates, block)
    k = last - first
    for v in range(first, last):
        place[v] = v - first
    for h in range(len(touched)):
        place[touched[h]] = k + h
    front = np.zeros((k + len(touched), k + len(touched)))
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
    _lay_panels(-G.T, blocks.ups[blocks.up_starts[block] : blocks.up_starts[block + 1]])
    down = np.empty((size, k))
    down[:k] = inverse
    down[k:] = -G
    _lay_panels(down, blocks.downs[blocks.down_starts[block + 1] : blocks.down_starts[block]])
    rest: Floats = front[k:, k:] - np.dot(G, below.T.copy())
    return rest


@kernel
def _lay_panels(matrix: Floats, panels: Singles) -> None:
    """Copy a matrix into zeroed panels, WIDTH columns after WIDTH columns."""
    rows, columns = matrix.shape
    height = (rows + STEP - 1) // STEP * STEP
    for column in range(columns):
        at = column // WIDTH * height * WIDTH + column % WIDTH
        for row in range(rows):
            panels[at + row * WIDTH] = matrix[row, column]
