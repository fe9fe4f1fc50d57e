"""A show as a library: made, ticked, asked for its picture and vertices, and closed whole."""

from __future__ import annotations

import json
import socket
import struct
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Self

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from devices.builtin.motions import motion_clip
from devices.builtin.simulator import Simulator
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.player import EveryFrame, Player, RealTime
from runtime.characters.character import Character
from runtime.characters.open_character import load_character
from runtime.control.actions import ACTIONS, press
from runtime.output.output import PerformedFrame
from runtime.show.open_stream import play
from runtime.show.pacing import AtOnce
from runtime.show.settings import (
    CharacterSettings,
    FileSettings,
    MatchSettings,
    RemoteSettings,
    ShowSettings,
)
from runtime.show.show import Show
from tests.runtime.stick_figures import BODY, frame, make_figure, pose, record, waving

SIZE = (64, 36)
DRAWING = ShowSettings(size=SIZE, pictures=True)


@pytest.fixture(scope="module")
def figure() -> Character:
    return make_figure()


def recording(count: int = 6) -> Player:
    return Player(record(waving(count)), EveryFrame())


class Puppeteer:
    """A stream of our own: whatever poses it is given, one a poll, until it is ended."""

    def __init__(self, poses: Sequence[NDArray[np.float64]]) -> None:
        self._poses = list(poses)
        self._given = 0
        self.closed = 0

    @property
    def skeleton(self) -> Skeleton:
        return BODY

    @property
    def ended(self) -> bool:
        return self._given == len(self._poses)

    def poll(self) -> Sequence[SkeletonFrame]:
        if self.ended:
            return []
        self._given += 1
        return [frame(self._poses[self._given - 1], self._given / 60.0)]

    def close(self) -> None:
        self.closed += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


class Failing:
    """An output of our own that fails at its third frame."""

    pictures_a_second = 0.0

    def __init__(self) -> None:
        self.written = 0
        self.closed = 0

    def write(self, frame: PerformedFrame) -> None:
        if self.written == 2:
            raise RuntimeError("the third frame")
        self.written += 1

    def close(self) -> None:
        self.closed += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def test_a_recording_is_performed_frame_by_frame(figure: Character) -> None:
    with Show(recording(), [figure]) as show:
        np.testing.assert_array_equal(show.vertices[0].shape, figure.vertices.shape)
        seen = []
        while not show.ended:
            assert show.tick()
            seen.append(show.vertices[0])
        assert not show.tick()
        assert show.frames == len(seen) == 6
    moved = np.abs(seen[3] - seen[0]).max()
    assert moved > 0.1, "it waves, and what was taken before stays as it was"
    assert np.isfinite(seen).all()


def test_each_character_has_vertices_and_nodes_of_its_own(figure: Character) -> None:
    other = make_figure(([0.0, 2.0, 0.0], [0.2, 2.2, 0.2]), name="other")
    with Show(recording(), [figure, other]) as show:
        show.run()
        assert [len(v) for v in show.vertices] == [len(figure.vertices), len(other.vertices)]
        for character, motion in zip((figure, other), show.motions, strict=True):
            assert motion.nodes.positions.shape == character.skeleton.rest_positions.shape


def test_a_stream_of_ones_own_drives_a_character(figure: Character) -> None:
    stream = Puppeteer([pose()] + 5 * [pose({"ShoulderLeft": (0.0, 0.0, 1.0)})])
    settings = ShowSettings(match=MatchSettings(patience=0.0))
    with Show(stream, [figure], settings) as show:
        while show.tick():
            pass
        assert show.frames == 6
        assert np.abs(show.vertices[0] - figure.vertices).max() > 0.1
    assert stream.closed


def test_pictures_are_drawn_when_they_are_taken(
    context: moderngl.Context, figure: Character
) -> None:
    del context  # only to be skipped where there can be none
    with Show(recording(), [figure], DRAWING) as show:
        rest = show.picture
        assert rest.shape == (SIZE[1], SIZE[0], 4)
        assert rest.dtype == np.uint8
        show.run()
        assert show.report.times.summary()["render"]["max"] < 1.0, "no tick draws for nobody"
        assert np.abs(show.picture.astype(int) - rest).max() > 20


