"""Tests of turns of a trunk that a tracker loses: `runtime.driving.body.steady_trunk`."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from runtime.driving.body.steady_trunk import SteadyTrunk
from solvers.retarget.trunk_turns import UPRIGHT, TrunkJoints, orientations, trunk_turns

DT = 1.0 / 30.0
# left and right hip, waist, neck, left and right shoulder
REST = np.array(
    [[0.1, 1, 0], [-0.1, 1, 0], [0, 1.2, 0], [0, 1.5, 0], [0.2, 1.45, 0], [-0.2, 1.45, 0]],
    dtype=float,
)
JOINTS = TrunkJoints(np.array([0, 1]), np.array([4, 5]), 2, 3, -1, np.full(3, -1))
UPRIGHT_TRUNK = orientations(REST, JOINTS)
ABOUT = np.array([0.0, 1.0, 0.0])


def turned(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    """The joints of a body turned about x, y and z [degrees]."""
    turn = Rotation.from_euler("xyz", [x, y, z], degrees=True)
    return turn.apply(REST - ABOUT) + ABOUT


def drawn_together(joints: np.ndarray, share: float) -> np.ndarray:
    """The same joints with hips and shoulders a share as far apart, as a tracker that is lost."""
    joints = joints.copy()
    for pair in ([0, 1], [4, 5]):
        middle = joints[pair].mean(axis=0)
        joints[pair] = middle + share * (joints[pair] - middle)
    return joints


def follow(trunk: SteadyTrunk, joints: np.ndarray, frame: float, heading: float = 0.0):
    return trunk.turns(joints, UPRIGHT_TRUNK, heading, frame * DT)


def standing() -> SteadyTrunk:
    """A trunk that has stood still for a second, until frame 29."""
    trunk = SteadyTrunk(JOINTS)
    for frame in range(30):
        follow(trunk, REST, frame)
    return trunk


def angles(turns: np.ndarray) -> np.ndarray:
    """Of pelvis and chest [degrees]."""
    return np.degrees(2.0 * np.arccos(np.clip(np.abs(turns[:2, 3]), 0.0, 1.0)))


@pytest.mark.parametrize("y", [5.0, 120.0])
def test_a_turn_that_is_seen_passes_unchanged_however_fast(y: float):
    pose = turned(x=20.0, y=y)
    expected = trunk_turns(pose, JOINTS, UPRIGHT_TRUNK, UPRIGHT)
    assert np.array_equal(follow(standing(), pose, 30), expected)


def test_a_turn_of_joints_that_are_drawn_together_is_followed_slowly():
    trunk = standing()
    lost = drawn_together(turned(y=120.0), 0.1)
    assert angles(follow(trunk, lost, 30)).max() < 15.0
    later = [angles(follow(trunk, lost, frame)) for frame in range(31, 45)]
    assert np.min(later[-1]) > 80.0
    assert (np.diff(later, axis=0) > 0.0).all()


def test_who_is_small_is_seen_as_well():
    trunk = SteadyTrunk(JOINTS)
    small = 0.3 * turned()
    for frame in range(5):
        follow(trunk, small, frame)
    assert angles(follow(trunk, 0.3 * turned(y=120.0), 5)) == pytest.approx(120.0)


def test_a_trunk_that_is_lost_stays_on_the_stage_while_the_heading_leaps():
    trunk = standing()
    lost = drawn_together(turned(), 0.1)
    for frame in (30, 31):
        follow(trunk, lost, frame)
    heading = 1.0  # the joints are given with the heading taken out
    against = drawn_together(turned(y=np.degrees(-heading)), 0.1)
    turns = follow(trunk, against, 32, heading)
    assert angles(turns) == pytest.approx(np.degrees(heading), abs=1e-3)


def test_after_a_long_gap_a_trunk_turns_at_once():
    lost = drawn_together(turned(y=120.0), 0.1)
    assert angles(follow(standing(), lost, 300)) == pytest.approx(120.0)


def test_what_is_remembered_goes_back():
    trunk = standing()
    state = trunk.snapshot()
    lost = drawn_together(turned(y=120.0), 0.1)
    first = [follow(trunk, lost, frame) for frame in (30, 31)]
    trunk.restore(state)
    assert np.array_equal([follow(trunk, lost, frame) for frame in (30, 31)], first)
    trunk.reset()
    assert angles(follow(trunk, lost, 32)) == pytest.approx(120.0)
