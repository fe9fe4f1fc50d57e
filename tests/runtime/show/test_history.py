"""A show put back to an earlier frame performs the same bytes; a jump equals playing there."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Self

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.bodies.plan_by_names import plan_by_names
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.player import EveryFrame, Player, RealTime
from replay.recording import Recording
from runtime.characters.character import Character
from runtime.characters.open_character import load_character
from runtime.control.actions import ACTIONS
from runtime.output.output import PerformedFrame
from runtime.show.history import ShowHistory, state_bytes
from runtime.show.settings import CharacterSettings, MatchSettings, ShowSettings
from runtime.show.show import Show
from tests.runtime.snapshots import arrays, digest
from tests.runtime.stick_figures import make_figure, record, waving
from tests.thorough import examples

Script = dict[int, list[tuple[str, float | None]]]


class Digests:
    """An output that keeps a hash of all that it is given of each frame."""

    pictures_a_second = 25.0

    def __init__(self) -> None:
        self.frames: list[str] = []

    def write(self, frame: PerformedFrame) -> None:
        said = hashlib.sha256(f"{frame.index} {frame.time!r}".encode())
        said.update(frame.vertices.tobytes())
        said.update((digest(frame.nodes) + digest(frame.poses)).encode())
        if frame.picture is not None:
            said.update(frame.picture.tobytes())
        self.frames.append(said.hexdigest())

    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None: ...


class Stage:
    """A show in a test's hands, which can be put back as a whole."""

    def __init__(self, recording: Recording, *characters: Character, **own: object) -> None:
        performers = len(np.unique(recording.performers))
        shows = ShowSettings(
            characters=(CharacterSettings(**own),),
            match=MatchSettings(performers=min(performers, len(characters))),
        )
        self.player, self.kept = Player(recording, EveryFrame()), Digests()
        self.show = Show(self.player, characters, shows, outputs=[self.kept])
        self.loop, self.controls = self.show.controls.loop, self.show.controls

    def put_back(self, state: tuple, settings: dict[str, float]) -> None:
        for name, value in settings.items():  # first, as characters ease over what changes
            ACTIONS[name].write(self.controls, value)
        loop, player = state
        self.loop.restore(loop)
        self.player.restore(player)

    def __repr__(self) -> str:
        return "the stage"  # not all that it holds, which hypothesis would print

    def state(self) -> tuple:
        return self.loop.snapshot(), self.player.snapshot()

    def set_to(self) -> dict[str, float]:
        """Everything that a puppeteer may have set, and that is no memory."""
        names = ("freeze", "mirror", "filter", "swaps", "outliers", "cartoon", "volume")
        return {name: ACTIONS[name].read(self.controls) for name in names}

    def play(self, frames: int, done: Script) -> list[str]:
        """Perform so many frames, each after what is done before it; a hash of each."""
        began = len(self.kept.frames)
        for number in range(frames):
            for name, value in done.get(number, []):
                action = ACTIONS[name]
                if value is None:
                    action.press(self.controls)
                else:
                    action.write(self.controls, value)
            if self.player.ended:
                self.player.seek(0.0)
            self.loop.tick()
            self.loop.settle()
        return self.kept.frames[began:]

    def highlights(self) -> list[bytes]:
        return [each.points.tobytes() for p in self.show.puppets for each in p.highlights]