def test_a_show_that_draws_nothing_says_how_to_get_a_picture(figure: Character) -> None:
    with Show(recording(), [figure]) as show, pytest.raises(ValueError, match="pictures=True"):
        show.picture  # noqa: B018  # that it raises is the test


def test_two_shows_take_turns_on_one_thread(context: moderngl.Context, figure: Character) -> None:
    """Each with a context of its own, which must be current when it draws and when it closes."""
    del context  # only to be skipped where there can be none
    alone = []
    for turn in ("first", "second"):
        with Show(recording(), [figure], DRAWING) as show:
            for _ in range(2 if turn == "first" else 5):
                show.tick()
            alone.append(show.picture)
    with Show(recording(), [figure], DRAWING) as first:
        second = Show(recording(), [figure], DRAWING)
        for _ in range(2):
            first.tick()
        for _ in range(5):
            second.tick()
        np.testing.assert_array_equal(first.picture, alone[0])
        np.testing.assert_array_equal(second.picture, alone[1])
        second.close()
        np.testing.assert_array_equal(first.picture, alone[0])


def test_a_show_that_draws_belongs_to_its_thread(
    context: moderngl.Context, figure: Character
) -> None:
    refused: list[str] = []

    def tick(show: Show) -> None:
        try:
            show.tick()
        except ValueError as error:
            refused.append(str(error))

    with Show(recording(), [figure], DRAWING, context=context) as show:
        other = threading.Thread(target=tick, args=[show])
        other.start()
        other.join()
    assert len(refused) == 1
    assert "thread" in refused[0]


def test_files_are_whole_when_a_tick_fails(figure: Character, tmp_path: Path) -> None:
    files = FileSettings(
        cache=tmp_path / "c.pc2", report=tmp_path / "r.json", record=tmp_path / "o.mcap"
    )
    stream, failing = Puppeteer(waving(6)), Failing()
    settings = ShowSettings(files=files, origin="waving")
    with (
        pytest.raises(RuntimeError, match="the third frame"),
        Show(stream, [figure], settings, outputs=[failing]) as show,
    ):
        show.run()
    assert stream.closed
    assert failing.closed
    cache = (tmp_path / "c.pc2").read_bytes()
    assert struct.unpack_from("<12siiffi", cache)[-1] == 3
    assert len(cache) == 32 + 3 * 12 * len(figure.vertices)
    assert json.loads((tmp_path / "r.json").read_text())["frames"] == 3
    kept = read_recording(tmp_path / "o.mcap")
    assert len(kept) == 3
    assert kept.source["origin"] == "waving"


@pytest.mark.parametrize(
    ("settings", "about"),
    [
        (ShowSettings(match=MatchSettings(performers=2)), "MatchSettings.performers"),
        (ShowSettings(characters=3 * (CharacterSettings(),)), "ShowSettings.characters"),
        (ShowSettings(match=MatchSettings(source="tail")), "tail"),
        (ShowSettings(match=MatchSettings(mapping=Path("nowhere.json"))), "nowhere.json"),
        (ShowSettings(files=FileSettings(video=Path("nowhere/v.mp4"))), "nowhere"),
        (ShowSettings(files=FileSettings(export=Path("e.fbx"))), "e.fbx"),
    ],
)
def test_what_does_not_fit_is_refused_and_the_stream_closed(
    figure: Character, settings: ShowSettings, about: str
) -> None:
    stream = Puppeteer(waving(3))
    with pytest.raises(InputError, match=about):
        Show(stream, [figure], settings)
    assert stream.closed


def test_a_show_needs_a_character() -> None:
    with pytest.raises(InputError, match="at least one character"):
        Show(Puppeteer(waving(3)), [])


