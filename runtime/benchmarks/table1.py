"""Benchmark: table 1 of Celikcan et al. 2015, frames per second for surfaces of the paper's sizes.

As in the paper, a frame of rigid deformation has three iterations, and a frame of squash and
stretch two iterations of the shape state and one of the pose state. Both are timed in turn, under
the same load.
"""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
from numba import get_num_threads

from runtime.benchmarks.torus import pulled_patch, torus
from solvers.arap import ArapSolver
from solvers.squash_stretch import SquashStretchSolver

# The paper's model, its vertices, its frames a second with ARAP and with its own method on four
# cores of 2.6 GHz, and our goal in frames a second.
TABLE = (
    ("Cactus", 620, 86.1, 69.7, 2000),
    ("T-Rex", 5621, 9.0, 7.5, 400),
    ("Armadillo", 10488, 4.1, 3.5, 200),
    ("Bird", 5302, 8.9, 7.6, 400),
)
ITERATIONS = 3
REPEATS = 101


def run() -> dict[str, object]:
    """Print and return our table beside the paper's."""
    print(f"table 1: frames a second, {ITERATIONS} iterations a frame, {get_num_threads()} threads")
    print(
        f"{'model':<10} {'vertices':>8} {'ARAP':>7} {'paper':>6} {'squash':>7} {'paper':>6}"
        f" {'goal':>6} {'squash/ARAP time':>17}"
    )
    rows = []
    for model, vertices, paper_arap, paper_squash, goal in TABLE:
        row = _measure(vertices)
        rows.append({"model": model, "paper_arap": paper_arap, "paper_squash": paper_squash, **row})
        print(
            f"{model:<10} {row['vertices']:>8} {row['arap_fps']:7.0f} {paper_arap:6.1f}"
            f" {row['squash_fps']:7.0f} {paper_squash:6.1f} {goal:6d} {row['ratio']:17.2f}",
            flush=True,
        )
    return {"threads": get_num_threads(), "models": rows}


def _measure(count: int) -> dict[str, Any]:
    vertices, faces = torus(count)
    handles, targets = pulled_patch(vertices)
    solvers = {
        "arap": ArapSolver(vertices, faces, handles),
        "squash": SquashStretchSolver(vertices, faces, handles),
    }
    out = np.empty_like(vertices)
    times: dict[str, list[float]] = {name: [] for name in solvers}
    swing = 0.05 * (targets - vertices[handles])
    for frame in range(REPEATS):
        goals = targets + np.sin(0.3 * frame) * swing
        for name, solver in solvers.items():
            start = perf_counter()
            solver.solve(goals, ITERATIONS, out=out)
            times[name].append(perf_counter() - start)
    arap, squash = (float(np.median(times[name])) for name in ("arap", "squash"))
    return {
        "vertices": len(vertices),
        "arap_fps": 1.0 / arap,
        "squash_fps": 1.0 / squash,
        "ratio": squash / arap,
    }
