"""Characters ease over everything that a puppeteer changes while a show runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.bodies.plan_by_names import plan_by_names
from replay.player import EveryFrame, Player
from runtime.control.actions import ACTIONS, press
from runtime.driving.drivers import DRIVERS
from runtime.driving.unfreeze_blend import SECONDS
from runtime.show.show import Show
from tests.runtime.stick_figures import T_POSE, make_figure, pose, record
from tests.thorough import examples

RATE = 30.0
EASING = round(SECONDS * RATE)
HEIGHT = 1.8
SMALL = 0.01  # of the height: no jump
BENT = {"ShoulderLeft": (0.0, 0.0, 1.2), "ElbowRight": (0.0, 1.2, 0.0), "HipLeft": (-0.6, 0, 0)}


class Still:
    """A show of somebody who stands still, in another pose than at first, and off the middle."""

    def __init__(self) -> None:
        poses = [pose(T_POSE), *[pose(BENT, heading=0.5, moved=(0.4, 0.0, 0.2))] * 400]
        figure = make_figure()
        body = replace(figure, plan=plan_by_names(figure.skeleton))
        self.player = Player(record(poses, rate=RATE), EveryFrame())
        self.show = Show(self.player, [body])
        self.controls = self.show.controls
        self.shown = np.zeros_like(figure.vertices)

    def play(self, frames: int) -> np.ndarray:
        """The farthest step (frames,) of any vertex in each frame, in heights."""
        steps = []
        for _ in range(frames):
            if self.player.ended:
                return np.array(steps)
            self.show.tick()
            self.show.settle()
            vertices = self.show.motions[0].vertices
            steps.append(np.linalg.norm(vertices - self.shown, axis=1).max() / HEIGHT)
            self.shown = vertices.copy()
        return np.array(steps)

    def change(self, name: str) -> None:
        kind, _, value = name.partition("=")
        if kind == "drive":
            for act in self.controls.loop._acts:
                act.match_session.drive_with(DRIVERS[value])
        elif value:
            ACTIONS[kind].write(self.controls, float(value))
        else:
            press(kind, self.controls)


@pytest.fixture
def still() -> Iterator[Still]:
    show = Still()
    show.play(3 + EASING)
    yield show
    show.show.close()


CHANGES = [
    "drive=relative",
    "drive=absolute",
    "drive=auto",
    "mirror",
    "rest-pose",
    "in-place",
    "cartoon=1",
    "cartoon=0",
    "volume=0",
    "volume=0.5",
    "stiffness=0.9",
    "stiffness=0",
    "next-match",
    "accept",
    "match-again",
    "calibrate",
]


def eases(steps: np.ndarray) -> bool:
    """Whether no step is longer than three times the usual one, where any can be seen."""
    moving = steps[: EASING + 1]
    return bool(steps.max() < max(3.0 * np.median(moving), SMALL))


@settings(max_examples=examples(3), deadline=None)
@given(st.lists(st.sampled_from(CHANGES), min_size=1, max_size=4))
def test_no_vertex_jumps_whatever_is_changed_live(changes: list[str]) -> None:
    show = Still()
    show.play(3 + EASING)
    for change in changes:
        show.change(change)
        steps = show.play(20)
        assert eases(steps), (change, steps.round(4))
    show.show.close()


@pytest.mark.parametrize("change", ["drive=relative", "mirror", "rest-pose"])
def test_a_change_that_moves_the_character_arrives(still: Still, change: str) -> None:
    before = still.shown
    still.change(change)
    steps = still.play(EASING + 4)
    assert eases(steps)
    assert np.abs(still.shown - before).max() > 0.1, "nothing has changed"
    assert steps[-1] < 0.1 * SMALL
    assert steps[: EASING - 1].min() > 0.0, "it moves all the time"


def test_a_change_in_a_pause_is_seen_at_once(still: Still) -> None:
    press("pause", still.controls)
    still.change("mirror")
    press("rest-pose", still.controls)
    still.show.tick()
    assert np.abs(still.show.motions[0].vertices - still.shown).max() > 0.05
