from __future__ import annotations

import numpy as np
import pytest

from solvers.continuity import DAMPING, FURTHEST_STEP, exchanged, expected

# Two hands, two feet and a head.
PARTNER = np.array([1, 0, 3, 2, 4])
GROUP = np.array([0, 0, 1, 1, -1])
STANDING = np.array(
    [[0.5, 1.0, 0.0], [-0.5, 1.0, 0.0], [0.15, 0.0, 0.0], [-0.15, 0.0, 0.0], [0.0, 1.6, 0.0]]
)


def test_a_motion_goes_on_damped() -> None:
    last, velocity = np.zeros((2, 3)), np.array([[1.0, 0.0, 0.0], [0.0, -2.0, 0.0]])
    np.testing.assert_allclose(
        expected(last, velocity, np.array([0.1, 0.05])), DAMPING * 0.1 * np.sign(velocity)
    )


def test_nothing_is_expected_far_away() -> None:
    far = expected(np.zeros((1, 3)), np.array([[3.0, 4.0, 0.0]]) * 1e3, np.array([1.0]))
    np.testing.assert_allclose(far, [[0.6 * FURTHEST_STEP, 0.8 * FURTHEST_STEP, 0.0]])


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
    assert not exchanged(STANDING[PARTNER], np.full((5, 3), np.nan), PARTNER, GROUP).any()


def test_a_limb_that_moves_is_not_exchanged() -> None:
    moved = STANDING.copy()
    moved[0] = [-0.3, 1.2, 0.2]  # the left hand reaches across, the right stays
    assert not exchanged(moved, STANDING, PARTNER, GROUP).any()
