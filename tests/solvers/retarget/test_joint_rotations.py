"""The meaning of a stream's rotations is found from its bones, or they are not used."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.retarget.joint_rotations import fit_rest_turn
from solvers.skeleton.quaternions import multiply, rotate

PARENTS = np.array([-1, 0, 1, 2, 1, 4])
REST = np.array(
    [[0, 1, 0], [0, 1.5, 0.1], [0.3, 1.6, 0], [0.6, 1.5, 0], [-0.3, 1.6, 0], [-0.6, 1.5, 0.1]]
)


def posed(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and rotations from rest (J, 4) of the skeleton with every joint turned."""
    turns = Rotation.random(len(PARENTS), random_state=seed).as_quat()
    positions = REST.astype(float).copy()
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            positions[joint] = positions[parent] + rotate(turns[parent], REST[joint] - REST[parent])
    return positions, turns


@given(st.integers(0, 1000))
def test_one_constant_turn_of_all_axes_is_found(seed: int) -> None:
    positions, turns = posed(seed)
    axes = Rotation.random(random_state=seed + 1).as_quat()  # from rest to the joints' axes
    stream = multiply(turns, Rotation.from_quat(axes).inv().as_quat())
    fitted = fit_rest_turn(PARENTS, REST, positions, stream)
    assert fitted is not None
    assert fitted.is_usable.all()
    found = multiply(stream, fitted.turns)
    assert (Rotation.from_quat(found) * Rotation.from_quat(turns).inv()).magnitude().max() < 1e-4


def test_a_frame_that_is_the_rest_pose_tells_the_axes_of_each_joint() -> None:
    axes = Rotation.random(len(PARENTS), random_state=3)
    whole = Rotation.from_rotvec([0.0, 0.8, 0.0])
    fitted = fit_rest_turn(PARENTS, REST, whole.apply(REST), (whole * axes).as_quat())
    assert fitted is not None
    _, turns = posed(5)
    later = (Rotation.from_quat(turns) * axes).as_quat()
    found = multiply(later, fitted.turns)
    assert (Rotation.from_quat(found) * Rotation.from_quat(turns).inv()).magnitude().max() < 1e-6


def test_rotations_that_explain_no_bone_are_not_used() -> None:
    positions, _ = posed(7)
    nonsense = Rotation.random(len(PARENTS), random_state=8).as_quat()
    assert fit_rest_turn(PARENTS, REST, positions, nonsense) is None
    assert fit_rest_turn(PARENTS, REST, positions, np.full((6, 4), np.nan)) is None
