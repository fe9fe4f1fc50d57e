"""Each key does what the list of keys says."""

from __future__ import annotations

import math
from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from devices.errors import InputError
from devices.simulator import Simulator
from devices.stream import open_stream
from replay.player import EveryFrame, Player
from runtime.conditioning.switches import SWITCHES, Conditioning
from runtime.controls import KEYS, SWITCH_OF_KEY, Controls, key_help
from runtime.director import Choices, Director
from runtime.mapping import Mapping
from runtime.performer import Performer
from runtime.puppet import Puppet
from runtime.render.camera import Camera, front_camera
from runtime.render.context import headless_context, release_headless
from runtime.theatre import Theatre
from runtime.window import Event, KeyPressed, Resized
from tests.runtime.figures import BODY, FRONT_VIEW, T_POSE, frame, make_figure, pose, record, waving

SIZE = (64, 36)


class Desk:
    """What the controls know of a window, without a display."""

    def __init__(self, context: moderngl.Context) -> None:
        self.camera: Camera = front_camera()
        self.should_close = False
        self.framebuffer = context.simple_framebuffer(SIZE, components=4)
        self.events: list[Event] = []
        self.swaps = 0

    def poll(self) -> list[Event]:
        events, self.events = self.events, []
        return events

    def swap(self) -> None:
        self.swaps += 1


class Show:
    """A whole show under a desk: all of it the real thing but the window."""

    def __init__(
        self, context: moderngl.Context, puppet: Puppet, stream: Player | Simulator
    ) -> None:
        puppet.rest()
        puppet.show(Mapping(()))
        self.puppet = puppet
        self.stream = stream
        self.desk = Desk(context)
        self.performer = Performer(BODY)
        self.director = Director(
            self.performer, [puppet], lambda: FRONT_VIEW, Choices(patience=math.inf), [None]
        )
        self.theatre = Theatre(context, SIZE, [puppet], BODY)
        self.framed = self.theatre.camera
        self.switches = Conditioning()
        self.controls = Controls(self.desk, self.theatre, self.director, stream, self.switches)

    def press(self, *keys: str) -> None:
        self.desk.events.extend(KeyPressed(key) for key in keys)
        self.controls.serve()

    def strike(self, time: float = 0.0) -> Mapping:
        captured = frame(pose(T_POSE), time)
        self.performer.follow(captured)
        self.director.direct(captured)
        return self.puppet.mapping


@pytest.fixture(scope="module")
def context() -> Iterator[moderngl.Context]:
    try:
        context = headless_context()
    except InputError as error:
        pytest.skip(str(error))
    yield context
    release_headless(context)


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(make_figure())


@pytest.fixture
def show(context: moderngl.Context, puppet: Puppet) -> Iterator[Show]:
    show = Show(context, puppet, Player(record(waving(9)), EveryFrame()))
    yield show
    show.theatre.close()


def test_every_key_in_the_list_is_tried_here() -> None:
    tried = {"m", "enter", "right", "left", "space", "home", "f", "h", "escape"}
    assert set(KEYS) == tried | {"c"} | set(SWITCH_OF_KEY)
    for line, (key, text) in zip(key_help(), KEYS.items(), strict=True):
        assert line.split() == [key, *text.split()]
    assert (
        len({line.index(text) for line, text in zip(key_help(), KEYS.values(), strict=True)}) == 1
    )


def test_enter_accepts_the_match_shown_and_m_matches_again(show: Show) -> None:
    show.press("enter")
    assert show.director.matching, "nothing was shown yet"
    show.strike()
    show.press("enter")
    assert not show.director.matching
    driven = show.puppet.mapping
    show.press("enter")
    assert show.puppet.mapping is driven
    show.press("m")
    assert show.director.matching


def test_arrows_step_through_the_matches(show: Show) -> None:
    best = show.strike().drives
    show.press("right")
    second = show.strike(0.1).drives
    assert second != best
    show.press("right")
    third = show.strike(0.2).drives
    assert third not in (best, second)
    show.press("left", "left")
    assert show.strike(0.3).drives == best
    show.press("right", "m")
    assert show.strike(0.4).drives == second, "steady for a moment"
    for step in range(10):
        show.strike(0.5 + 0.1 * step)
    assert show.puppet.mapping.drives == best, "m lets the pose choose again"


