"""Benchmark: the retargeting of whole trajectories by examples.

The paper retargets 3700 frames with 8 and with 12 examples in 73 and 161 s on its machine (Celikcan
et al. 2015, section 6); here they have eight joints. The same run also measures the paper's weights
of the four nearest examples with a general sparse solver, and our paths with two feet that stand on
the ground in turn.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve

from solvers.spacetime import ACCELERATION, Constraint, position_constraint, retarget_trajectories

FRAMES = 3700
JOINTS = 8
PAPER = {8: 73.0, 12: 161.0}  # examples: seconds
BUDGET = 0.15  # [s] with eight examples
RUNS = 5
_STEP = 40  # frames for which a foot stands

Array = NDArray[np.float64]


def run(frames: int = FRAMES) -> dict[str, object]:
    """Print and return a table: seconds, the minimum of a few runs."""
    print(f"spacetime: {frames} frames of {JOINTS} joints; budget {1e3 * BUDGET:.0f} ms")
    print(f"{'examples':>8} {'ms':>8} {'held, ms':>9} {'general, ms':>12} {'paper, ms':>10}")
    rows = []
    for count, paper in PAPER.items():
        case = _case(count, frames)
        figures = {
            "examples": count,
            "s": _least(partial(retarget_trajectories, *case)),
            "held_s": _least(partial(retarget_trajectories, *case, constraints=_steps(frames))),
            "general_s": _least(partial(_general, *case)),
            "paper_s": paper,
        }
        rows.append(figures)
        print(
            f"{count:>8} {1e3 * figures['s']:8.1f} {1e3 * figures['held_s']:9.1f}"
            f" {1e3 * figures['general_s']:12.1f} {1e3 * paper:10.0f}"
        )
    return {"frames": frames, "joints": JOINTS, "budget_s": BUDGET, "rows": rows}


def _case(examples: int, frames: int) -> tuple[Array, Array, Array]:
    """Return examples (E, J, 3) of joints and of control points, and a path (T, J, 3)."""
    rng = np.random.default_rng(0)
    joints, controls = rng.normal(size=(2, examples, JOINTS, 3))
    time = np.arange(frames)[:, None, None] / 60.0
    rate, phase = rng.uniform(0.5, 2.0, (JOINTS, 3)), rng.uniform(0.0, 6.0, (JOINTS, 3))
    return joints, controls, 0.7 * np.sin(rate * time + phase)


def _steps(frames: int) -> list[Constraint]:
    """Return one constraint a frame: two control points stand on the ground in turn."""
    return [
        position_constraint(frame, frame // _STEP % 2, (0.0,), axes=(1,)) for frame in range(frames)
    ]


def _general(joints: Array, controls: Array, path: Array) -> Array:
    """Solve equations 16 to 21 with a general sparse solver; return weights (J, 4 T)."""
    frames = len(path)
    steps = sp.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(frames - 2, frames))
    smooth = ACCELERATION * sp.kron(steps, sp.eye(3), format="csr")
    weights = []
    for joint in range(path.shape[1]):
        there = path[:, joint]
        squared = np.square(there[:, None] - joints[:, joint]).sum(axis=2)
        chosen = np.argsort(squared, axis=1)[:, :4]
        goals = np.column_stack([there, np.ones(frames)]).ravel()
        rows = np.concatenate([joints[chosen, joint], np.ones((frames, 4, 1))], axis=2)
        J = _blocks(np.swapaxes(rows, 1, 2))
        S = smooth @ _blocks(np.swapaxes(controls[chosen, joint], 1, 2))
        normal = J.T @ J + S.T @ S + 0.01 * sp.eye(4 * frames)
        weights.append(spsolve(sp.csc_matrix(normal), J.T @ goals))
    return np.array(weights)


def _blocks(blocks: Array) -> sp.csr_matrix:
    """Return the matrix with these blocks (T, m, n) along its diagonal."""
    places = np.arange(len(blocks))
    return sp.csr_matrix(sp.bsr_matrix((blocks, places, np.arange(len(blocks) + 1))))


def _least(run: Callable[[], Array]) -> float:
    """Return the minimum time [s] of a few runs."""
    times = []
    for _ in range(RUNS):
        began = perf_counter()
        run()
        times.append(perf_counter() - began)
    return min(times)
