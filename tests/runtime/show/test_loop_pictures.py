"""Pictures of a loop: how often they come, what they show, and while nobody is seen."""

from __future__ import annotations

import math

import moderngl
import numpy as np
import pytest

from replay.player import EveryFrame, Player, RealTime
from runtime.puppet.puppet import Puppet
from runtime.show.scene import NOTHING_TAKEN, Scene
from tests.runtime.show.loops import Kept, Tape, Wire, loop_of, play
from tests.runtime.stick_figures import (
    BODY,
    make_figure,
    pose,
    record,
    waving,
)
from tests.runtime.stick_figures import frame as captured

SIZE = (48, 27)


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(make_figure())


@pytest.mark.parametrize("asked", [(0.0,), (3.0,), (2.0, 7.0), (20.0,), (60.0,), (math.inf, 1.0)])
def test_pictures_come_as_often_as_asked_for(
    puppet: Puppet, context: moderngl.Context, asked: tuple[float, ...]
) -> None:
    """Of 20 frames a second, unevenly spaced; whoever asks for most sets the pace for all."""
    scene = Scene(context, SIZE, [puppet], BODY)
    kept = [Kept(rate) for rate in asked]
    recording = record([pose()] * 20, rate=20.0)
    recording.times[1:-1] += np.random.default_rng(0).uniform(-0.005, 0.005, 18)
    player = Player(recording, EveryFrame())
    play(loop_of(player, [puppet], [kept], scene=scene), player)
    scene.close()
    assert kept[0].pictured == kept[-1].pictured
    assert len(kept[0].frames) == 20
    gaps = np.diff(kept[0].pictured)
    if max(asked) == 0.0:
        assert kept[0].pictured == []
    elif max(asked) >= 20.0:
        assert len(gaps) == 19, "there are no more frames than there are"
    else:
        assert kept[0].pictured[0] == 0.0
        assert len(kept[0].pictured) >= int(0.95 * max(asked)), "never fewer than asked for"
        assert gaps.max() < 1.0 / max(asked) + 1.0 / 20.0
        assert gaps.min() > 0.7 / max(asked), "and hardly more"
    for frame in kept[0].frames:
        assert frame.picture is None or frame.picture.shape == (27, 48, 4)


def test_a_picture_shows_its_own_frame(puppet: Puppet, context: moderngl.Context) -> None:
    scene = Scene(context, SIZE, [puppet], BODY)
    kept = Kept(math.inf)
    player = Player(record([*waving(7)[:4], *waving(7)[:4]]), EveryFrame())
    play(loop_of(player, [puppet], [[kept]], scene=scene), player)
    scene.close()
    pictures = [frame.picture.astype(int) for frame in kept.frames]
    assert np.abs(pictures[3] - pictures[0]).max() > 40, "the arm went up"
    assert np.abs(pictures[7] - pictures[3]).mean() < np.abs(pictures[3] - pictures[0]).mean()


def test_who_looks_sees_every_tick(puppet: Puppet, context: moderngl.Context) -> None:
    """Also those without a frame: the camera may have moved."""
    scene = Scene(context, SIZE, [puppet], BODY)
    now = [0.0]
    player = Player(record(waving(3)), RealTime(clock=lambda: now[0]))
    loop = loop_of(player, [puppet], [[Kept()]], scene=scene, shown=True)
    assert loop.tick()
    before = scene.picture()
    scene.camera = scene.camera.orbit(0.8, 0.2)
    assert not loop.tick()
    assert np.abs(scene.picture().astype(int) - before).max() > 40
    scene.close()


def test_outputs_see_all_of_the_picture_whatever_a_panel_takes(
    puppet: Puppet, context: moderngl.Context
) -> None:
    kept: list[Kept] = []
    for taken in (NOTHING_TAKEN, (0.3, 0.0, 0.2, 0.1)):
        puppet.rest()
        puppet.surface.reset()
        scene = Scene(context, SIZE, [puppet], BODY)
        scene.taken = taken
        kept.append(Kept(math.inf))
        player = Player(record(waving(3)), EveryFrame())
        play(loop_of(player, [puppet], [kept[-1:]], scene=scene, shown=True), player)
        seen, whole = scene.picture(), kept[-1].frames[-1].picture
        assert (seen != whole).any() == (taken != NOTHING_TAKEN), "the window shows it clear"
        scene.close()
    for alone, beside in zip(*(each.frames for each in kept), strict=True):
        np.testing.assert_array_equal(alone.picture, beside.picture)


class Shown(Kept):
    """A screen somewhere else."""

    def __init__(self, pictures_a_second: float) -> None:
        super().__init__(pictures_a_second)
        self.pictures: list[np.ndarray] = []

    def show(self, picture: np.ndarray) -> None:
        self.pictures.append(picture)


def test_a_screen_goes_on_while_nobody_is_seen_and_files_do_not(
    puppet: Puppet, context: moderngl.Context
) -> None:
    """Also without a performer the light goes out where the audience is."""
    now = [0.0]
    scene = Scene(context, SIZE, [puppet], BODY, clock=lambda: now[0])
    screen, file = Shown(20.0), Kept(20.0)
    wire = Wire([captured(pose(), 0.0)])
    loop = loop_of(wire, [puppet], [[screen, file]], scene=scene, clock=lambda: now[0])
    assert loop.tick()
    scene.blackout.to(1.0)
    for _ in range(120):  # two seconds
        now[0] += 1.0 / 60.0
        assert not loop.tick()
    scene.close()
    assert 38 <= len(screen.pictures) <= 2.0 * 20.0 / 0.75 + 1
    assert screen.pictures[0].max() > 0
    assert not screen.pictures[-1][..., :3].any()
    assert len(screen.frames) == len(file.frames) == 1, "no frame, and so none in a file"


def test_a_frozen_loop_publishes_every_frame_with_the_characters_as_they_were(
    puppet: Puppet,
) -> None:
    player, kept, tape = Player(record(waving(9)), EveryFrame()), Kept(), Tape()
    loop = loop_of(player, [puppet], [[kept]], recorder=tape)
    for _ in range(3):
        loop.tick()
    loop.frozen = True
    for _ in range(3):
        loop.tick()
    loop.frozen = False
    play(loop, player)
    shapes = [frame.vertices for frame in kept.frames]
    assert len(tape.frames) == len(shapes) == 9
    for shape in shapes[3:6]:
        np.testing.assert_array_equal(shape, shapes[2])
    assert np.abs(shapes[6] - shapes[5]).max() > 1e-3
    assert [frame.index for frame in kept.frames] == list(range(9))
