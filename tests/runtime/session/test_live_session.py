"""A session in a real show: takes are recorded, layered, played, undone and come back."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.formats import read_recording
from runtime.characters.open_character import load_character
from runtime.cli.sessions.session import _Beginning
from runtime.control.actions import press, set_value
from runtime.session import edits
from runtime.session.files.store import SessionStore
from runtime.session.transport import Mode
from runtime.show.open_stream import play
from runtime.show.settings import KioskSettings, MatchSettings, ShowSettings
from runtime.show.show import Show


def open_show(
    path: Path, character: str = "mannequin", motion: str = "wave", **options: object
) -> Show:
    stream = play(builtin_recording(motion), every_frame=True, loop=True)
    settings = ShowSettings(
        match=MatchSettings(**options),  # type: ignore[arg-type]  # of various types
    )
    return Show(stream, [load_character(character)], settings, session=SessionStore(path))


def ticks(show: Show, count: int) -> list[np.ndarray]:
    seen = []
    for _ in range(count):
        assert show.tick()
        seen.append(show.vertices[0])
    return seen


def record(show: Show, count: int) -> list[np.ndarray]:
    ticks(show, 2)  # the performer is seen
    press("record", show.controls)
    seen = ticks(show, count)
    press("record", show.controls)
    return seen


@pytest.mark.parametrize("character", ["mannequin", "squid"])
def test_a_take_plays_what_was_performed(tmp_path: Path, character: str) -> None:
    with open_show(tmp_path / "s.bunraku", character) as show:
        ticks(show, 20)
        performed = record(show, 60)
        session = show.controls.session
        assert session is not None
        assert session.transport.mode is Mode.REHEARSING
        (clip,) = session.session.clips
        session.edit(edits.eased(session.session, clip.id, 0.0, 0.0), "no ease")
        ticks(show, 90)
        press("play", show.controls)
        ticks(show, 25)  # the performer lets go
        session.transport.go_to(0.0)
        played = ticks(show, 40)
    height = np.ptp(performed[0][:, 1])
    times = clip.start + np.arange(1, 40) / 60.0
    assert times[-1] < clip.end
    errors = [np.abs(a - b).max() for a, b in zip(played[1:], performed[2:41], strict=True)]
    assert min(np.abs(played[5] - one).max() for one in performed) < 2e-3 * height
    assert np.median(errors) < 0.02 * height
    assert np.abs(played[5] - played[30]).max() > 0.05 * height


def test_a_match_that_is_looked_for_lights_up_before_anybody_has_performed(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku", "squid", rehearse=False, patience=60.0) as show:
        ticks(show, 3)
        assert show.controls.match_controls.matching
        (puppet,) = show.puppets
        parts = show.controls.match_controls.matches[0].parts
        assert [each.joints for each in puppet.highlights] == [part.source[1:] for part in parts]
        assert parts


def test_all_that_is_recorded_at_once_is_one_take_by_name(tmp_path: Path) -> None:
    stream = play(builtin_recording("wave"), every_frame=True, loop=True)
    characters = [load_character(name) for name in ("squid", "mannequin")]
    with Show(stream, characters, session=SessionStore(tmp_path / "s.bunraku")) as show:
        for _ in range(2):
            record(show, 5)
        session = show.controls.session
        assert session is not None
        names = [take.name for take in session.session.takes]
    assert names == ["take 1", "take 1", "take 2", "take 2"]


def test_any_jump_shows_the_same_bytes_as_playing_there(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        record(show, 60)
        session = show.controls.session
        assert session is not None
        press("pause", show.controls)
        ticks(show, 30)
        transport = session.transport
        moments = np.linspace(0.0, 0.9, 10).tolist()
        shown = []
        for moment in [*moments, *reversed(moments)]:
            transport.seek(moment)
            shown.append(ticks(show, 1)[0])
    for there, back in zip(shown[:10], reversed(shown[10:]), strict=True):
        assert_array_equal(there, back)


def test_takes_layer_while_others_play(tmp_path: Path) -> None:
    """A second take of the same actor lies over the first, and undo takes it away again."""
    with open_show(tmp_path / "s.bunraku", "squid", driver="relative") as show:
        record(show, 40)
        session = show.controls.session
        assert session is not None
        record(show, 40)
        assert [clip.take for clip in session.session.clips] == [1, 2]
        press("undo", show.controls)
        assert [clip.take for clip in session.session.clips] == [1]
        press("redo", show.controls)
        assert len(session.session.clips) == 2
        press("retake", show.controls)
        assert session.recording
        ticks(show, 10)
        press("hold", show.controls)  # a space ends the take
        assert not session.recording
        assert [clip.take for clip in session.session.clips] == [1, 3]


def test_nothing_moves_by_leaps_when_a_take_begins_or_ends(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        seen = ticks(show, 30)
        record(show, 60)
        press("play", show.controls)
        seen = ticks(show, 55)
        press("rehearse", show.controls)
        seen += ticks(show, 40)
    steps = np.array([np.abs(b - a).max() for a, b in pairwise(seen)])
    assert steps.max() < 0.12 * np.ptp(seen[0][:, 1])


def test_the_session_and_its_recordings_come_back(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path) as show:
        record(show, 30)
        session = show.controls.session
        assert session is not None
        saved = session.session
    assert [each.name for each in tmp_path.iterdir()] == ["s.bunraku"]
    again = SessionStore(path)
    assert again.session == saved
    (take,) = saved.takes
    recording = read_recording(again.folder.recordings / take.recording)
    assert len(recording.times) == 30
    assert any("left arm" in line for line in take.parts)
    again.close()
    with open_show(path) as show:
        assert show.controls.session is not None
        assert show.controls.session.session == saved


def test_what_was_performed_before_anything_was_pressed_can_be_kept(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        performed = ticks(show, 50)
        press("recall", show.controls)
        session = show.controls.session
        assert session is not None
        (take,) = session.session.takes
        assert take.performance.duration == pytest.approx(49 / 60, abs=1e-3)
        assert len(performed) == 50


def test_another_character_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path) as show:
        record(show, 5)
    with pytest.raises(InputError, match="has the characters mannequin, and the show has squid"):
        open_show(path, "squid")
    assert_allclose(len(SessionStore(path).session.takes), 1)


def test_the_fader_of_the_loop_is_the_sessions(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        set_value("loop", 1.0, show.controls)
        session = show.controls.session
        assert session is not None
        assert session.transport.loop


def test_a_kiosk_plays_while_nobody_is_there(tmp_path: Path) -> None:
    """Somebody performs for 1 s of 3: the session plays half a second after they have left."""
    path = tmp_path / "s.bunraku"
    with open_show(path) as show:
        record(show, 40)
    wave = builtin_recording("wave")
    count = min(len(wave), 180)
    positions, confidence = wave.positions[:count].copy(), wave.confidence[:count].copy()
    positions[60:], confidence[60:] = np.nan, 0.0
    seen = replace(
        wave,
        times=wave.times[:count],
        positions=positions,
        confidence=confidence,
        rotations=None,
        performers=wave.performers[:count],
        arrivals=wave.arrivals[:count],
        blends=None,
    )
    modes = []
    stream = play(seen, every_frame=True, loop=True)
    settings = ShowSettings(kiosk=KioskSettings(0.5))
    characters = [load_character("mannequin")]
    with Show(stream, characters, settings, session=SessionStore(path)) as show:
        session = show.controls.session
        assert session is not None
        for _ in range(2 * count):
            show.tick()
            modes.append(session.transport.mode)
    assert set(modes[2:58]) == {Mode.REHEARSING}
    assert set(modes[95:count]) == {Mode.PLAYING}
    assert set(modes[count + 2 : count + 58]) == {Mode.REHEARSING}
    assert modes[-1] is Mode.PLAYING


def test_a_take_without_a_frame_is_told_and_not_kept(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        ticks(show, 2)
        press("record", show.controls)
        press("record", show.controls)
        session = show.controls.session
        assert session is not None
        assert session.session.takes == ()
        said = [notice.text for notice in show.controls.notices.current]
        assert "the take holds no frame: it is not kept" in said


def test_what_is_recorded_at_half_speed_fits_at_full_speed(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        set_value("half-speed", 1.0, show.controls)
        record(show, 61)
        session = show.controls.session
        assert session is not None
        (clip,) = session.session.clips
        assert clip.speed == 2.0
        assert clip.length == pytest.approx(0.5, abs=1e-3)


def test_a_take_outside_the_range_is_kept_without_a_clip_and_told(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        session = show.controls.session
        assert session is not None
        session.edit(edits.punched(session.session, 5.0, 6.0), "punch in")
        record(show, 10)
        assert len(session.session.takes) == 1
        assert session.session.clips == ()
        said = [notice.text for notice in show.controls.notices.current]
        assert any("outside the range" in line for line in said)


def test_stopping_ends_a_take_and_keeps_it(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        ticks(show, 2)
        press("record", show.controls)
        ticks(show, 20)
        press("half-speed", show.controls)
        press("rehearse", show.controls)
        session = show.controls.session
        assert session is not None
        assert not show.controls.takes.recording
        (clip,) = session.session.clips
        assert clip.speed == 1.0
        assert session.session.takes[0].performance.duration == pytest.approx(19 / 60, abs=1e-3)


def test_a_take_that_was_asked_for_waits_for_somebody_who_performs(tmp_path: Path) -> None:
    """As with a live performer, who is seen before a match performs."""
    wave = builtin_recording("wave")
    settings = ShowSettings(match=MatchSettings(rehearse=False, patience=0.3))
    store = SessionStore(tmp_path / "s.bunraku")
    stream = play(wave, every_frame=True)
    begin = _Beginning(1.5, take=True)
    with Show(stream, [load_character("squid")], settings, session=store) as show:
        session = show.controls.session
        assert session is not None
        modes = []
        for _ in range(60):
            assert show.tick()
            begin(show)
            modes.append(session.transport.mode)
        press("record", show.controls)
        (clip,) = session.session.clips
    assert modes[:10] == [Mode.REHEARSING] * 10
    assert modes[-1] is Mode.RECORDING
    assert clip.start == 1.5
