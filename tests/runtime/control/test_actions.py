"""Every action does what it says, and a light or a fader would show it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from devices.stream import open_stream
from replay.formats import read_recording
from replay.player import EveryFrame, Player
from runtime.characters.character import Character
from runtime.conditioning.switches import SWITCHES
from runtime.control import actions
from runtime.control.actions import ACTIONS
from runtime.control.by_hand.choosing_actions import CHOOSING_ACTIONS
from runtime.control.match_actions import MATCH_ACTIONS
from runtime.control.session_actions import SESSION_ACTIONS
from runtime.control.sliders import SLIDERS
from runtime.puppet.deformable_surface import Elasticity
from runtime.show.scene import BLACKOUT
from tests.runtime.staged import StagedShow
from tests.runtime.stick_figures import frame, make_figure, pose, record, waving

FADERS = {"cartoon": "cartoon", "volume": "volume_gain", "stiffness": "stiffness"}


@pytest.fixture(scope="module")
def character() -> Character:
    return make_figure()


@pytest.fixture
def show(context: moderngl.Context, character: Character, tmp_path: Path) -> Iterator[StagedShow]:
    show = StagedShow(
        context, character, Player(record(waving(40)), EveryFrame(), loop=True), tmp_path
    )
    yield show
    show.close()


def press(show: StagedShow, *names: str) -> None:
    for name in names:
        ACTIONS[name].press(show.controls)


def put(show: StagedShow, name: str, value: float) -> None:
    ACTIONS[name].write(show.controls, value)


def light(show: StagedShow, name: str) -> float:
    return ACTIONS[name].read(show.controls)


def perform(show: StagedShow) -> None:
    """Let a match stand, accept it, and the show go on for a few frames."""
    show.loop.tick()
    show.strike()
    press(show, "accept")
    for _ in range(3):
        show.loop.tick()


TRIED_HERE = {
    "match-again", "accept", "next-match", "previous-match", "rest-pose", "calibrate", "hold",
    "play", "pause", "home", "record", "freeze", "in-place", "blackout", "frame-all", "chains",
    "select", "keep-match", "front", "panel", "sliders", "help", "full-screen", "audience",
    "count-in", "next-count-in", "leave", *FADERS, *SESSION_ACTIONS, *CHOOSING_ACTIONS,
    *MATCH_ACTIONS,
    *(f"{name}-{way}" for name in FADERS for way in ("up", "down")), *SWITCHES,
}  # fmt: skip


def test_every_action_is_tried_here() -> None:
    assert set(ACTIONS) == TRIED_HERE
    for action in ACTIONS.values():
        assert action.text
        assert action.press or action.write
        assert action.read or not action.write, "what can be set can be shown"


@pytest.mark.parametrize(
    ("name", "on", "off"),
    [
        ("freeze", "the characters stand still", "the characters move again"),
        ("blackout", "the stage fades to black", "the light comes back"),
        ("help", "", ""),
        ("panel", "the panel is hidden: Tab shows it again", ""),
        ("mirror", "Mirror left and right: on", "Mirror left and right: off"),
        ("accept", "no pose has been seen yet: step into view", ""),
        ("hold", "paused", "playing"),
    ],
)
def test_what_a_press_has_done_is_said(show: StagedShow, name: str, on: str, off: str) -> None:
    for said in (on, off) if off or not on else (on,):
        show.now += 60.0
        actions.press(name, show.controls)
        assert [notice.text for notice in show.controls.notices.current] == [said] * bool(said)


def test_a_match_is_accepted_and_looked_for_again(show: StagedShow) -> None:
    press(show, "accept")
    assert show.match_session.matching, "nothing was shown yet"
    assert light(show, "match-again") == 1.0
    show.strike()
    press(show, "accept")
    assert not show.match_session.matching
    assert light(show, "match-again") == 0.0
    driven = show.match_session.mappings[0]
    press(show, "accept")
    assert show.match_session.mappings[0] is driven
    press(show, "match-again")
    assert show.match_session.matching


def test_matches_are_stepped_through(show: StagedShow) -> None:
    best = show.strike().drives
    press(show, "next-match")
    second = show.strike(0.1).drives
    assert second != best
    press(show, "next-match")
    third = show.strike(0.2).drives
    assert third not in (best, second)
    press(show, "previous-match", "previous-match")
    assert show.strike(0.3).drives == best
    press(show, "next-match", "match-again")
    assert show.strike(0.4).drives == second, "steady for a moment"
    for step in range(10):
        show.strike(0.5 + 0.1 * step)
    assert show.match_session.mappings[0].drives == best, "the pose chooses again"


@pytest.mark.parametrize("name", ["rest-pose", "calibrate"])
def test_the_pose_becomes_the_rest_state(show: StagedShow, name: str) -> None:
    show.strike()
    press(show, "accept", name)
    bent = pose({"ElbowLeft": (0.0, 0.0, 1.2)})
    for time in (0.1, 0.2, 0.3, 0.4):
        show.performer.follow(frame(bent, time))
        show.puppet.follow(show.performer.pose)
        moved = np.abs(show.puppet.deform().vertices - show.puppet.character.vertices).max()
    assert moved > 0.1
    press(show, name)
    for time in (0.5, 0.6, 0.7, 0.8):  # eases to where the rest state puts it
        show.performer.follow(frame(bent, time))
        show.puppet.follow(show.performer.pose)
        show.puppet.deform()
    rest = show.puppet.character.vertices
    np.testing.assert_allclose(show.puppet.deform().vertices, rest, atol=1e-6)


def test_a_recording_is_held_and_goes_on(show: StagedShow) -> None:
    assert len(show.stream.poll()) == 1
    for hold, go_on in (("hold", "hold"), ("pause", "play")):
        press(show, hold)
        assert show.stream.paused
        assert list(show.stream.poll()) == []
        assert (light(show, "hold"), light(show, "pause"), light(show, "play")) == (1.0, 1.0, 0.0)
        press(show, go_on)
        assert not show.stream.paused
        assert (light(show, "hold"), light(show, "pause"), light(show, "play")) == (0.0, 0.0, 1.0)
    press(show, "pause", "pause")
    assert show.stream.paused
    press(show, "play", "play")
    (captured,) = show.stream.poll()
    np.testing.assert_array_equal(captured.positions, show.stream.recording.positions[1])


def test_home_goes_back_to_the_start(show: StagedShow) -> None:
    for _ in range(4):
        last = show.stream.poll()[0].time
    press(show, "home")
    (captured,) = show.stream.poll()
    np.testing.assert_array_equal(captured.positions, show.stream.recording.positions[0])
    assert captured.time > last, "time goes on"


def test_a_live_source_is_neither_held_nor_wound_back(
    context: moderngl.Context, character: Character, tmp_path: Path
) -> None:
    with open_stream("sim://wave") as stream:
        show = StagedShow(context, character, stream, tmp_path)
        press(show, "hold", "pause", "play", "home")
        assert light(show, "play") == 1.0
        assert len(stream.poll()) > 0
        assert not stream.ended
        show.close()


def test_takes_are_new_files_with_the_frames_between_start_and_stop(
    show: StagedShow, tmp_path: Path
) -> None:
    (tmp_path / "out.mcap").write_bytes(b"the recording of the whole show")
    (tmp_path / "out-2.mcap").write_bytes(b"somebody's own")
    for frames in (3, 5):
        press(show, "record")
        assert light(show, "record") == 1.0
        for _ in range(frames):
            show.loop.tick()
        press(show, "record")
        assert light(show, "record") == 0.0
        show.loop.tick()  # goes to no file
    put(show, "record", 0.0)
    show.takes.close()
    assert [len(read_recording(tmp_path / f"out-{n}.mcap")) for n in (1, 3)] == [3, 5]
    assert (tmp_path / "out.mcap").read_bytes() == b"the recording of the whole show"
    assert (tmp_path / "out-2.mcap").read_bytes() == b"somebody's own"
    assert len(list(tmp_path.iterdir())) == 4
    assert show.told == []


def test_a_take_that_cannot_be_begun_is_told_and_the_show_goes_on(
    context: moderngl.Context, character: Character, tmp_path: Path
) -> None:
    player = Player(record(waving(9)), EveryFrame())
    show = StagedShow(context, character, player, tmp_path / "nowhere")
    press(show, "record")
    assert light(show, "record") == 0.0
    assert len(show.told) == 1
    assert "the show goes on without this take" in show.told[0]
    assert show.loop.tick()
    show.close()


def test_frozen_characters_hold_while_frames_and_takes_go_on(
    show: StagedShow, tmp_path: Path
) -> None:
    perform(show)
    assert np.abs(show.seen.vertices[-1] - show.seen.vertices[-2]).max() > 1e-4, "it moves"
    press(show, "freeze", "record")
    assert light(show, "freeze") == 1.0
    before, frames = show.seen.vertices[-1], len(show.seen.vertices)
    for _ in range(5):
        assert show.loop.tick()
    assert len(show.seen.vertices) == len(show.seen.pictures) == frames + 5
    for vertices in show.seen.vertices[frames:]:
        np.testing.assert_array_equal(vertices, before)
    press(show, "freeze", "record")
    show.loop.tick()
    assert np.abs(show.seen.vertices[-1] - before).max() > 1e-3, "and then follows again"
    show.takes.close()
    assert len(read_recording(tmp_path / "out-1.mcap")) == 5


def test_a_match_asked_for_while_frozen_is_shown_afterwards(show: StagedShow) -> None:
    show.loop.tick()
    shown = show.match_session.mappings[0].drives
    press(show, "freeze", "next-match")
    show.loop.tick()
    assert show.match_session.mappings[0].drives == shown
    press(show, "freeze")
    show.loop.tick()
    assert show.match_session.mappings[0].drives != shown


def test_a_blackout_fades_pictures_to_black_and_back(show: StagedShow) -> None:
    perform(show)
    press(show, "freeze", "blackout")  # frozen, so that only the light changes
    assert light(show, "blackout") == 1.0
    for show.now in (0.0, BLACKOUT / 2.0, BLACKOUT, 60.0):
        show.loop.tick()
    light_before, half, dark, still = (
        each[..., :3].astype(int) for each in show.seen.pictures[-4:]
    )
    assert light_before.max() > 100
    puppet_only = np.s_[18:, 24:40]  # the performer in the mirror goes on moving
    assert np.abs(half - light_before / 2.0)[puppet_only].max() <= 1.0
    assert dark.max() == still.max() == 0
    press(show, "blackout")
    show.now += BLACKOUT
    show.loop.tick()
    again = show.seen.pictures[-1][..., :3].astype(int)
    np.testing.assert_array_equal(again[puppet_only], light_before[puppet_only])
    assert light(show, "blackout") == 0.0


def test_who_is_in_place_is_told_so(show: StagedShow) -> None:
    press(show, "in-place")
    assert show.puppet.travel.in_place
    assert light(show, "in-place") == 1.0
    put(show, "in-place", 0.0)
    assert not show.puppet.travel.in_place
    assert light(show, "in-place") == 0.0


def test_everybody_is_framed(show: StagedShow) -> None:
    framed = show.scene.camera
    show.scene.camera = framed.zoom(3.0)
    press(show, "frame-all")
    assert show.scene.camera.distance == pytest.approx(framed.distance)


def test_chains_are_hidden_and_shown(show: StagedShow) -> None:
    press(show, "chains")
    assert not show.scene.highlights
    assert light(show, "chains") == 0.0
    press(show, "chains")
    assert show.scene.highlights


@pytest.mark.parametrize("name", SWITCHES)
def test_each_step_of_the_conditioning_is_switched_by_itself(show: StagedShow, name: str) -> None:
    before = {each: getattr(show.switches, each) for each in SWITCHES}
    press(show, name)
    turned = {each: getattr(show.switches, each) for each in SWITCHES}
    assert turned == before | {name: not before[name]}
    assert light(show, name) == float(turned[name])
    for value in (1.0, 1.0, 0.0, 0.0):
        put(show, name, value)
        assert getattr(show.switches, name) is bool(value)
        assert light(show, name) == value


@pytest.mark.parametrize("name", FADERS)
def test_faders_set_what_every_character_is_made_of(show: StagedShow, name: str) -> None:
    field = FADERS[name]
    for value in (0.0, 0.25, 1.0):
        put(show, name, value)
        made = show.puppet.surface.elasticity
        assert getattr(made, field) == pytest.approx(value * SLIDERS[name].most)
        assert light(show, name) == pytest.approx(value)
        others = {each: getattr(made, each) for each in FADERS.values() if each != field}
        assert others == {each: getattr(Elasticity(), each) for each in others}
    press(show, f"{name}-down")
    assert light(show, name) == pytest.approx(0.9)
    press(show, *[f"{name}-up"] * 3)
    assert light(show, name) == 1.0
    put(show, name, 0.05)
    press(show, f"{name}-down", f"{name}-down")
    assert light(show, name) == 0.0


def test_a_character_made_beyond_the_faders_end_is_left_so(show: StagedShow) -> None:
    show.puppet.surface.elasticity = Elasticity(volume_gain=5.0)
    press(show, "volume-up")
    assert show.puppet.surface.elasticity.volume_gain == 5.0
    press(show, "volume-down")
    assert show.puppet.surface.elasticity.volume_gain == pytest.approx(0.9 * SLIDERS["volume"].most)


def test_more_cartoon_changes_what_is_performed(show: StagedShow) -> None:
    perform(show)
    press(show, "home")
    shapes = []
    for amount in (0.0, 1.0):
        put(show, "cartoon", amount)
        press(show, "home")
        for _ in range(12):
            show.loop.tick()
        shapes.append(show.seen.vertices[-1])
    assert np.abs(shapes[0] - shapes[1]).max() > 1e-4


def test_leaving_is_asked_for(show: StagedShow) -> None:
    press(show, "leave")
    assert show.controls.leaving


def test_without_a_theatre_what_is_seen_cannot_be_changed_and_harms_nothing(
    show: StagedShow,
) -> None:
    show.controls.scene = None
    press(show, "blackout", "chains", "frame-all")
    assert light(show, "blackout") == light(show, "chains") == 0.0


@pytest.mark.parametrize("name", sorted(set(SESSION_ACTIONS) - {"loop"}))
def test_without_a_session_its_actions_change_nothing_and_say_so(
    show: StagedShow, name: str
) -> None:
    """tests/runtime/session tries them in one."""
    perform(show)
    before = show.puppet.snapshot()
    press(show, name)
    assert "no session is open" in show.controls.notices.current[-1].text
    assert not show.controls.takes.recording
    assert show.puppet.snapshot().targets is before.targets


def test_a_recording_loops_or_not(show: StagedShow) -> None:
    put(show, "loop", 0.0)
    assert light(show, "loop") == 0.0
    press(show, "loop")
    assert light(show, "loop") == 1.0