def test_space_holds_a_recording_and_goes_on(show: Show) -> None:
    assert len(show.stream.poll()) == 1
    show.press("space")
    assert show.stream.paused
    assert list(show.stream.poll()) == []
    show.press("space")
    assert not show.stream.paused
    (captured,) = show.stream.poll()
    np.testing.assert_array_equal(captured.positions, show.stream.recording.positions[1])
    show.press("space", "space", "space")
    assert show.stream.paused


def test_home_goes_back_to_the_start(show: Show) -> None:
    for _ in range(4):
        last = show.stream.poll()[0].time
    show.press("home")
    (captured,) = show.stream.poll()
    np.testing.assert_array_equal(captured.positions, show.stream.recording.positions[0])
    assert captured.time > last, "time goes on"


def test_f_frames_everybody(show: Show) -> None:
    show.desk.camera = show.desk.camera.orbit(0.3, 0.0).zoom(3.0)
    show.controls.serve()
    turned = show.theatre.camera
    assert turned == show.desk.camera != show.framed
    show.press("f")
    assert show.theatre.camera == show.desk.camera
    assert show.theatre.camera.distance > turned.distance
    np.testing.assert_allclose(show.theatre.camera.view_rotation, turned.view_rotation, atol=1e-9)


def test_h_hides_and_shows_the_chains(show: Show) -> None:
    show.press("h")
    assert not show.theatre.highlights
    show.press("h")
    assert show.theatre.highlights


def test_each_step_of_the_conditioning_has_a_key(show: Show) -> None:
    assert set(SWITCH_OF_KEY.values()) == set(SWITCHES) - {"order"}
    for key, name in SWITCH_OF_KEY.items():
        before = {each: getattr(show.switches, each) for each in SWITCHES}
        show.press(key)
        after = {each: getattr(show.switches, each) for each in SWITCHES}
        assert after == before | {name: not before[name]}
        show.press(key)
        assert before == {each: getattr(show.switches, each) for each in SWITCHES}


def test_c_takes_the_pose_as_the_rest_state(show: Show) -> None:
    show.strike()
    show.press("enter", "c")
    bent = pose({"ElbowLeft": (0.0, 0.0, 1.2)})
    show.performer.follow(frame(bent, 0.1))
    show.puppet.follow(show.performer.pose)
    assert np.abs(show.puppet.deform().vertices - show.puppet.character.vertices).max() > 0.1
    show.press("c")
    show.puppet.follow(show.performer.pose)
    np.testing.assert_allclose(
        show.puppet.deform().vertices, show.puppet.character.vertices, atol=1e-6
    )


def test_escape_and_the_closed_window_end_the_show(show: Show) -> None:
    show.press()
    assert not show.controls.leaving
    show.press("escape")
    assert show.controls.leaving
    show.press()
    assert show.controls.leaving, "for good"


def test_the_windows_own_button_ends_the_show(show: Show) -> None:
    show.desk.should_close = True
    show.press()
    assert show.controls.leaving


def test_the_camera_is_the_windows_from_the_start(show: Show) -> None:
    assert show.desk.camera == show.framed
    show.desk.camera = show.desk.camera.orbit(0.5, 0.0)
    show.press()
    assert show.theatre.camera == show.desk.camera


def test_another_size_of_the_window_is_the_pictures_size(show: Show) -> None:
    show.desk.events.append(Resized((40, 30)))
    show.controls.serve()
    assert show.theatre.stage.size == (40, 30)


def test_what_is_shown_is_the_newest_picture(show: Show) -> None:
    show.theatre.show(None, [show.puppet.deform()])
    show.controls.present()
    assert show.desk.swaps == 1
    shown = np.frombuffer(show.desk.framebuffer.read(components=3, alignment=1), np.uint8)
    np.testing.assert_array_equal(
        shown.reshape(SIZE[1], SIZE[0], 3)[::-1], show.theatre.picture()[..., :3]
    )


def test_other_keys_change_nothing(show: Show) -> None:
    show.press("q", "f5", "tab", "é")
    assert not show.controls.leaving
    assert show.director.matching
    assert show.theatre.highlights
    assert not show.stream.paused
    assert show.theatre.camera == show.framed


def test_a_live_source_is_neither_held_nor_wound_back(
    context: moderngl.Context, puppet: Puppet
) -> None:
    with open_stream("sim://wave") as stream:
        show = Show(context, puppet, stream)
        show.press("space", "home")
        assert len(stream.poll()) > 0
        assert not stream.ended
        show.theatre.close()
