"""Keys and mouse: each key does its action, and the window's camera is the show's."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from replay.player import EveryFrame, Player
from runtime.characters.character import Character
from runtime.control.actions import ACTIONS
from runtime.control.keys import KEYS, WindowControls, key_hint
from runtime.control.window import Event, KeyPressed, Resized
from runtime.render.camera import Camera, front_camera
from tests.runtime.staged import SIZE, StagedShow
from tests.runtime.stick_figures import make_figure, record, waving


class Desktop:
    """What the controls know of a window, without a display."""

    def __init__(self, context: moderngl.Context) -> None:
        self.camera: Camera = front_camera()
        self.should_close = False
        self.full_screen = False
        self.framebuffer = context.simple_framebuffer(SIZE, components=4)
        self.events: list[Event] = []
        self.swaps = 0

    def poll(self) -> list[Event]:
        events, self.events = self.events, []
        return events

    def swap(self) -> None:
        self.swaps += 1


class Seat(StagedShow):
    """A show with somebody at the window."""

    def __init__(self, context: moderngl.Context, character: Character, folder: Path) -> None:
        super().__init__(context, character, Player(record(waving(9)), EveryFrame()), folder)
        self.window = Desktop(context)
        self.framed = self.scene.camera
        self.keys = WindowControls(self.window, self.scene, self.controls)

    def press(self, *keys: str) -> None:
        self.window.events.extend(KeyPressed(key) for key in keys)
        self.keys.serve()

    def state(self) -> dict[str, float]:
        """What every action that shows something shows."""
        return {name: action.read(self.controls) for name, action in ACTIONS.items() if action.read}


@pytest.fixture(scope="module")
def character() -> Character:
    return make_figure()


@pytest.fixture
def show(context: moderngl.Context, character: Character, tmp_path: Path) -> Iterator[Seat]:
    show = Seat(context, character, tmp_path)
    yield show
    show.close()


def test_every_key_is_a_name_for_an_action_that_can_be_pressed() -> None:
    assert all(ACTIONS[name].press is not None for name in KEYS.values())
    assert len(set(KEYS.values())) == len(KEYS), "no action has two keys"
    pressed = {name for name, action in ACTIONS.items() if action.press is not None}
    assert pressed - set(KEYS.values()) == {"play", "pause"}, "the space bar does both"


@pytest.mark.parametrize("key", KEYS)
def test_a_key_does_what_its_action_does(
    context: moderngl.Context, character: Character, tmp_path: Path, key: str
) -> None:
    """The same show twice, once by the key and once by the action: they end up alike."""
    states = []
    for by_key in (True, False):
        show = Seat(context, character, tmp_path / str(by_key))
        (tmp_path / str(by_key)).mkdir()
        show.strike()
        show.stream.poll()
        if by_key:
            show.press(key)
        else:
            ACTIONS[KEYS[key]].press(show.controls)
        shown = show.strike(0.1).drives
        states.append((show.state(), shown, show.controls.leaving, show.stream.position))
        show.close()
    assert states[0] == states[1]


def test_the_hint_names_keys_that_do_what_it_says() -> None:
    hint = key_hint()
    for key, words in re.findall(r"([\w.]+) to ([a-z ]+)", hint):
        assert KEYS[key] in ACTIONS, words
    assert "m to match again" in hint
    assert "escape to leave" in hint


def test_a_key_that_is_held_down_turns_no_switch_over_again_but_steps_on(show: Seat) -> None:
    for key in ("b", "up"):
        again = [KeyPressed(key, again=True)] * 3
        show.window.events.extend([KeyPressed(key), *again])
    show.keys.serve()
    assert show.scene.blackout.target == 1.0
    assert show.puppet.surface.elasticity.cartoon == pytest.approx(0.4)


def test_f_frames_everybody(show: Seat) -> None:
    show.window.camera = show.window.camera.orbit(0.3, 0.0).zoom(3.0)
    show.keys.serve()
    turned = show.scene.camera
    assert turned == show.window.camera != show.framed
    show.press("f")
    assert show.scene.camera == show.window.camera
    assert show.scene.camera.distance > turned.distance
    np.testing.assert_allclose(show.scene.camera.view_rotation, turned.view_rotation, atol=1e-9)


def test_who_frames_everybody_from_afar_moves_the_windows_camera_too(show: Seat) -> None:
    show.window.camera = show.window.camera.zoom(3.0)
    show.keys.serve()
    ACTIONS["frame-all"].press(show.controls)
    framed = show.scene.camera
    assert framed != show.window.camera
    show.keys.serve()
    assert show.scene.camera is show.window.camera is framed
    show.window.camera = show.window.camera.orbit(0.2, 0.0)
    show.keys.serve()
    assert show.scene.camera == show.window.camera != framed, "and the mouse goes on from there"


def test_escape_and_the_closed_window_end_the_show(show: Seat) -> None:
    show.press()
    assert not show.controls.leaving
    show.press("escape")
    assert show.controls.leaving
    show.press()
    assert show.controls.leaving, "for good"


def test_the_windows_own_button_ends_the_show(show: Seat) -> None:
    show.window.should_close = True
    show.press()
    assert show.controls.leaving


def test_the_camera_is_the_windows_from_the_start(show: Seat) -> None:
    assert show.window.camera == show.framed
    show.window.camera = show.window.camera.orbit(0.5, 0.0)
    show.press()
    assert show.scene.camera == show.window.camera


def test_another_size_of_the_window_is_the_pictures_size(show: Seat) -> None:
    show.window.events.append(Resized((40, 30)))
    show.keys.serve()
    assert show.scene.stage.size == (40, 30)


def test_what_is_shown_is_the_newest_picture(show: Seat) -> None:
    show.scene.show(None, [show.puppet.deform()])
    show.keys.present()
    assert show.window.swaps == 1
    shown = np.frombuffer(show.window.framebuffer.read(components=3, alignment=1), np.uint8)
    np.testing.assert_array_equal(
        shown.reshape(SIZE[1], SIZE[0], 3)[::-1], show.scene.picture()[..., :3]
    )


def test_other_keys_change_nothing(show: Seat) -> None:
    before = show.state()
    show.press("q", "f12", "é")
    assert show.state() == before
    assert not show.controls.leaving
    assert show.scene.camera == show.framed
