"""Hips move over planted feet that would slide, come back slowly, and heed no noise."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.retarget.hip_shift import FARTHEST, HipShift
from tests.runtime.snapshots import digest, leaves

LEG = 0.9
RATE = 60.0
BOTH, LEFT_ONLY, NONE = (
    np.array([[True, False], [True, False]]),
    np.array([[True, False], [False, False]]),
    np.zeros((2, 2), dtype=np.bool_),
)


def feet(left: float, right: float) -> np.ndarray:
    """Two feet (2, 2, 3) at places along x."""
    out = np.zeros((2, 2, 3))
    out[0, :, 0], out[1, :, 0] = left, right
    return out


def perform(shift: HipShift, ours, theirs, stands) -> np.ndarray:
    """The shifts (T,) along x."""
    return np.array(
        [
            shift.follow(feet(*a), feet(*b), s, i / RATE)[0]
            for i, (a, b, s) in enumerate(zip(ours, theirs, stands, strict=True))
        ]
    )


def test_a_planted_foot_that_would_slide_stays_as_the_hips_move() -> None:
    slides = np.linspace(0.0, 0.05, 30)
    ours, theirs = [(x, 0.0) for x in slides], [(0.0, 0.0)] * 30
    shifts = perform(HipShift(np.array([LEG, LEG])), ours, theirs, [LEFT_ONLY] * 30)
    np.testing.assert_allclose(slides + shifts, 0.0, atol=0.006)


def test_hips_go_between_two_planted_feet() -> None:
    apart = np.linspace(0.0, 0.1, 30)
    hips = HipShift(np.array([LEG, LEG]))
    shifts = perform(hips, [(x, -x) for x in apart], [(0.0, 0.0)] * 30, [BOTH] * 30)
    np.testing.assert_allclose(shifts, 0.0, atol=1e-12)


def test_the_performers_own_sliding_and_noise_move_no_hips() -> None:
    places = np.random.default_rng(0).normal(0.0, 0.05, (60, 2))
    shifts = perform(HipShift(np.array([LEG, LEG])), places, places, [BOTH] * 60)
    np.testing.assert_array_equal(shifts, 0.0)


def test_a_foot_that_comes_or_goes_makes_no_jump() -> None:
    ours = [(0.001 * i, 0.3 - 0.002 * i) for i in range(90)]
    stands = [LEFT_ONLY] * 30 + [BOTH] * 30 + [NONE] * 30
    shifts = perform(HipShift(np.array([LEG, LEG])), ours, [(0.0, 0.0)] * 90, stands)
    assert np.abs(np.diff(shifts)).max() < 0.0025
    assert (np.diff(np.abs(shifts[60:])) <= 0.0).all(), "it only comes back in the air"


def test_it_comes_back_and_is_never_far() -> None:
    hips = HipShift(np.array([LEG, LEG]))
    ours = [(0.02 * i, 0.02 * i) for i in range(120)]  # 1.2 m/s
    shifts = perform(hips, ours, [(0.0, 0.0)] * 120, [BOTH] * 120)
    assert 0.1 * LEG < np.abs(shifts).max() <= FARTHEST * LEG + 1e-12
    for i in range(120, 1200):
        last = hips.follow(feet(2.4, 2.4), feet(0.0, 0.0), NONE, i / RATE)[0]
    assert abs(last) < 0.01 * LEG


@pytest.mark.parametrize("then", [-1.0, 9.0, np.nan])
def test_it_starts_anew_where_time_leaps(then: float) -> None:
    hips = HipShift(np.array([LEG, LEG]))
    perform(hips, [(0.01 * i, 0.0) for i in range(9)], [(0.0, 0.0)] * 9, [LEFT_ONLY] * 9)
    assert (hips.follow(feet(0.0, 0.0), feet(0.0, 0.0), BOTH, then) == 0.0).all()


def test_going_on_from_a_snapshot_gives_the_same_shifts() -> None:
    hips = HipShift(np.array([LEG, LEG]))
    perform(hips, [(0.01 * i, 0.0) for i in range(9)], [(0.0, 0.0)] * 9, [BOTH] * 9)
    state = hips.snapshot()
    before = digest(state)
    assert list(leaves(state))

    def go_on() -> bytes:
        return b"".join(
            hips.follow(feet(0.01 * i, 0.1), feet(0.0, 0.0), BOTH, i / RATE).tobytes()
            for i in range(9, 20)
        )

    first = go_on()
    assert digest(state) == before
    hips.reset()
    hips.restore(state)
    assert go_on() == first
