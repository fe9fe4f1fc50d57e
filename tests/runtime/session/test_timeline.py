"""OpenTimelineIO files of sessions, as the library's own reader sees them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from devices.errors import InputError
from runtime.session import edits
from runtime.session.document import Actor, Session
from runtime.session.files.timeline import TimelineFile
from tests.runtime.session.sessions import session, take

otio = pytest.importorskip("opentimelineio")
RATE = 30.0


def read(path: Path, made: Session) -> Any:
    """Write a timeline, and read it with the library."""
    TimelineFile(path / "a.otio").write(made, Path("my show.bunraku"), RATE)
    return otio.adapters.read_from_file(str(path / "a.otio"))


def placed(timeline: Any) -> list[tuple[str, str, float, float]]:
    """Track, clip, and the seconds from which to which each clip plays."""
    found = []
    for track in timeline.tracks:
        for clip in track.find_clips():
            there = clip.transformed_time_range(clip.trimmed_range(), timeline.tracks)
            end = there.end_time_exclusive().to_seconds()
            found.append((track.name, clip.name, there.start_time.to_seconds(), end))
    return found


def test_clips_of_layers_lie_where_they_play(tmp_path: Path) -> None:
    made = session(take(0.1), take(0.2), take(0.3))  # three takes of 2 s at once
    made = edits.moved(made, 2, 1.0)
    made = edits.moved(made, 3, 3.0)
    timeline = read(tmp_path, made)
    assert timeline.name == "my show"
    assert placed(timeline) == [
        ("chain", "take of 0.1", 0.0, 2.0),
        ("chain", "take of 0.3", 3.0, 5.0),
        ("chain 2", "take of 0.2", 1.0, 3.0),
    ]


def test_a_higher_layer_lies_on_a_higher_track(tmp_path: Path) -> None:
    made = session(take(0.1), take(0.2), take(0.3))
    made = edits.moved(made, 2, 1.0)
    made = edits.moved(made, 3, 2.5)  # beside the first, over the second
    assert [row[:2] for row in placed(read(tmp_path, made))] == [
        ("chain", "take of 0.1"),
        ("chain 2", "take of 0.2"),
        ("chain 3", "take of 0.3"),
    ]


def test_ranges_speeds_and_passes_of_a_take(tmp_path: Path) -> None:
    made = edits.trimmed(session(take(0.1), start=1.0), 1, 1.5, 2.5)
    made = edits.paced(made, 1, 2.0)
    made = edits.looped(made, 1, 2.5)
    timeline = read(tmp_path, made)
    clips = list(timeline.find_clips())
    times = [(start, end) for _, _, start, end in placed(timeline)]
    assert times == [(1.5, 2.0), (2.0, 2.5), (2.5, pytest.approx(2.75, abs=0.5 / RATE))]
    for clip in clips:
        assert clip.source_range.start_time.to_seconds() == pytest.approx(0.5)
        assert clip.effects[0].time_scalar == 2.0
        assert clip.media_reference.available_range.duration.to_seconds() == 2.0
        assert clip.media_reference.target_url == "my%20show.bunraku"
    key = made.takes[0].performance.key
    assert clips[0].media_reference.metadata["bunraku"]["performance"] == f"performances/{key}.glb"
    assert clips[0].metadata["bunraku"]["passes"] == 2.5


def test_each_actor_has_its_tracks_and_what_is_not_played_is_disabled(tmp_path: Path) -> None:
    made = edits.with_actor(session(take(0.1)), Actor(2, "other", "chain", "relative", 5))
    made = edits.with_take(made, replace(take(0.2), actor=2), 0.5)
    made = edits.with_take(made, replace(take(0.3), actor=2), 4.0)
    made = edits.soloed(edits.muted(made, 2, True), 3, True)
    clips = {clip.name: clip for clip in read(tmp_path, made).find_clips()}
    assert [row[0] for row in placed(read(tmp_path, made))] == ["chain", "other", "other"]
    assert [clips[f"take of {angle}"].enabled for angle in (0.1, 0.2, 0.3)] == [False, False, True]


def test_marks_are_markers(tmp_path: Path) -> None:
    made = edits.marked(edits.marked(session(take(0.1)), 1.5, "bow"), 0.5, "start")
    markers = read(tmp_path, made).tracks.markers
    assert [(one.name, one.marked_range.start_time.to_seconds()) for one in markers] == [
        ("start", 0.5),
        ("bow", 1.5),
    ]


def test_any_session_is_whole_frames_that_do_not_overlap(tmp_path: Path) -> None:
    made = session(take(0.1), take(0.2))
    for number, start in ((1, 0.0101), (2, 1.987)):
        made = edits.moved(made, number, start)
    made = edits.trimmed(made, 2, 1.9880, 1.9895)  # shorter than a frame
    timeline = read(tmp_path, made)
    for clip in timeline.find_clips():
        for time in (clip.source_range.start_time, clip.source_range.duration):
            assert time.value == int(time.value)
        assert clip.source_range.duration.value >= 1
    read(tmp_path, Session())


def test_another_suffix_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.otio"):
        TimelineFile(tmp_path / "a.edl")
