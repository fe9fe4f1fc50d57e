"""The zero of a trunk's turns: what the sensor shows of somebody who stands upright."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from runtime.driving.body.upright import CHEST, HEAD, PELVIS, upright_at_rest, upright_in_poses
from solvers.retarget.trunk_turns import UPRIGHT, TrunkJoints, trunk_turns

# hips left and right, waist, neck, shoulders left and right, head
REST = np.array(
    [
        [0.1, 1, 0],
        [-0.1, 1, 0],
        [0, 1.25, 0],
        [0, 1.5, 0],
        [0.2, 1.5, 0],
        [-0.2, 1.5, 0],
        [0, 1.7, 0],
    ],
    dtype=np.float64,
)
JOINTS = TrunkJoints(
    hips=np.array([0, 1]), shoulders=np.array([4, 5]), waist=2, neck=3, head=6, face=np.full(3, -1)
)


def tilts(turns: np.ndarray) -> np.ndarray:
    """Degrees by which pelvis, chest and head lean."""
    up = Rotation.from_quat(turns).apply([0.0, 1.0, 0.0])
    return np.degrees(np.arccos(np.clip(up[:, 1], -1.0, 1.0)))


def test_a_waist_that_a_sensor_puts_elsewhere_bends_nobody() -> None:
    seen = REST.copy()
    seen[2] += [0.0, -0.1, -0.12]  # a Kinect's spine
    seen[6] += [0.0, 0.0, -0.08]
    at_rest = upright_at_rest(REST, 0.0, JOINTS)
    assert tilts(trunk_turns(seen, JOINTS, at_rest, UPRIGHT))[:HEAD].min() > 15.0
    measured = upright_in_poses(at_rest, JOINTS, [seen])
    assert tilts(trunk_turns(seen, JOINTS, measured, UPRIGHT)).max() < 1e-3


@pytest.mark.parametrize("facing", [0.0, 0.7, -2.0])
def test_a_rest_pose_in_mid_step_does_not_turn_the_body(facing: float) -> None:
    about = Rotation.from_rotvec([0.0, facing, 0.0])
    twisted = REST.copy()
    twisted[:2] = Rotation.from_rotvec([0.0, 0.3, 0.0]).apply(REST[:2])
    at_rest = upright_at_rest(about.apply(twisted), facing, JOINTS)
    straight = trunk_turns(about.apply(REST), JOINTS, at_rest, UPRIGHT)
    for part in (PELVIS, CHEST):
        assert Rotation.from_quat(straight[part]).magnitude() < 1e-9


def test_bending_forward_bends_by_as_much() -> None:
    at_rest = upright_at_rest(REST, 0.0, JOINTS)
    upright = upright_in_poses(at_rest, JOINTS, [REST])
    bent = REST.copy()
    bent[3:] = REST[2] + Rotation.from_rotvec([0.6, 0.0, 0.0]).apply(REST[3:] - REST[2])
    turns = trunk_turns(bent, JOINTS, upright, UPRIGHT)
    assert tilts(turns)[PELVIS] < 1e-6
    np.testing.assert_allclose(tilts(turns)[1:], np.degrees(0.6), atol=1e-6)


def test_who_lies_down_is_not_measured() -> None:
    at_rest = upright_at_rest(REST, 0.0, JOINTS)
    lying = Rotation.from_rotvec([1.5, 0.0, 0.0]).apply(REST)
    np.testing.assert_array_equal(upright_in_poses(at_rest, JOINTS, [lying]), at_rest)


def test_the_level_trunk_of_an_animal_is_the_zero_of_its_turns() -> None:
    pose = np.append(REST, [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]], axis=0)  # with feet
    hips = np.array([0.0, 1.0, 0.0])
    pose[2:7] = hips + Rotation.from_rotvec([1.5, 0.0, 0.0]).apply(REST[2:] - hips)
    at_rest = upright_at_rest(pose, 0.0, JOINTS, (7, 8))
    assert tilts(trunk_turns(pose, JOINTS, at_rest, UPRIGHT)).max() < 1e-3


def test_who_lies_in_the_rest_pose_stands_upright_for_the_zero_of_the_turns() -> None:
    pose = np.append(REST, [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]], axis=0)
    lying = Rotation.from_rotvec([1.5, 0.0, 0.0]).apply(pose)
    at_rest = upright_at_rest(lying, 0.0, JOINTS, (7, 8))
    assert tilts(trunk_turns(pose, JOINTS, at_rest, UPRIGHT)).max() < 1e-3
