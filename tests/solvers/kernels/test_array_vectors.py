"""Where numba's internals have changed, kernels give the same answers with public parts only."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.thorough import THOROUGH

CHECKOUT = Path(__file__).resolve().parents[3]

SOLVE = """
import numpy as np
from solvers.arap import ArapSolver
n = 12
x = np.stack(np.meshgrid(np.arange(n), np.arange(n), [0.0]), axis=-1).reshape(-1, 3)
a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
faces = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)])
solver = ArapSolver(x, faces, [0, n - 1, n * n - 1])
answer = solver.solve(x[[0, n - 1, n * n - 1]] + [[0, 0, 3], [0, 0, 0], [0, 0, 0]])
"""
WITHOUT = """
import sys
sys.modules["solvers.kernels.llvm_vectors"] = None
import pytest
code = pytest.main(["-q", "-p", "no:cacheprovider", "tests/solvers/kernels/test_vectors.py",
                    "tests/solvers/linear/test_panels.py"])
assert code == 0, code
from solvers.kernels import vectors
assert vectors.load.__module__ == "solvers.kernels.array_vectors"
"""


@pytest.mark.skipif(not THOROUGH, reason="compiles for 20 s: BUNRAKU_THOROUGH=1 runs it")
def test_arrays_do_what_vectors_do(tmp_path: Path):
    script = f"{WITHOUT}{SOLVE}\nnp.save(r'{tmp_path / 'answer.npy'}', answer)"
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=CHECKOUT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr
    ours: dict[str, np.ndarray] = {}
    exec(SOLVE, ours)
    # Products and sums are rounded together or apart, in a factor of single precision.
    np.testing.assert_allclose(np.load(tmp_path / "answer.npy"), ours["answer"], atol=1e-6)
