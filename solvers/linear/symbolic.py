"""Finds the blocks of a factor from the pattern of the matrix alone (symbolic factorisation).

Symbolic factorisation: which later unknowns each block touches, how much memory its panels take,
and which subtrees are solved at the same time. None of it depends on the matrix's values.
"""

from __future__ import annotations

import numpy as np

from solvers.kernels.compiled import kernel
from solvers.linear.blocks import Blocks, Entries, Index, Schedule, Updates
from solvers.linear.nested_dissection import Dissection
from solvers.linear.panels import WIDE, Indices, Offsets, panels_size

# Subtrees that are solved at the same time. A fixed number: the answer must not depend on the
# number of cores.
TASKS = 4


def plan_blocks(entries: Entries, tree: Dissection) -> tuple[Blocks, Schedule, Updates]:
    """Return the blocks of a matrix in the order of a dissection, their schedule and updates."""
    reach_starts, reach = _symbolic(entries.starts, entries.columns, tree)
    k, size = np.diff(tree.firsts).astype(np.int64), np.diff(reach_starts)
    m = size - k
    up_starts = np.append(0, np.cumsum(panels_size(k, m)))
    # The way down visits the blocks backwards; they lie backwards too, so it reads forwards.
    down_starts = np.append(0, np.cumsum(panels_size(size, k)[::-1]))[::-1].copy()
    schedule = _schedule(tree, k * size, int(np.maximum(k, m).max(initial=0)) + WIDE)
    blocks = Blocks(tree.firsts, reach_starts, reach, up_starts, down_starts)
    keepers = np.sort(np.concatenate([schedule.task_lasts, schedule.tops]))
    sizes = np.zeros(len(k), np.int64)
    sizes[keepers] = m[keepers] ** 2
    starts = np.append(0, np.cumsum(sizes))
    updates = Updates(tree.parents, reach, keepers, starts, np.zeros(starts[-1]))
    return (
        blocks._replace(reach=_private_reach(blocks, schedule, len(tree.order))),
        schedule,
        updates,
    )


def _schedule(tree: Dissection, costs: Offsets, widest: int) -> Schedule:
    """Split the tree at its top, the costliest subtree first, until there are TASKS subtrees."""
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


@kernel
def _symbolic(starts: Indices, columns: Indices, tree: Dissection) -> tuple[Offsets, Indices]:
    """Each block's own unknowns and the later ones that it touches, ascending."""
    firsts, parents = tree.firsts, tree.parents
    blocks = len(parents)
    seen = np.full(len(tree.order), -1, np.int32)
    reach_starts = np.zeros(blocks + 1, np.int64)
    reach = np.empty(4 * len(tree.order) + 64, np.int32)
    filled: Index = np.int64(0)
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
        _sort(reach[begin:filled])
        reach_starts[b + 1] = filled
        if parents[b] >= 0:
            elder[b], child[parents[b]] = child[parents[b]], b
    return reach_starts, reach[:filled].copy()


@kernel
def _append(reach: Indices, filled: Index, value: int) -> tuple[Indices, Index]:
    if filled == len(reach):
        longer = np.empty(2 * len(reach), np.int32)
        for i in range(filled):
            longer[i] = reach[i]
        reach = longer
    reach[filled] = value
    return reach, filled + 1


@kernel
def _sort(values: Indices) -> None:
    """Sort a few values, most of which are in order; numba's own sort compiles for seconds."""
    for i in range(1, len(values)):
        value = values[i]
        j = i
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
        values[j] = value
