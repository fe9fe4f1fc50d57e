"""A look through a recording before it is played."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.driving.choices import Choices
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.rehearsal import POSES, rehearse
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    T_POSE,
    frame,
    make_figure,
    pose,
    record,
)

FIGURE = make_figure()
BENT = {"ElbowLeft": (0.0, 0.0, 1.5), "ElbowRight": (0.0, 1.5, 0.0)}


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(FIGURE)


def session_of(puppet: Puppet, source: str = "whole") -> MatchSession:
    puppet.rest()
    hand = Mapping(ARMS)
    return MatchSession(Performer(BODY, source), [puppet], lambda: FRONT_VIEW, Choices(), [hand])


def moves(puppet: Puppet, positions: np.ndarray) -> float:
    puppet.follow(Performer(BODY).follow(frame(positions)))
    return float(np.abs(puppet.deform().vertices - FIGURE.vertices).max())


@pytest.mark.parametrize("count", [1, 2, 7, POSES, 4 * POSES])
def test_the_first_the_last_and_those_between_are_looked_at(puppet: Puppet, count: int) -> None:
    for best in {0, count - 1}:
        poses = [pose(BENT)] * count
        poses[best] = pose(T_POSE)
        match_session = session_of(puppet)
        filled = rehearse(record(poses), "whole", match_session)
        assert filled is not None
        assert len(filled) == 1
        assert not match_session.matching
        assert moves(puppet, pose(T_POSE)) < 1e-9


def test_what_is_filled_holds_the_poses_of_the_recording(puppet: Puppet) -> None:
    raised = {"ShoulderLeft": (0.0, 0.0, 1.9)}
    match_session = session_of(puppet)
    reaches = rehearse(record([pose(T_POSE)] * 4 + [pose(raised)] * 4), "whole", match_session)
    low, high = reaches[0].path
    np.testing.assert_array_equal(reaches[0].around, reaches[0].path)  # nobody travels
    rest = FIGURE.vertices
    assert high[1] > rest[:, 1].max() + 0.1, "the raised arm is above the head"
    assert (low <= rest.min(axis=0) + 1e-6).all()
    assert (high >= rest.max(axis=0) - 1e-6).all()


def test_only_the_lead_is_looked_at(puppet: Puppet) -> None:
    """The second performer strikes the better pose."""
    poses = [pose(BENT), pose(T_POSE)] * 6
    match_session = session_of(puppet)
    rehearse(record(poses, performers=[3, 1] * 6), "whole", match_session)
    assert moves(puppet, pose(BENT)) < 1e-9
    assert moves(puppet, pose(T_POSE)) > 0.1


def test_poses_of_which_too_little_is_seen_are_left_out(puppet: Puppet) -> None:
    hidden = pose(T_POSE)
    hidden[:] = np.nan
    match_session = session_of(puppet)
    assert rehearse(record([hidden] * 5), "whole", match_session) is None
    assert match_session.matching, "it matches as it would live"
    assert match_session.mappings[0].drives == ()
    assert rehearse(record([hidden, hidden, pose(T_POSE)]), "whole", match_session) is not None
    assert not match_session.matching
    assert moves(puppet, pose(T_POSE)) < 1e-9
