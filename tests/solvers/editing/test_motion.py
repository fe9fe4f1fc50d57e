"""Motions along a polyline: figure 6b, sampling against SciPy, signs, clips in time, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation, Slerp

from solvers.editing.clips_on_chains import LaidClip, with_clip
from solvers.editing.motion import Clip, Motion, motion_of_bones
from solvers.editing.part import part_of
from solvers.editing.part_pose import pose_at
from tests.solvers.editing.shapes import some_motion

seeds = st.integers(0, 2**32 - 1)


def bend(angles: list[float]) -> Motion:
    """From rest to bones that are turned by `angles` [rad] about z, within a second."""
    ends = Rotation.from_rotvec([[0.0, 0.0, angle] for angle in angles]).as_quat()
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (len(angles), 1))
    return motion_of_bones([0.0, 1.0], [1.0] * len(angles), np.stack([rest, ends]))


def angles_of(motion: Motion, count: int, time: float) -> np.ndarray:
    """The world angles [rad] about z of `count` equal bones that play a motion."""
    line = np.column_stack([np.arange(count + 1.0), np.zeros((count + 1, 2))])
    part = part_of(line, np.arange(-1, count))
    part = with_clip(part, range(count + 1), LaidClip(Clip(motion), 0.0, 1.0))
    return Rotation.from_quat(pose_at(part, time).rotations[1:]).as_rotvec()[:, 2]


def test_one_bone_turned_by_90_degrees_becomes_30_60_and_90() -> None:
    """Figure 6b."""
    motion = bend([np.pi / 2])
    assert_allclose(angles_of(motion, 3, 1.0), np.radians([30.0, 60.0, 90.0]), atol=1e-12)
    assert_allclose(angles_of(motion, 3, 0.5), np.radians([15.0, 30.0, 45.0]), atol=1e-12)


def test_bones_that_a_motion_was_taken_from_turn_as_they_did() -> None:
    turned = [0.3, 1.9, -0.4, 0.2]
    assert_allclose(angles_of(bend(turned), 4, 1.0), turned, atol=1e-12)


@given(seed=seeds, time=st.floats(-1.0, 4.0))
def test_frames_are_gone_between_as_scipy_does(seed: int, time: float) -> None:
    motion = some_motion(np.random.default_rng(seed))
    held = min(max(time, 0.0), motion.duration)
    for knot, got in enumerate(motion.at(time)):
        turns = motion.turns[:, knot]
        wanted = Rotation.from_quat(turns[0])
        if len(turns) > 1:
            wanted = Slerp(motion.times, Rotation.from_quat(turns))(held)
        assert (wanted.inv() * Rotation.from_quat(got)).magnitude() < 1e-7


def test_a_bone_may_turn_beyond_180_degrees() -> None:
    """Frame by frame it is clear which way round it went; half-way along it has turned by half."""
    times = np.linspace(0.0, 1.0, 9)
    turns = Rotation.from_rotvec(np.outer(times, [0.0, 0.0, np.radians(260.0)])).as_quat()
    motion = motion_of_bones(times, [1.0], turns[:, None])
    assert_allclose(angles_of(motion, 2, 1.0)[0], np.radians(130.0), atol=1e-12)


def test_a_clip_begins_is_held_and_comes_round() -> None:
    motion = bend([1.0])
    clip = Clip(motion, start=2.0, speed=0.5, passes=2.0)
    asked = {0.0: 0.0, 2.0: 0.0, 3.0: 0.5, 3.999: 0.9995, 4.0: 0.0, 5.0: 0.5, 6.0: 1.0, 99.0: 1.0}
    assert {time: clip.moment(time) for time in asked} == pytest.approx(asked)
    assert Clip(motion, passes=np.inf).moment(7.25) == pytest.approx(0.25)


def test_bones_without_length_are_passed_over() -> None:
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (1, 3, 1))
    motion = motion_of_bones([0.0], [0.0, 1.0, 0.0], rest)
    assert_allclose(motion.knots, [0.0, 1.0])


@pytest.mark.parametrize(
    ("times", "knots", "turns", "said"),
    [
        ([0.5], [0, 1], np.ones((1, 2, 4)), "`times`"),
        ([0.0, 0.0], [0, 1], np.ones((2, 2, 4)), "`times`"),
        ([0.0], [0.0, 0.5], np.ones((1, 2, 4)), "`knots`"),
        ([0.0], [0, 0.5, 0.5, 1], np.ones((1, 4, 4)), "`knots`"),
        ([0.0], [0, 1], np.ones((1, 3, 4)), "`turns`"),
        ([0.0], [0, 1], np.zeros((1, 2, 4)), "not zero"),
        ([0.0], [0, 1], np.full((1, 2, 4), np.nan), "finite"),
    ],
)
def test_a_motion_that_is_none_is_refused(
    times: list[float], knots: list[float], turns: np.ndarray, said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        Motion(np.array(times), np.array(knots), turns)
