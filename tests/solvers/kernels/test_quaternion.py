"""Quaternions inside compiled loops are rotations as SciPy knows them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.kernels.quaternion import matrix, power


def test_a_matrix_is_that_of_its_rotation() -> None:
    for rotation in Rotation.random(20, random_state=1):
        np.testing.assert_allclose(
            matrix(tuple(rotation.as_quat())), rotation.as_matrix(), atol=1e-15
        )


@pytest.mark.parametrize("share", [1.0, 0.75, 0.3])
@pytest.mark.parametrize("degrees", [0.0, 30.0, 179.0, 181.0, 270.0, 359.0])
def test_a_turn_is_scaled_even_beyond_half_a_turn(share: float, degrees: float) -> None:
    axis, half = np.array([1.0, -2.0, 2.0]) / 3.0, np.radians(degrees) / 2.0

    def turn(angle: float) -> tuple[float, ...]:
        return (*(np.sin(angle) * axis).tolist(), float(np.cos(angle)))

    np.testing.assert_allclose(power(turn(half), share), turn(share * half), atol=1e-12)
