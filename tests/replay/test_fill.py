"""Filling gaps: joints that were not seen get plausible places and a flag."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from devices.skeleton import Skeleton, SkeletonFrame
from replay.fill import Filler, turn
from tests.thorough import examples

# root at the origin, elbow 1 m along +X, hand 1 m further along +X; the child index is smaller
# than its parent's on purpose.
ARM = Skeleton(
    ("hand", "elbow", "root"),
    np.array([1, 2, -1]),
    np.array([[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
)
UP = np.array([[0.0, 4.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]])  # twice as large, along +Y
NAN = np.full(3, math.nan)


def frame(time: float, positions: np.ndarray, performer: int = 0) -> SkeletonFrame:
    seen = np.isfinite(positions).all(axis=1)
    return SkeletonFrame(time, positions, None, seen.astype(float), performer)


def without(positions: np.ndarray, *joints: str) -> np.ndarray:
    out = positions.copy()
    for joint in joints:
        out[ARM.index(joint)] = NAN
    return out


def test_what_was_seen_is_not_touched() -> None:
    filled = Filler(ARM).fill(frame(0.0, UP))
    np.testing.assert_array_equal(filled.positions, UP)
    assert not filled.filled.any()


def test_a_hidden_joint_is_held_relative_to_its_parent() -> None:
    filler = Filler(ARM)
    filler.fill(frame(0.0, UP))
    moved = np.add(UP, [1.0, 0.0, 0.0])
    filled = filler.fill(frame(0.4, without(moved, "hand")))
    np.testing.assert_allclose(filled.positions, moved)
    assert filled.filled.tolist() == [True, False, False]


def test_then_it_turns_to_rest_with_the_performers_own_bone_length() -> None:
    filler = Filler(ARM, keep=0.5, ease=1.0)
    filler.fill(frame(0.0, UP))
    half = filler.fill(frame(1.0, without(UP, "hand"))).positions[0]
    np.testing.assert_allclose(half, [2 * math.sqrt(0.5), 2 + 2 * math.sqrt(0.5), 0.0])
    quarter = math.pi / 2 * (3 * 0.25**2 - 2 * 0.25**3)
    early = Filler(ARM)
    early.fill(frame(0.0, UP))
    np.testing.assert_allclose(
        early.fill(frame(0.75, without(UP, "hand"))).positions[0],
        [2 * math.sin(quarter), 2 + 2 * math.cos(quarter), 0.0],
    )
    for time in (1.5, 1e6):
        rest = filler.fill(frame(time, without(UP, "hand"))).positions[0]
        np.testing.assert_allclose(rest, [2.0, 2.0, 0.0], atol=1e-12)


def test_it_is_held_again_after_it_was_seen_again() -> None:
    filler = Filler(ARM)
    filler.fill(frame(0.0, UP))
    filler.fill(frame(9.0, without(UP, "hand")))
    filler.fill(frame(9.1, UP))
    np.testing.assert_allclose(filler.fill(frame(9.5, without(UP, "hand"))).positions, UP)


def test_a_joint_never_seen_rests_at_the_performers_size() -> None:
    filled = Filler(ARM).fill(frame(0.0, without(UP, "hand")))
    np.testing.assert_allclose(filled.positions[0], [2.0, 2.0, 0.0])


def test_nobody_in_view_is_the_rest_pose_then_the_last_place() -> None:
    filler = Filler(ARM)
    nobody = np.full((3, 3), math.nan)
    filled = filler.fill(frame(0.0, nobody))
    np.testing.assert_array_equal(filled.positions, ARM.rest_positions)
    assert filled.filled.all()
    filler.fill(frame(1.0, np.add(UP, [0.0, 0.0, 7.0])))
    np.testing.assert_allclose(
        filler.fill(frame(1.5, nobody)).positions, np.add(UP, [0.0, 0.0, 7.0])
    )
    gone = filler.fill(frame(99.0, nobody)).positions
    np.testing.assert_allclose(gone, 2 * ARM.rest_positions + [0.0, 0.0, 7.0], atol=1e-12)


def test_a_hidden_root_goes_along_with_what_is_seen() -> None:
    filler = Filler(ARM)
    filler.fill(frame(0.0, UP))
    moved = np.add(UP, [0.0, 0.0, 3.0])
    for time in (0.1, 0.2, 50.0):
        filled = filler.fill(frame(time, without(moved, "root", "elbow")))
        assert filled.filled.tolist() == [False, True, True]
        if time < 0.5:
            np.testing.assert_allclose(filled.positions, moved)


def test_what_lies_beyond_a_hundred_metres_was_not_seen() -> None:
    filler = Filler(ARM)
    filler.fill(frame(0.0, UP))
    for wrong in (100.1, -1e300, math.inf):
        far = UP.copy()
        far[0, 1] = wrong
        filled = filler.fill(frame(0.1, far))
        np.testing.assert_allclose(filled.positions, UP)
        assert filled.filled.tolist() == [True, False, False]


def test_a_clock_that_went_back_does_not_hold_for_ever() -> None:
    filler = Filler(ARM)
    filler.fill(frame(1000.0, UP))
    np.testing.assert_allclose(filler.fill(frame(0.0, without(UP, "hand"))).positions, UP)
    rested = filler.fill(frame(2.0, without(UP, "hand"))).positions[0]
    np.testing.assert_allclose(rested, [2.0, 2.0, 0.0], atol=1e-12)


def test_performers_do_not_share_what_was_seen() -> None:
    filler = Filler(ARM)
    filler.fill(frame(0.0, UP, performer=1))
    other = filler.fill(frame(0.1, without(ARM.rest_positions, "hand"), performer=2))
    np.testing.assert_allclose(other.positions, ARM.rest_positions)
    mine = filler.fill(frame(0.2, without(UP, "hand"), performer=1))
    np.testing.assert_allclose(mine.positions, UP)


def test_bones_keep_their_length_while_they_turn() -> None:
    random = np.random.default_rng(3)
    start, end = random.normal(size=(2, 50, 3))
    end *= (np.linalg.norm(start, axis=1) / np.linalg.norm(end, axis=1))[:, None]
    end[0] = -start[0]  # opposite
    end[1] = start[1]
    for weight in np.linspace(0.0, 1.0, 9):
        between = turned(start, end, weight)
        np.testing.assert_allclose(np.linalg.norm(between, axis=1), np.linalg.norm(start, axis=1))
    np.testing.assert_allclose(turned(start, end, 0.0), start, atol=1e-12)
    np.testing.assert_allclose(turned(start, end, 1.0), end, atol=1e-9)


def turned(start: np.ndarray, end: np.ndarray, weight: float) -> np.ndarray:
    out = np.empty_like(start)
    for index in range(len(start)):
        turn(start[index], end[index], weight, out[index])
    return out


@settings(max_examples=examples(200), deadline=None)
@given(
    arrays(
        np.float64,
        (6, 3, 3),
        elements=st.floats(allow_nan=True, allow_infinity=True, width=64),
    ),
    arrays(np.float64, 6, elements=st.floats(-1e6, 1e6)),
)
def test_nothing_is_ever_nan(positions: np.ndarray, times: np.ndarray) -> None:
    filler = Filler(ARM)
    for index in range(6):
        filled = filler.fill(SkeletonFrame(times[index], positions[index], None, np.zeros(3)))
        assert np.isfinite(filled.positions).all()
        assert (filled.filled | (filled.positions == positions[index]).all(axis=1)).all()


def test_a_frame_of_another_skeleton_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\(3, 3\)"):
        Filler(ARM).fill(SkeletonFrame(0.0, np.zeros((2, 3)), None, np.ones(2)))
