"""Solvers may run on several threads, whichever way numba starts its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[3]

SOLVE = """
from concurrent.futures import ThreadPoolExecutor
import numba
import numpy as np
from solvers.arap import ArapSolver

n = 150  # more vertices than a mesh that one thread solves
x = np.stack(np.meshgrid(np.arange(n), np.arange(n), [0.0]), axis=-1).reshape(-1, 3)
a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
faces = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)])
handles = [0, n - 1, n * n - 1]

def solve(_):
    solver = ArapSolver(x, faces, handles)
    return [solver.solve(x[handles] + [[0, 0, lift], [0, 0, 0], [0, 0, 0]]) for lift in range(4)]

alone = solve(0)
assert numba.threading_layer() == "workqueue"
with ThreadPoolExecutor(2) as pool:
    for together in pool.map(solve, range(2)):
        np.testing.assert_array_equal(together, alone)
"""


def test_two_solvers_on_two_threads_do_not_disturb_each_other():
    run = subprocess.run(
        [sys.executable, "-c", SOLVE],
        cwd=CHECKOUT,
        env={**os.environ, "NUMBA_THREADING_LAYER": "workqueue", "NUMBA_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
