"""The handles of a limb that is not seen soften smoothly, and become firm again smoothly."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.driving.limb_release import FIRMEST, LET_GO, LOOSEST, PATIENCE, TAKE_HOLD, LimbRelease
from runtime.driving.performer import Performer, rest_state
from runtime.puppet.puppet import Puppet
from solvers.deform.handles import HARD
from tests.runtime.stick_figures import ARMS, BODY, driven_by, frame, make_figure, pose, waving


def held(
    limb_release: LimbRelease, seen: list[bool], seconds: float, start: float
) -> list[np.ndarray]:
    weights = []
    for k in range(round(seconds * 60.0)):
        limb_release.follow(start + k / 60.0, np.array(seen))
        weights.append(limb_release.weights)
    return weights


def test_what_is_seen_is_held_firmly():
    limb_release = LimbRelease(2)
    assert all((w == HARD).all() for w in held(limb_release, [True, True], 3.0, 0.0))


def test_a_flicker_changes_nothing():
    limb_release = LimbRelease(1)
    held(limb_release, [True], 0.5, 0.0)
    for start in (0.5, 1.0, 1.5):  # however often
        assert all((w == HARD).all() for w in held(limb_release, [False], 0.9 * PATIENCE, start))
        held(limb_release, [True], 0.25, start + 0.25)


def test_a_lost_limb_lets_go_step_by_step_and_takes_hold_faster():
    limb_release = LimbRelease(2)
    held(limb_release, [True, True], 0.5, 0.0)
    gone = np.array(held(limb_release, [False, True], PATIENCE + LET_GO + 0.2, 0.5))
    assert (gone[:, 1] == HARD).all(), "the other limb is not concerned"
    soft = gone[np.isfinite(gone[:, 0]), 0]
    assert (np.diff(soft) <= 0.0).all()
    assert soft[0] > 0.3 * FIRMEST
    assert soft[-1] == pytest.approx(LOOSEST)
    assert (soft[:-1] / soft[1:]).max() < 2.1
    back = np.array(held(limb_release, [True, True], TAKE_HOLD + 0.1, 0.5 + len(gone) / 60.0))[:, 0]
    assert (np.diff(back[np.isfinite(back)]) >= 0.0).all()
    assert back[-1] == HARD


def test_a_limb_that_comes_back_elsewhere_does_not_snap():
    """The hand's largest step on coming back is far smaller than the performer's."""
    figure = make_figure()
    puppet, performer = Puppet(figure), Performer(BODY)
    start = performer.follow(frame(pose()))
    driven_by(puppet, ARMS, rest_state(start))
    arm = list(ARMS[0].source[1:])
    raised = waving(9)[4]
    steps, before = [], None
    for k in range(240):
        positions = np.array(pose() if k < 60 else raised)
        if 30 <= k < 180:
            positions[arm] = np.nan
        puppet.follow(performer.follow(frame(positions, k / 60.0)))
        vertices = puppet.deform().vertices.copy()
        if before is not None:
            steps.append(np.linalg.norm(vertices - before, axis=1).max())
        before = vertices
    coming_back = np.array(steps[178:])
    whole_way = np.linalg.norm(raised[arm[-1]] - pose()[arm[-1]])
    assert whole_way > 0.4
    assert coming_back.sum() > 0.5 * whole_way, "it does come back"
    assert coming_back.max() < 0.25 * whole_way
