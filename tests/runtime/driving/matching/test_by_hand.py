"""A mapping that the user makes in the midst of a show: it beats matches, and can be taken back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from devices.bodies.plan_by_names import plan_by_names
from devices.errors import InputError
from runtime.driving.choices import Choices
from runtime.driving.drivers import DRIVERS
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.polyline_driver import PolylineDriver
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import ARMS, BODY, FRONT_VIEW, T_POSE, frame, make_figure, pose

CROSSED = Mapping((Drive(ARMS[0].source, ARMS[1].target),))
FIGURE = make_figure()
RAISED = {"ShoulderLeft": (0.0, 0.0, 1.6)}


class Stage:
    """A puppet and its performer, a tenth of a second from pose to pose."""

    def __init__(self, drive: str = "relative", *, patience: float = 0.0) -> None:
        figure = FIGURE
        if drive == "auto":
            figure = replace(FIGURE, plan=plan_by_names(FIGURE.skeleton))
        self.puppet = Puppet(figure)
        self.performer = Performer(BODY)
        self.session = MatchSession(
            self.performer,
            [self.puppet],
            lambda: FRONT_VIEW,
            Choices(patience=patience),
            [None],
            make_driver=DRIVERS[drive],
        )
        self.time = 0.0

    def strike(self, positions: np.ndarray) -> np.ndarray:
        """The vertices as they are shown."""
        captured = frame(positions, self.time)
        followed = self.performer.follow(captured)
        self.session.direct(captured)
        self.puppet.follow(followed)
        self.time += 0.1
        return self.puppet.deform().vertices.copy()

    def snapshot(self) -> tuple:
        parts = self.performer, self.session, self.puppet
        return self.time, *(part.snapshot() for part in parts)

    def restore(self, state: tuple) -> None:
        self.time, performer, session, puppet = state
        self.performer.restore(performer)
        self.session.restore(session)
        self.puppet.restore(puppet)

    @property
    def drives(self) -> tuple[Drive, ...]:
        return self.session.mappings[0].drives


@pytest.mark.parametrize("drive", ["relative", "auto"])
def test_what_the_user_made_drives_at_once_from_the_same_rest_state(drive: str) -> None:
    stage = Stage(drive)
    stage.strike(pose(T_POSE))
    rest = stage.session.rests[0]
    stage.session.choose(0, CROSSED)
    assert stage.drives == CROSSED.drives
    assert stage.session.rests[0] is rest
    assert not stage.session.matching
    assert stage.session.matches[0].candidate.rank == 0
    for _ in range(20):
        shown = stage.strike(pose(T_POSE | RAISED))
    moved = np.linalg.norm(shown - FIGURE.vertices, axis=1)
    right, left = FIGURE.vertices[:, 0] < -0.5, FIGURE.vertices[:, 0] > 0.5
    assert moved[right].max() > 0.2, "the left arm moves the right one"
    assert moved[left].max() < 0.05


def test_the_change_departs_from_what_is_shown() -> None:
    stage = Stage()
    stage.strike(pose(T_POSE))
    for _ in range(8):
        before = stage.strike(pose(T_POSE | RAISED))
    stage.session.choose(0, CROSSED)
    step = np.abs(stage.strike(pose(T_POSE | RAISED)) - before).max()
    for _ in range(20):
        after = stage.strike(pose(T_POSE | RAISED))
    assert step < 0.5 * np.abs(after - before).max()


def test_before_a_pose_is_struck_it_waits_as_a_match_does() -> None:
    stage = Stage(patience=0.25)
    stage.session.waits = True
    for _ in range(10):
        stage.strike(pose(T_POSE))
    assert stage.session.matching, "nobody is rushed who is choosing"
    stage.session.choose(0, CROSSED)
    stage.session.waits = False
    shown = [stage.strike(pose(T_POSE)) for _ in range(2)]
    assert stage.session.matching
    assert stage.drives == CROSSED.drives
    np.testing.assert_allclose(shown[-1], FIGURE.vertices, atol=1e-9)
    for _ in range(4):
        stage.strike(pose(T_POSE))
    assert not stage.session.matching


def test_matching_again_looks_for_matches_and_keeping_goes_on_by_hand() -> None:
    stage = Stage(patience=math.inf)
    stage.strike(pose(T_POSE))
    stage.session.accept()
    matched = stage.drives
    assert matched != CROSSED.drives
    stage.session.choose(0, CROSSED)
    stage.session.match_again()
    stage.strike(pose(T_POSE))
    assert stage.drives == matched, "the best match is proposed"
    assert isinstance(stage.puppet.driver, PolylineDriver)
    assert stage.puppet.driver.mapping.drives == CROSSED.drives, "and does not drive yet"
    stage.session.keep()
    assert stage.drives == CROSSED.drives
    stage.session.next_match()
    stage.strike(pose(T_POSE))
    assert stage.drives != CROSSED.drives
    stage.session.accept()
    assert stage.puppet.driver.mapping.drives == stage.drives != CROSSED.drives


def test_a_snapshot_before_and_one_after_bring_back_what_drove_then() -> None:
    stage = Stage("auto")
    stage.strike(pose(T_POSE))
    before = stage.snapshot()
    first = stage.strike(pose(T_POSE | RAISED))
    stage.session.choose(0, CROSSED)
    stage.strike(pose(T_POSE))
    after = stage.snapshot()
    second = stage.strike(pose(T_POSE | RAISED))
    for state, shown in ((before, first), (after, second)):
        stage.restore(state)
        np.testing.assert_array_equal(stage.strike(pose(T_POSE | RAISED)), shown)


def test_what_cannot_be_driven_is_refused_and_all_goes_on() -> None:
    stage = Stage()
    stage.strike(pose(T_POSE))
    before = stage.drives
    twice = Mapping((ARMS[0], Drive(ARMS[1].source, ARMS[0].target)))
    with pytest.raises(InputError, match="cannot be driven so"):
        stage.session.choose(0, twice)
    assert stage.drives == before
    stage.strike(pose(T_POSE | RAISED))


def test_a_group_follows_one_after_the_other() -> None:
    stage = Stage()
    stage.strike(pose(T_POSE))
    both = Mapping((ARMS[0], Drive(ARMS[0].source, ARMS[1].target, delay=0.3)))
    stage.session.choose(0, both)
    right, left = FIGURE.vertices[:, 0] < -0.5, FIGURE.vertices[:, 0] > 0.5
    for _ in range(10):
        rest = stage.strike(pose(T_POSE))
    began: dict[str, int] = {}
    for step in range(10):
        moved = np.linalg.norm(stage.strike(pose(T_POSE | RAISED)) - rest, axis=1)
        for name, side in (("left", left), ("right", right)):
            if moved[side].max() > 0.1:
                began.setdefault(name, step)
    assert began["right"] - began["left"] == 3

    match = stage.session.matches[0]
    match.delay(0.1)
    assert [drive.delay for drive in stage.drives] == [0.0, 0.1]
    state = stage.snapshot()
    on = [stage.strike(pose(T_POSE)) for _ in range(4)]
    stage.restore(state)
    for shown in on:
        np.testing.assert_array_equal(stage.strike(pose(T_POSE)), shown)