def test_one_settings_for_all_or_one_for_each(figure: Character) -> None:
    both = [figure, make_figure(name="other")]
    soft = CharacterSettings(cartoon=0.5, iterations=1)
    with Show(recording(), both, ShowSettings(characters=(soft,))) as show:
        assert [puppet.iterations for puppet in show.puppets] == [1, 1]
    with Show(recording(), both, ShowSettings(characters=(soft, CharacterSettings()))) as show:
        assert [puppet.iterations for puppet in show.puppets] == [1, 2]


def test_a_recording_is_sought_and_a_live_stream_is_not(figure: Character) -> None:
    with Show(recording(20), [figure]) as show:
        show.tick()
        show.seek(1.5)
        show.tick()
        assert show.playback is not None
        assert show.playback.position == pytest.approx(1.5)
    with Show(Puppeteer(waving(3)), [figure]) as show, pytest.raises(ValueError, match="live"):
        show.seek(1.0)


def test_an_action_ends_the_show(figure: Character) -> None:
    stream = Player(record(waving(4)), EveryFrame(), loop=True)
    with Show(stream, [figure]) as show:
        frames = []

        def leave() -> None:
            frames.append(show.frames)
            if show.frames == 10:
                ACTIONS["leave"].press(show.controls)

        show.run(leave)
        assert frames == list(range(1, 11))
        assert show.ended


def test_a_fault_of_a_take_goes_to_the_callers_ears(figure: Character, tmp_path: Path) -> None:
    warnings: list[str] = []
    settings = ShowSettings(files=FileSettings(takes=tmp_path / "nowhere" / "take.mcap"))
    with Show(recording(), [figure], settings, warn=warnings.append) as show:
        ACTIONS["record"].press(show.controls)
        show.run()
    assert len(warnings) == 1
    assert "nowhere" in warnings[0]


def test_the_stream_chooses_the_pace(figure: Character) -> None:
    """With the recorded timing a tick finds nothing to perform until the clock has gone on."""
    now = 0.0
    stream = Player(record(waving(4)), RealTime(clock=lambda: now))
    with Show(stream, [figure], pace=AtOnce()) as show:
        assert show.tick()
        assert not show.tick()
        now = 0.1
        assert show.tick()
        assert show.playback is not None
        assert not show.playback.every_frame


def test_a_taken_port_of_the_remote_control_is_refused(figure: Character) -> None:
    stream = Puppeteer(waving(3))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        settings = ShowSettings(remote=RemoteSettings(("127.0.0.1", port)))
        with pytest.raises(InputError, match=str(port)):
            Show(stream, [figure], settings)
    assert stream.closed


def test_several_performers_drive_a_character_each(figure: Character) -> None:
    clock = [0.0]
    stream = Simulator(motion_clip("wave"), lambda: clock[0], performers=2)
    characters = [figure, make_figure(name="second"), make_figure(name="third")]
    with Show(stream, characters, ShowSettings(match=MatchSettings(performers=2))) as show:
        assert [len(act.puppets) for act in show.acts] == [1, 2]
        for tick in range(5):
            clock[0] = tick / 60.0
            assert show.tick()


def test_what_is_proposed_lights_up_on_the_character_as_it_is_now() -> None:
    """A body performs on while a match is looked for; its limbs light up where they are."""
    stream = play(builtin_recording("wave"), every_frame=True, loop=True)
    with Show(stream, [load_character("mannequin")]) as show:
        for _ in range(40):
            show.tick()
        press("match-again", show.controls)
        for _ in range(20):
            show.tick()
        (puppet,), nodes = show.puppets, show.motions[0].nodes
        assert puppet.proposal is not None
        assert nodes is not None
        for highlight, part in zip(puppet.highlights, puppet.proposal.parts, strict=True):
            np.testing.assert_allclose(
                highlight.points, nodes.positions[list(part.target)], atol=1e-9
            )
        rest = puppet.character.skeleton.rest_positions
        assert np.abs(nodes.positions - rest).max() > 0.1