def losing(recording: Recording) -> Recording:
    """The recording with an arm lost for a second, twice, and one frame without anybody."""
    positions, names = recording.positions.copy(), recording.skeleton.names
    arm = [n for n, name in enumerate(names) if "Left" in name and "Leg" not in name][:6]
    for begin in (0.15, 0.6):
        start = int(begin * len(recording))
        positions[start : start + max(len(recording) // 5, 2), arm] = np.nan
    positions[len(recording) // 2] = np.nan
    seen = np.isfinite(positions).all(axis=2).astype(float)
    return replace(recording, positions=positions, confidence=seen)


def waved(count: int = 60) -> Recording:
    return losing(record(waving(count)))


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    stage = Stage(waved(), make_figure(), energy="smooth-rotations", cartoon=0.5)
    yield stage
    stage.show.close()


@pytest.fixture(scope="module")
def beginning(stage: Stage) -> tuple[tuple, dict[str, float]]:
    return stage.state(), stage.set_to()


SWITCHED = st.tuples(
    st.sampled_from(["freeze", "mirror", "filter", "swaps"]), st.sampled_from([0.0, 1.0])
)
SET = st.tuples(st.sampled_from(["cartoon", "volume"]), st.sampled_from([0.0, 0.3, 1.0]))
PRESSED = st.tuples(
    st.sampled_from(["match-again", "next-match", "accept", "rest-pose", "calibrate"]), st.none()
)
DONE = st.lists(st.one_of(SWITCHED, SET, PRESSED), max_size=2)
SCRIPT = st.dictionaries(st.integers(0, 30), DONE, max_size=8)


@settings(max_examples=examples(25))
@given(st.tuples(st.integers(0, 40), SCRIPT), st.tuples(st.integers(1, 30), SCRIPT))
def test_a_show_put_back_performs_the_same_bytes(
    stage: Stage,
    beginning: tuple[tuple, dict[str, float]],
    first: tuple[int, Script],
    then: tuple[int, Script],
) -> None:
    stage.put_back(*beginning)
    stage.play(*first)
    state, set_to = stage.state(), stage.set_to()
    kept = digest(state)
    once = stage.play(*then)
    ended = stage.highlights(), digest(stage.state())
    for _ in range(2):
        stage.put_back(state, set_to)
        assert digest(stage.state()) == kept
        assert stage.play(*then) == once
        assert (stage.highlights(), digest(stage.state())) == ended
        assert digest(state) == kept, "nothing writes into a state"


@pytest.mark.parametrize("at", [4, 8, 12])
def test_a_show_put_back_is_driven_as_it_was_then(at: int) -> None:
    """By the anatomy, while a match is proposed in its place, and by the match."""
    figure = make_figure()
    stage = Stage(waved(), replace(figure, plan=plan_by_names(figure.skeleton)))
    steps: Script = {6: [("next-match", None)], 10: [("accept", None)], 16: [("match-again", None)]}
    stage.play(at, steps)
    state, set_to = stage.state(), stage.set_to()
    later: Script = {frame - at: done for frame, done in steps.items() if frame >= at}
    once = stage.play(20, later)
    ended = stage.highlights(), digest(stage.state())
    stage.put_back(state, set_to)
    assert digest(stage.state()) == digest(state)
    assert stage.play(20, later) == once
    assert (stage.highlights(), digest(stage.state())) == ended
    stage.show.close()


def test_states_share_no_array_that_the_show_writes_to(stage: Stage) -> None:
    stage.play(5, {})
    first = stage.state()
    before = [array.copy() for array in arrays(first)]
    stage.put_back(first, {})
    stage.play(9, {2: [("freeze", 1.0)], 5: [("freeze", 0.0)]})
    for array, was in zip(arrays(first), before, strict=True):
        for field in array.dtype.names or [()]:
            np.testing.assert_array_equal(array[field], was[field])


def test_a_state_fits_another_show_of_the_same_arguments() -> None:
    shows = [Stage(waved(), make_figure()) for _ in range(2)]
    shows[0].play(20, {})
    shows[1].play(3, {})
    shows[1].put_back(shows[0].state(), {})
    once, again = (each.play(20, {3: [("next-match", None)]}) for each in shows)
    assert once == again
    for each in shows:
        each.show.close()


CASES = {
    "squid": ("show", ["squid"], {}),
    "two": ("wave", ["cactus", "trex"], {"cartoon": 1.0, "iterations": 3}),
}


@pytest.mark.parametrize("case", CASES)
def test_a_jump_equals_playing_there(case: str) -> None:
    act, names, own = CASES[case]
    recording = losing(builtin_recording(act))
    check_jumps(recording, [load_character(name) for name in names], own)


@pytest.mark.parametrize(
    "name", ["bvh/cmu1_jumping_jacks_animdraw.bvh", "kinect/v2_laban/joints.csv"]
)
def test_a_jump_in_a_real_recording_equals_playing_there(shared: Path, name: str) -> None:
    check_jumps(read_recording(shared / name), [make_figure()], {"cartoon": 0.4})


def check_jumps(recording: Recording, characters: list[Character], own: dict[str, object]) -> None:
    """Play some frames, then jump back and forth and go on from there."""
    stage, count = Stage(recording, *characters, **own), min(80, len(recording) - 1)
    history, played, states = ShowHistory(stage.loop, stage.player, every=10), [], []
    for _ in range(count):
        played += stage.play(1, {})
        states.append(digest(stage.loop.snapshot().motions))
        history.note()
    for frame in (67, 12, 13, 0, 79):
        seconds = float(recording.times[min(frame, count - 1)])
        last = int(np.searchsorted(recording.times, seconds, side="right"))
        written = len(stage.kept.frames)
        history.go_to(seconds)
        assert len(stage.kept.frames) == written, "the way there is not published"
        assert stage.player.position == seconds
        assert digest(stage.loop.snapshot().motions) == states[last - 1]
        assert stage.play(min(5, count - last), {}) == played[last : last + 5]
    stage.show.close()


def test_a_plain_seek_differs_from_playing_there(stage: Stage, beginning: tuple) -> None:
    """The fault that a history puts right."""
    stage.put_back(*beginning)
    played = stage.play(40, {})
    stage.put_back(*beginning)
    stage.play(5, {})
    stage.player.seek(float(stage.player.recording.times[39]))
    assert stage.play(1, {})[0] != played[39]


def test_jumps_beyond_what_was_played_play_on_and_may_be_anywhere(stage: Stage) -> None:
    recording = stage.player.recording
    fresh = Stage(recording, make_figure())
    history = ShowHistory(fresh.loop, fresh.player, every=10)
    history.go_to(float(recording.times[33]))
    assert history.frames == [0, 10, 20, 30]
    there = digest(fresh.loop.snapshot().motions)
    history.go_to(1e9)
    assert fresh.player.position == recording.times[-1]
    history.go_to(-5.0)
    assert fresh.player.position == recording.times[0]
    fresh.player.pause()
    history.go_to(float(recording.times[33]))
    assert fresh.player.paused
    assert digest(fresh.loop.snapshot().motions) == there
    fresh.show.close()


def test_no_snapshots_are_taken_away_from_the_way_of_playing() -> None:
    fresh = Stage(waved(), make_figure())
    history = ShowHistory(fresh.loop, fresh.player, every=5)
    for _ in range(12):
        fresh.play(1, {})
        history.note()
    assert history.frames == [0, 5, 10]
    fresh.player.seek(float(fresh.player.recording.times[30]))
    for _ in range(12):
        fresh.play(1, {})
        history.note()
    assert history.frames == [0, 5, 10], "frames after a seek are none of playing"
    history.go_to(float(fresh.player.recording.times[15]))
    assert history.frames == [0, 5, 10, 15]
    history.forget()
    assert history.frames == [0]
    fresh.show.close()


def test_after_a_change_that_is_told_jumps_give_what_playing_gives_now() -> None:
    fresh = Stage(waved(), make_figure())
    history = ShowHistory(fresh.loop, fresh.player, every=5)
    history.go_to(1.0)
    before = digest(fresh.loop.snapshot().motions)
    ACTIONS["cartoon"].write(fresh.controls, 1.0)
    history.forget()
    history.go_to(1.0)
    jumped = digest(fresh.loop.snapshot().motions)
    other = Stage(waved(), make_figure())
    ACTIONS["cartoon"].write(other.controls, 1.0)
    while other.player.recording.times[other.player.snapshot().next] <= 1.0:
        other.play(1, {})
    assert jumped == digest(other.loop.snapshot().motions) != before
    for each in (fresh, other):
        each.show.close()


def test_snapshots_keep_to_their_memory() -> None:
    fresh = Stage(waved(), make_figure())
    one = state_bytes(fresh.loop.snapshot())
    history = ShowHistory(fresh.loop, fresh.player, every=2, most_bytes=8 * one)
    for _ in range(59):
        fresh.play(1, {})
        history.note()
        assert history.bytes <= 8 * one
    steps = np.diff(history.frames)
    assert len(history.frames) >= 4
    assert history.frames[0] == 0
    assert (steps == steps[0]).all()
    fresh.show.close()


def test_a_history_starts_at_the_start_and_not_by_the_clock() -> None:
    fresh = Stage(waved(), make_figure())
    fresh.play(1, {})
    with pytest.raises(ValueError, match="has begun"):
        ShowHistory(fresh.loop, fresh.player)
    with pytest.raises(ValueError, match="clock"):
        ShowHistory(fresh.loop, Player(waved(), RealTime()))
    fresh.show.close()


def test_a_jump_brings_frozen_characters_where_playing_had_frozen_them() -> None:
    fresh = Stage(waved(), make_figure())
    fresh.play(10, {})
    state = fresh.state()
    frozen = fresh.play(10, {0: [("freeze", 1.0)]})
    fresh.put_back(state, {"freeze": 0.0})
    fresh.play(20, {})
    fresh.put_back(state, {"freeze": 0.0})
    assert fresh.play(10, {0: [("freeze", 1.0)]}) == frozen
    assert not math.isnan(fresh.loop.seconds)
    fresh.show.close()
