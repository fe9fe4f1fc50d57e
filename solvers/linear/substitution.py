"""Solves with a block factor by forward and backward substitution, for the global step.

The tasks' subtrees are climbed at the same time, then the blocks above them are climbed and
descended, then the subtrees are descended at the same time.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.linear.blocks import Blocks, Index, Panels, Schedule, Workspace
from solvers.linear.laplacian import Floats
from solvers.linear.panels import Singles, multiply


@parallel_kernel
def add_solution(
    blocks: Blocks, panels: Panels, schedule: Schedule, b: Floats, x: Floats, work: Workspace
) -> None:
    """Add the solution y of A y = b, both (n, 3), to the first n rows of x."""
    for task in prange(len(schedule.task_firsts)):
        _climb(blocks, panels, schedule, np.int64(task), b, work)
    _turn(blocks, panels, schedule, b, x, work)
    for task in prange(len(schedule.task_firsts)):
        _descend(blocks, panels, schedule, np.int64(task), x, work)


@kernel
def _climb(
    blocks: Blocks, panels: Panels, schedule: Schedule, task: Index, b: Floats, work: Workspace
) -> None:
    """Forward substitution in a task's subtree."""
    first, last = np.int64(schedule.task_firsts[task]), np.int64(schedule.task_lasts[task])
    y = work.vectors
    for v in range(blocks.firsts[first], blocks.firsts[last + 1]):
        y[v, 0], y[v, 1], y[v, 2] = b[v, 0], b[v, 1], b[v, 2]
    copies = len(b) + task * len(schedule.shared)
    y[copies : copies + len(schedule.shared)] = 0.0
    _send_up(blocks, panels, first, last, y, work.sums[task])


@kernel
def _turn(
    blocks: Blocks, panels: Panels, schedule: Schedule, b: Floats, x: Floats, work: Workspace
) -> None:
    """Both substitutions in the blocks above the tasks; the tasks' updates are added in order."""
    shared, tasks = schedule.shared, len(schedule.task_firsts)
    y = work.vectors
    for h in range(len(shared)):
        v = shared[h]
        for d in range(3):
            y[v, d] = b[v, d]
            for t in range(tasks):
                y[v, d] += y[len(b) + t * len(shared) + h, d]
    for t in range(len(schedule.tops)):
        block = np.int64(schedule.tops[t])
        _send_up(blocks, panels, block, block, y, work.sums[tasks])
    for t in range(len(schedule.tops) - 1, -1, -1):
        block = np.int64(schedule.tops[t])
        _send_down(blocks, panels, block, block, y, work.sums[tasks])
    for h in range(len(shared)):
        v = shared[h]
        for d in range(3):
            x[v, d] += y[v, d]
            for t in range(tasks):
                y[len(b) + t * len(shared) + h, d] = y[v, d]


@kernel
def _descend(
    blocks: Blocks, panels: Panels, schedule: Schedule, task: Index, x: Floats, work: Workspace
) -> None:
    """Backward substitution in a task's subtree; the solution is added to x."""
    first, last = np.int64(schedule.task_firsts[task]), np.int64(schedule.task_lasts[task])
    y = work.vectors
    _send_down(blocks, panels, first, last, y, work.sums[task])
    for v in range(blocks.firsts[first], blocks.firsts[last + 1]):
        for d in range(3):
            x[v, d] += y[v, d]


@kernel
def _send_up(
    blocks: Blocks, panels: Panels, first: Index, last: Index, y: Singles, sums: Singles
) -> None:
    """Forward substitution of blocks first to last: each takes G b from later unknowns."""
    firsts, starts, reach = blocks.firsts, blocks.reach_starts, blocks.reach
    for block in range(first, last + 1):
        begin, end = starts[block], starts[block + 1]
        later = begin + firsts[block + 1] - firsts[block]
        at = blocks.up_starts[block]
        multiply(panels.ups, at, end - later, y, reach, begin, later, sums)
        for h in range(end - later):
            v = np.uint64(reach[later + h])
            y[v, 0] += sums[0, h]
            y[v, 1] += sums[1, h]
            y[v, 2] += sums[2, h]


@kernel
def _send_down(
    blocks: Blocks, panels: Panels, first: Index, last: Index, y: Singles, sums: Singles
) -> None:
    """Backward substitution of blocks last to first: inverse times b, less G^T times the later."""
    firsts, starts, reach = blocks.firsts, blocks.reach_starts, blocks.reach
    for block in range(last, first - 1, -1):
        begin, end = starts[block], starts[block + 1]
        k = firsts[block + 1] - firsts[block]
        multiply(panels.downs, blocks.down_starts[block + 1], k, y, reach, begin, end, sums)
        for h in range(k):
            v = np.uint64(reach[begin + h])
            y[v, 0], y[v, 1], y[v, 2] = sums[0, h], sums[1, h], sums[2, h]
