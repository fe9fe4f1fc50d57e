"""Expected places of points, and limbs whose names are exchanged."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.signal.continuity import DAMPING, FURTHEST_STEP, exchanged, expect

# Two hands, two feet and a head.
PARTNER = np.array([1, 0, 3, 2, 4])
GROUP = np.array([0, 0, 1, 1, -1])
STANDING = np.array(
    [[0.5, 1.0, 0.0], [-0.5, 1.0, 0.0], [0.15, 0.0, 0.0], [-0.15, 0.0, 0.0], [0.0, 1.6, 0.0]]
)


def expected(last: np.ndarray, velocity: np.ndarray, gap: float) -> np.ndarray:
    wanted = np.empty(3)
    expect(last, velocity, gap, wanted)
    return wanted


def test_a_motion_goes_on_damped() -> None:
    last, velocity = np.array([0.5, 0.0, 0.0]), np.array([1.0, -2.0, 0.0])
    for gap in (0.1, -0.1):
        np.testing.assert_allclose(
            expected(last, velocity, gap), last + DAMPING * gap * velocity, rtol=1e-12
        )


def test_nothing_is_expected_far_away() -> None:
    for sign in (1.0, -1.0):
        far = expected(np.zeros(3), np.array([3.0, 4.0, 0.0]) * 1e3, sign)
        np.testing.assert_allclose(far, sign * FURTHEST_STEP * np.array([0.6, 0.8, 0.0]))


@pytest.mark.parametrize("groups", [(0,), (1,), (0, 1), ()])
def test_exchanged_limbs_are_told_each_by_itself(groups: tuple[int, ...]) -> None:
    seen = np.where(np.isin(GROUP, groups)[:, None], STANDING[PARTNER], STANDING)
    seen = seen + 0.02 * np.random.default_rng(0).normal(size=seen.shape)
    told = exchanged(seen, STANDING, PARTNER, GROUP)
    assert np.flatnonzero(told).tolist() == list(groups)


def test_limbs_that_are_together_or_unseen_are_left_alone() -> None:
    together = STANDING * [0.05, 1.0, 1.0]
    assert not exchanged(together[PARTNER], together, PARTNER, GROUP).any()
    hidden = STANDING[PARTNER].copy()
    hidden[[0, 2]] = np.nan
    assert not exchanged(hidden, STANDING, PARTNER, GROUP).any()
    assert not exchanged(STANDING[PARTNER], hidden[PARTNER], PARTNER, GROUP).any()
    assert not exchanged(STANDING[PARTNER], np.full((5, 3), np.nan), PARTNER, GROUP).any()


def test_what_is_unseen_of_a_limb_does_not_hide_the_exchange_of_the_rest() -> None:
    group = np.array([0, 0, 0, 0, -1])
    seen = STANDING[PARTNER].copy()
    seen[0] = np.nan
    assert exchanged(seen, STANDING, PARTNER, group).all()


def test_a_limb_that_moves_is_not_exchanged() -> None:
    moved = STANDING.copy()
    moved[0] = [-0.3, 1.2, 0.2]  # the left hand reaches across, the right stays
    assert not exchanged(moved, STANDING, PARTNER, GROUP).any()
