"""`bunraku demo`, `replay` and `live`: a performer drives characters."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import devices.simulator  # noqa: F401 - registers sim://
from devices.errors import InputError
from devices.stream import SkeletonStream, open_stream
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.mcap_writer import McapWriter
from replay.player import EveryFrame, Player, RealTime
from replay.recording import Recording
from runtime.cast import character_named
from runtime.characters.builtin import BUILTIN
from runtime.clock import Ticker
from runtime.director import Choices, Director
from runtime.loop import FrameLoop
from runtime.mapping import Mapping, read_mapping
from runtime.output.exports import open_export
from runtime.output.frames import Frames
from runtime.output.output import Output
from runtime.output.point_cache import PointCache
from runtime.output.report import MatchedPair, Part, Report
from runtime.output.video import Video
from runtime.performer import Performer
from runtime.progress import Progress
from runtime.puppet import Puppet
from runtime.render.camera import front_camera
from runtime.render.context import headless_context
from runtime.theatre import Theatre

TICKS = 60.0  # a second, where nothing else sets the pace
STEADY = 1.0  # seconds that a live match stands before it performs by itself


@dataclass(frozen=True, slots=True)
class _Source:
    """Where a show's motion comes from, and what is known of it beforehand."""

    stream: SkeletonStream
    rate: float
    recording: Recording | None


def demo(options: argparse.Namespace) -> int:
    """One built-in performance drives every built-in character."""
    options.character = options.character or list(BUILTIN)
    return _show(options, _played(builtin_recording("show"), options), patience=0.0)


def replay(options: argparse.Namespace) -> int:
    """A recorded stream drives characters."""
    recording = read_recording(options.recording)
    return _show(options, _played(recording, options), patience=0.0)


def live(options: argparse.Namespace) -> int:
    """A live stream drives characters."""
    source = _Source(open_stream(options.device), TICKS, None)
    return _show(options, source, patience=STEADY)


def _played(recording: Recording, options: argparse.Namespace) -> _Source:
    pace = EveryFrame() if options.fast else RealTime(options.speed)
    seconds = recording.seconds
    rate = (len(recording) - 1) / seconds if seconds > 0.0 else TICKS
    return _Source(Player(recording, pace, loop=options.loop), rate, recording)


def _show(options: argparse.Namespace, source: _Source, *, patience: float) -> int:
    """Open everything, run the loop to the end, close everything, whatever happens."""
    with ExitStack() as closing:
        stream = closing.enter_context(source.stream)
        performer = Performer(stream.skeleton, options.source)
        characters = [character_named(name) for name in options.character]
        report = closing.enter_context(Report(options.report))
        parts = [report.cast(character) for character in characters]
        puppets = [Puppet(one, iterations=options.iterations) for one in characters]
        outputs = _outputs(options, puppets, parts, source.rate, closing)
        recorder = None
        if options.record is not None:
            recorder = closing.enter_context(McapWriter(options.record, stream.skeleton))
        theatre = _theatre(options, puppets, stream, outputs, closing)
        camera = front_camera() if theatre is None else theatre.camera
        director = Director(
            performer,
            puppets,
            lambda: camera.view_rotation if theatre is None else theatre.camera.view_rotation,
            Choices(options.match, options.chains == "extend", options.flip, patience),
            [_by_hand(options, performer, puppet) for puppet in puppets],
        )
        loop = FrameLoop(
            stream,
            performer,
            puppets,
            director=director,
            report=report,
            theatre=theatre,
            outputs=outputs,
            recorder=recorder,
        )
        total = None if source.recording is None or options.loop else len(source.recording)
        closing.callback(_tell, report, parts, puppets, performer, loop, source)
        _run(loop, stream, closing.enter_context(Progress("performing", total)), options.fast)
    return 0


def _run(loop: FrameLoop, stream: SkeletonStream, progress: Progress, fast: bool) -> None:
    ticker = Ticker(TICKS)
    while not stream.ended:
        if loop.tick():
            progress.advance()
        if not fast:
            ticker.wait()


def _tell(
    report: Report,
    parts: Sequence[Part],
    puppets: Sequence[Puppet],
    performer: Performer,
    loop: FrameLoop,
    source: _Source,
) -> None:
    """Put what is only known at the end into the report."""
    names = performer.skeleton.names
    recording = source.recording
    report.recorded(
        frames=loop.frames + report.dropped if recording is None else len(recording),
        joints=len(names),
        seconds=loop.seconds if recording is None else recording.seconds,
    )
    for part, puppet in zip(parts, puppets, strict=True):
        mapping = puppet.mapping
        pairs = [
            MatchedPair(tuple(names[joint] for joint in drive.source), drive.target)
            for drive in mapping.drives
        ]
        part.matched(mapping.score, pairs)


def _by_hand(options: argparse.Namespace, performer: Performer, puppet: Puppet) -> Mapping | None:
    if options.mapping is None:
        return None
    return read_mapping(options.mapping, performer.skeleton, puppet.character.skeleton)


def _theatre(
    options: argparse.Namespace,
    puppets: Sequence[Puppet],
    stream: SkeletonStream,
    outputs: Sequence[Sequence[Output]],
    closing: ExitStack,
) -> Theatre | None:
    if not any(output.needs_picture for kept in outputs for output in kept):
        return None
    theatre = Theatre(
        headless_context(),
        options.size,
        puppets,
        stream.skeleton,
        transparent=options.transparent,
    )
    closing.callback(theatre.close)
    return theatre


def _outputs(
    options: argparse.Namespace,
    puppets: Sequence[Puppet],
    parts: Sequence[Part],
    rate: float,
    closing: ExitStack,
) -> list[list[Output]]:
    """What keeps each puppet's performance; the pictures of all go with the first."""
    outputs: list[list[Output]] = []
    alone = len(puppets) == 1
    for puppet, part in zip(puppets, parts, strict=True):
        character = puppet.character
        kept: list[Output] = [part]
        if options.cache is not None:
            path = options.cache if alone else _of(options.cache, character.name)
            kept.append(closing.enter_context(PointCache(path, character)))
        if options.export is not None:
            path = options.export if alone else _of(options.export, character.name)
            kept.append(closing.enter_context(open_export(path, character)))
        outputs.append(kept)
    if options.video is not None:
        outputs[0].append(closing.enter_context(Video(options.video, rate=rate)))
    if options.frames is not None:
        outputs[0].append(closing.enter_context(Frames(options.frames)))
    return outputs


def _of(path: Path, name: str) -> Path:
    """The file for one of several characters: OUT-squid.pc2 beside OUT.pc2."""
    return path.with_name(f"{path.stem}-{name}{path.suffix}")


__all__ = ["InputError", "demo", "live", "replay", "sys"]
