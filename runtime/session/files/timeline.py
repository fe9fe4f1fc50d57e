"""A session's clips and marks as an OpenTimelineIO file, which editing programs read."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from devices.errors import InputError
from runtime.output.files.whole_file import check_suffix, check_writable, whole_file
from runtime.session.document import Actor, Clip, Session
from runtime.session.files.folder import PERFORMANCES, RECORDINGS

SUFFIX = ".otio"
NAME = "bunraku"  # of our own fields in the file's metadata


class TimelineFile:
    """Writes what plays when: the clips of each actor on tracks, and the marks.

    Editing programs count whole frames, so moments are rounded to them; exact ones stand beside as
    metadata. The clips of a track follow one another, so layers at one time need several tracks: a
    clip lies on a track above all tracks of its actor's lower clips that it overlaps. A clip that
    is muted, or beside a solo, is disabled. One that is played several times is there as often.

    Args:
        path: ends in .otio.

    Raises:
        InputError: the suffix is another one, the library is missing, or the disk refuses.
    """

    def __init__(self, path: Path) -> None:
        check_suffix(path, (SUFFIX,))
        check_writable(path)
        self._path, self._otio = path, _import_otio(path)

    def write(self, session: Session, source: Path, rate: float) -> str:
        """Write the file in one piece; return what it holds, in words.

        Args:
            session: whose clips.
            source: its file, to which the clips refer.
            rate: frames a second.

        Raises:
            InputError: the disk fails.
        """
        otio = self._otio
        timeline = otio.schema.Timeline(source.stem)
        timeline.metadata[NAME] = {"session": source.name}
        for actor in session.actors:
            for number, row in enumerate(_rows(session, actor, rate), 1):
                name = actor.name if number == 1 else f"{actor.name} {number}"
                track = otio.schema.Track(name, kind=otio.schema.TrackKind.Video)
                track.metadata[NAME] = {"actor": actor.id, "character": actor.character}
                for part in row:
                    if gap := part.first - track.duration().to_frames():
                        empty = otio.opentime.RationalTime(gap, rate)
                        track.append(otio.schema.Gap(duration=empty))
                    track.append(self._clip(session, part, source, rate))
                timeline.tracks.append(track)
        for mark in session.marks:
            moment = otio.opentime.RationalTime(round(mark.time * rate), rate)
            nothing = otio.opentime.RationalTime(0, rate)
            marker = otio.schema.Marker(mark.name, otio.opentime.TimeRange(moment, nothing))
            marker.metadata[NAME] = {"time": mark.time}
            timeline.tracks.markers.append(marker)
        with whole_file(self._path) as partial:
            partial.write_text(otio.adapters.write_to_string(timeline, "otio_json"), "utf-8")
        clips = sum(1 for _ in timeline.find_clips())
        return f"{len(timeline.tracks)} tracks, {clips} clips, {len(session.marks)} marks"

    def _clip(self, session: Session, part: _Part, source: Path, rate: float) -> Any:
        otio, clip = self._otio, part.clip
        take = session.take(clip.take)
        time = otio.opentime.RationalTime
        whole = time(max(round(take.performance.duration * rate), 1), rate)
        media = otio.schema.ExternalReference(
            quote(source.name), otio.opentime.TimeRange(time(0, rate), whole)
        )
        media.metadata[NAME] = {"performance": f"{PERFORMANCES}/{take.performance.key}.glb"}
        if take.recording:
            media.metadata[NAME]["recording"] = f"{RECORDINGS}/{take.recording}"
        first = time(round(clip.first * rate), rate)
        made = otio.schema.Clip(
            take.name,
            media,
            otio.opentime.TimeRange(first, time(part.last - part.first, rate)),
        )
        if clip.speed != 1.0:
            made.effects.append(otio.schema.LinearTimeWarp(time_scalar=clip.speed))
        made.enabled = any(clip is one for one, _ in session.played(take.actor))
        made.metadata[NAME] = asdict(clip) | {"nodes": clip.nodes and list(clip.nodes)}
        return made


@dataclass(frozen=True, slots=True)
class _Part:
    """A clip, or one pass of it, from a frame to the one at which it has ended."""

    clip: Clip
    first: int
    last: int


def _rows(session: Session, actor: Actor, rate: float) -> list[list[_Part]]:
    """The parts of an actor's clips in rows that do not overlap, the lowest row first."""
    rows: list[list[_Part]] = []
    for clip in session.clips:
        if session.take(clip.take).actor != actor.id:
            continue
        parts = list(_parts(clip, rate))
        first, last = parts[0].first, parts[-1].last
        below = [
            number
            for number, row in enumerate(rows)
            if any(part.first < last and first < part.last for part in row)
        ]
        number = below[-1] + 1 if below else 0
        rows += [[]] if number == len(rows) else []
        rows[number] += parts
    return [sorted(row, key=lambda part: part.first) for row in rows]


def _parts(clip: Clip, rate: float) -> Iterator[_Part]:
    """The passes of a clip that last a frame, or the clip as one frame."""
    span = (clip.last - clip.first) / clip.speed
    ends = [clip.start + min(n * span, clip.length) for n in range(math.ceil(clip.passes) + 1)]
    frames = [round(end * rate) for end in ends]
    if frames[-1] == frames[0]:
        yield _Part(clip, frames[0], frames[0] + 1)
    for first, last in itertools.pairwise(frames):
        if first < last:
            yield _Part(clip, first, last)


def _import_otio(path: Path) -> Any:
    try:
        import opentimelineio  # noqa: PLC0415  # an optional extra
    except ImportError as error:
        raise InputError(
            f"cannot write {path}: timelines need the extra: pip install 'bunraku[timeline]'"
        ) from error
    return opentimelineio
