"""A count-in goes by the show's time, can be ended, and begins a take exactly at zero."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.player import EveryFrame, Player
from runtime.characters.open_character import load_character
from runtime.control.actions import ACTIONS, press, set_value
from runtime.control.count_in import LONGEST_STEP, Counted, CountIn
from runtime.control.flow_settings import FlowSettings
from runtime.session import edits
from runtime.session.files.store import SessionStore
from runtime.session.transport import Mode
from runtime.show.open_stream import play
from runtime.show.settings import ShowSettings
from runtime.show.show import Show
from runtime.status.prompts import advice, countdown, headline
from tests.runtime.staged import StagedShow
from tests.runtime.stick_figures import make_figure, record, waving

RATE = 60  # frames a second of the built-in motions


@pytest.fixture
def show(context: moderngl.Context, tmp_path: Path) -> Iterator[StagedShow]:
    stream = Player(record(waving(90)), EveryFrame(), loop=True)
    show = StagedShow(context, make_figure(), stream, tmp_path)
    show.loop.tick()
    yield show
    show.close()


def open_session(path: Path, count_in: float) -> Show:
    stream = play(builtin_recording("wave"), every_frame=True, loop=True)
    settings = ShowSettings(flow=FlowSettings(count_in=count_in))
    return Show(stream, [load_character("mannequin")], settings, session=SessionStore(path))


def test_it_ends_with_the_first_frame_at_zero_however_the_frames_come() -> None:
    for rate in (60.0, 30.0, 7.0):
        begun: list[float] = []
        count_in, now = CountIn(3.0), 100.0
        count_in.follow(now)
        count_in.begin(Counted.TAKE, lambda begun=begun: begun.append(1.0))  # type: ignore[misc]  # a default binds it
        frames = 0
        while not begun:
            assert count_in.counted is Counted.TAKE
            frames += 1
            count_in.follow(now + frames / rate)
        assert frames == np.ceil(3.0 * rate)
        assert count_in.left is None


def test_a_gap_in_the_frames_counts_for_little_and_a_step_back_for_nothing() -> None:
    count_in = CountIn(3.0)
    count_in.begin(Counted.TAKE, lambda: pytest.fail("it begins too soon"))
    for time in (0.0, 50.0, 20.0):
        count_in.follow(time)
    assert count_in.left == pytest.approx(3.0 - LONGEST_STEP)


def test_a_take_holds_the_frame_at_zero_and_those_that_follow(
    show: StagedShow, tmp_path: Path
) -> None:
    set_value("count-in", 0.1, show.controls)
    times = []
    press("record", show.controls)
    assert ACTIONS["record"].read(show.controls) == 1.0
    assert not show.takes.recording
    while not show.takes.recording:
        show.loop.tick()
        times.append(show.stream.recording.times[len(times) + 1])
    for _ in range(4):
        show.loop.tick()
    press("record", show.controls)
    show.takes.close()
    assert times[-1] - show.stream.recording.times[0] == pytest.approx(1.0)
    (path,) = tmp_path.glob("out-*.mcap")
    kept = read_recording(path)
    assert len(kept) == 5
    np.testing.assert_allclose(
        kept.positions[0], show.stream.recording.positions[len(times)], atol=1e-5
    )


@pytest.mark.parametrize("ends", ["record", "leave"])
def test_the_same_key_and_escape_end_it_without_a_take(show: StagedShow, ends: str) -> None:
    set_value("count-in", 0.3, show.controls)
    press("record", show.controls)
    show.loop.tick()
    assert headline(show._opened.status()) == "The take starts in 3"
    assert "Escape" in advice(show._opened.status())
    assert countdown(show._opened.status()) == pytest.approx(2.9)
    press(ends, show.controls)
    assert not show.controls.leaving
    for _ in range(200):
        show.loop.tick()
    assert not show.takes.recording
    press("leave", show.controls)
    assert show.controls.leaving


def test_a_match_that_is_accepted_performs_at_zero(show: StagedShow) -> None:
    set_value("count-in", 0.1, show.controls)
    press("accept", show.controls)
    seen = [show.match_session.matching]
    while show.match_session.matching:
        assert show._opened.status().count_in is not None
        show.loop.tick()
        seen.append(show.match_session.matching)
    assert len(seen) - 1 == round(1.0 / np.diff(show.stream.recording.times[:2])[0])
    press("match-again", show.controls)
    press("accept", show.controls)
    press("leave", show.controls)
    for _ in range(90):
        show.loop.tick()
    assert show.match_session.matching, "ended before zero, nothing is accepted"


def test_one_press_after_another_goes_through_the_lengths(show: StagedShow) -> None:
    seen = []
    for _ in range(4):
        press("next-count-in", show.controls)
        seen.append(show.controls.count_in.seconds)
    assert seen == [3.0, 5.0, 10.0, 0.0]
    assert show.controls.notices.latest.text == "Count-in: none"


def test_a_take_of_a_session_is_counted_in_and_cut_to_the_range(tmp_path: Path) -> None:
    with open_session(tmp_path / "s.bunraku", 0.5) as show:
        session = show.controls.session
        assert session is not None
        session.edit(edits.punched(session.session, 0.25, 0.5), "punch in")
        for _ in range(3):
            show.tick()
        session.transport.seek(0.1)
        press("record", show.controls)
        modes = []
        for _ in range(RATE):
            show.tick()
            modes.append(session.transport.mode)
        press("record", show.controls)
        (clip,), (take,) = session.session.clips, session.session.takes
    assert modes == [Mode.REHEARSING] * 29 + [Mode.RECORDING] * 31
    assert take.performance.duration == pytest.approx(30 / RATE, abs=1e-4)
    assert (clip.start, clip.end) == pytest.approx((0.25, 0.5), abs=1e-3)
    store = SessionStore(tmp_path / "s.bunraku")
    assert len(read_recording(store.folder.recordings / take.recording)) == 31
    store.close()


def test_playing_ends_a_count_in_of_a_session(tmp_path: Path) -> None:
    with open_session(tmp_path / "s.bunraku", 0.5) as show:
        for _ in range(3):
            show.tick()
        press("record", show.controls)
        press("play", show.controls)
        for _ in range(RATE):
            show.tick()
        assert show.controls.session is not None
        assert show.controls.session.session.takes == ()


def test_a_length_out_of_range_is_refused_by_its_name() -> None:
    with pytest.raises(InputError, match=r"FlowSettings\.count_in"):
        FlowSettings(count_in=61.0)
