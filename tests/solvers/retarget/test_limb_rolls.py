"""Tests of how far limbs roll while they swing: `solvers.retarget.limb_posing.LimbPoser`."""

import numpy as np
import pytest

from solvers.retarget.limb_posing import RIDES, LimbPoser, LimbRig
from solvers.skeleton.quaternions import conjugate, multiply, rotate

DT = 1.0 / 30.0
REST = np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])  # one limb, to the left


def one_limb() -> LimbRig:
    """A limb of one bone on a root that stays as it is."""
    return LimbRig(
        order=np.arange(2),
        parents=np.array([-1, 0]),
        rest=REST,
        role=np.array([0, RIDES]),
        share=np.zeros(2),
        near=np.array([0]),
        far=np.array([1]),
        across=np.full((1, 2), -1),
        along=np.array([[1.0, 0.0, 0.0]]),
        frame=np.zeros((1, 4)),
        is_free=np.zeros(1, dtype=np.bool_),
        twisted_by=np.array([-1]),
    )


def turned(poser: LimbPoser, way: np.ndarray, time: float) -> np.ndarray:
    """The turn (4,) of the limb when the performer's points along `way` (3,)."""
    joints = np.stack([REST[0], REST[0] + way / np.linalg.norm(way)])
    trunk = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
    rotations, positions = np.empty((2, 4)), np.empty((2, 3))
    poser.begin(time)
    for _ in range(2):  # a frame may be posed again
        poser.pose(joints, trunk, np.zeros((1, 4)), rotations, positions)
    assert np.allclose(rotate(rotations[0], np.array([1.0, 0.0, 0.0])), joints[1] - joints[0])
    return rotations[0]


def angle(a: np.ndarray, b: np.ndarray) -> float:
    """Between two rotations [degrees]."""
    gap = multiply(conjugate(a), b)
    return float(np.degrees(2.0 * np.arctan2(np.linalg.norm(gap[:3]), abs(gap[3]))))


def against(angle_off: float, azimuth: float) -> np.ndarray:
    """A direction that is `angle_off` [degrees] from being opposite to the limb at rest."""
    off, around = np.radians([angle_off, azimuth])
    return np.array([-np.cos(off), np.sin(off) * np.cos(around), np.sin(off) * np.sin(around)])


def test_a_limb_that_trembles_opposite_to_its_rest_does_not_roll_over():
    poser = LimbPoser(one_limb())
    before = turned(poser, against(2.0, 0.0), 0.0)
    for frame in range(1, 8):
        now = turned(poser, against(2.0, 90.0 * (frame % 2)), frame * DT)  # a swing of 2.8 degrees
        assert angle(before, now) < 10.0  # the smallest rotation from rest rolls by 180
        before = now


def test_a_limb_rolls_on_to_where_it_would_be_alone():
    poser = LimbPoser(one_limb())
    turned(poser, against(2.0, 0.0), 0.0)
    wanted = turned(LimbPoser(one_limb()), against(10.0, 90.0), 0.0)
    gaps = [
        angle(turned(poser, against(10.0, 90.0), frame * DT), wanted) for frame in range(1, 300)
    ]
    assert gaps[0] > 30.0
    assert gaps[-1] < 1.0


@pytest.mark.parametrize("steps", [12, 90])
def test_a_limb_that_is_not_turned_far_has_no_memory(steps: int):
    poser = LimbPoser(one_limb())
    for frame in range(steps):
        way = against(70.0, 360.0 * frame / steps)
        alone = turned(LimbPoser(one_limb()), way, frame * DT)
        assert np.array_equal(turned(poser, way, frame * DT), alone)


def test_what_is_remembered_goes_back_and_is_forgotten():
    poser = LimbPoser(one_limb())
    turned(poser, against(2.0, 0.0), 0.0)
    state = poser.snapshot()
    first = turned(poser, against(2.0, 90.0), DT)
    turned(poser, against(40.0, 90.0), 2.0 * DT)
    poser.restore(state)
    assert np.array_equal(turned(poser, against(2.0, 90.0), DT), first)
    alone = turned(LimbPoser(one_limb()), against(2.0, 90.0), 0.0)
    poser.restore(state)
    assert np.array_equal(turned(poser, against(2.0, 90.0), 10.0), alone)  # after a long gap
    poser.restore(state)
    poser.reset()
    assert np.array_equal(turned(poser, against(2.0, 90.0), DT), alone)
