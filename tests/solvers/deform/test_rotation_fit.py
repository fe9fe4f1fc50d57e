"""The nearest rotation, against the singular value decomposition, however degenerate the matrix."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.deform.rotation_fit import LANES, SCRATCH, fit_rotations


def fit(matrices: np.ndarray) -> np.ndarray:
    rotations = np.empty_like(matrices)
    for first in range(0, len(matrices), LANES):
        part = matrices[first : first + LANES].reshape(-1, 9)
        lanes = np.zeros(SCRATCH)
        lanes.reshape(-1, LANES)[:9, : len(part)] = part.T
        fit_rotations(lanes, len(part))
        fitted = lanes.reshape(-1, LANES)[9:18, : len(part)].T
        rotations[first : first + LANES] = fitted.reshape(-1, 3, 3)
    return rotations


@pytest.mark.parametrize(
    "values",
    [
        (3.0, 2.0, 1.0),
        (1.0, 1.0, 1.0),
        (1.0, 0.8, 0.0),  # a plane
        (1.0, 0.5, -0.2),  # a reflection
        (1.0, 0.5, -0.5),  # two best rotations
        (1.0, 0.5, -0.4999999),
        (0.6, 0.57, -0.56),
        (1.0, 1e-6, 0.0),  # so thin that one step does not straighten it
        (1.0, 1e-9, 0.0),
        (1.0, 0.0, 0.0),  # a line
        (1e-160, 1e-160, 1e-161),
        (1e120, 1e119, 1e118),
        (0.0, 0.0, 0.0),
    ],
)
def test_the_fit_is_a_rotation_and_no_rotation_is_better(values: tuple[float, float, float]):
    count = 300  # more than one batch, and not a multiple of it
    left = Rotation.random(count, rng=np.random.default_rng(1)).as_matrix()
    right = Rotation.random(count, rng=np.random.default_rng(2)).as_matrix()
    matrices = left * np.array(values) @ right
    rotations = fit(matrices)
    gram = rotations.transpose(0, 2, 1) @ rotations
    np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), atol=1e-14)
    assert (np.linalg.det(rotations) > 0.999).all()
    reached = np.einsum("nij,nij->n", rotations, matrices)
    np.testing.assert_allclose(reached, sum(values), rtol=1e-13, atol=1e-14 * values[0])


def test_a_rotation_is_its_own_fit():
    turns = Rotation.random(500, rng=np.random.default_rng(3)).as_matrix()
    np.testing.assert_allclose(fit(1e-5 * turns), turns, atol=1e-14)


def test_zero_gives_the_identity():
    np.testing.assert_array_equal(fit(np.zeros((1, 3, 3)))[0], np.eye(3))
