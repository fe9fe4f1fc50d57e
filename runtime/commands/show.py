"""`bunraku demo`, `replay` and `live`: a performer drives characters."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from devices.stream import SkeletonStream, open_stream
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.mcap_writer import McapWriter
from replay.player import EveryFrame, Player, RealTime
from replay.recording import Recording
from runtime.cast import character_named
from runtime.characters.builtin import BUILTIN
from runtime.clock import Ticker
from runtime.controls import Controls
from runtime.director import Choices, Director
from runtime.loop import FrameLoop
from runtime.mapping import Mapping, read_mapping
from runtime.output.export import open_export
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
from runtime.window import Window

TICKS = 60.0  # a second, where nothing else sets the pace
STEADY = 1.0  # seconds that a live match stands before it performs by itself


@dataclass(frozen=True, slots=True)
class _Source:
    """Where a show's motion comes from, and what is known of it beforehand.

    Attributes:
        stream: gives the frames.
        rate: about how many come in a second.
        recording: what is played, or None when live.
        patience: how long [s] a match must stand before it performs by itself.
    """

    stream: SkeletonStream
    rate: float
    recording: Recording | None
    patience: float


def demo(options: argparse.Namespace) -> int:
    """Let one built-in performance drive every built-in character."""
    options.character = options.character or list(BUILTIN)
    if not _has_display():
        options.headless = options.fast = True
    return _show(options, _played(builtin_recording("show"), options))


def replay(options: argparse.Namespace) -> int:
    """Let a recorded stream drive characters."""
    return _show(options, _played(read_recording(options.recording), options))


def live(options: argparse.Namespace) -> int:
    """Let a live stream drive characters."""
    return _show(options, _Source(open_stream(options.device), TICKS, None, STEADY))


def _has_display() -> bool:
    if not sys.platform.startswith("linux"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _played(recording: Recording, options: argparse.Namespace) -> _Source:
    pace = EveryFrame() if options.fast else RealTime(options.speed)
    seconds = recording.seconds
    rate = (len(recording) - 1) / seconds if seconds > 0.0 else TICKS
    return _Source(Player(recording, pace, loop=options.loop), rate, recording, 0.0)


def _show(options: argparse.Namespace, source: _Source) -> int:
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
        window = None
        if not options.headless:
            window = closing.enter_context(Window("Bunraku", options.size))
        theatre = _theatre(options, puppets, stream, outputs, window)
        if theatre is not None:
            closing.callback(theatre.close)
        director = _director(options, performer, puppets, theatre, source)
        loop = FrameLoop(
            stream,
            performer,
            puppets,
            director=director,
            report=report,
            theatre=theatre,
            outputs=outputs,
            recorder=recorder,
            shown=window is not None,
        )
        controls = None
        if window is not None and theatre is not None:
            controls = Controls(window, theatre, director, stream)
        total = None if source.recording is None or options.loop else len(source.recording)
        closing.callback(_tell, report, parts, puppets, performer, loop, source.recording)
        progress = closing.enter_context(Progress("performing", total))
        _run(loop, stream, controls, progress, pace=None if options.fast else TICKS)
    return 0


def _run(
    loop: FrameLoop,
    stream: SkeletonStream,
    controls: Controls | None,
    progress: Progress,
    *,
    pace: float | None,
) -> None:
    """Tick until the stream ends or the window is closed, `pace` times a second."""
    ticker = None if pace is None else Ticker(pace)
    while not stream.ended and not (controls is not None and controls.leaving):
        if loop.tick():
            progress.advance()
        if controls is not None:
            controls.present()
            controls.serve()
        if ticker is not None:
            ticker.wait()


def _director(
    options: argparse.Namespace,
    performer: Performer,
    puppets: Sequence[Puppet],
    theatre: Theatre | None,
    source: _Source,
) -> Director:
    by_hand: list[Mapping | None] = [
        None
        if options.mapping is None
        else read_mapping(options.mapping, performer.skeleton, puppet.character.skeleton)
        for puppet in puppets
    ]
    front = front_camera()
    return Director(
        performer,
        puppets,
        lambda: (front if theatre is None else theatre.camera).view_rotation,
        Choices(options.match, options.chains == "extend", options.flip, source.patience),
        by_hand,
    )


def _tell(
    report: Report,
    parts: Sequence[Part],
    puppets: Sequence[Puppet],
    performer: Performer,
    loop: FrameLoop,
    recording: Recording | None,
) -> None:
    """Put what is only known at the end into the report."""
    names = performer.skeleton.names
    if recording is None:
        report.recorded(
            frames=loop.frames + report.dropped, joints=len(names), seconds=loop.seconds
        )
    else:
        report.recorded(frames=len(recording), joints=len(names), seconds=recording.seconds)
    for part, puppet in zip(parts, puppets, strict=True):
        pairs = [
            MatchedPair(tuple(names[joint] for joint in drive.source), drive.target)
            for drive in puppet.mapping.drives
        ]
        part.matched(puppet.mapping.score, pairs)


def _theatre(
    options: argparse.Namespace,
    puppets: Sequence[Puppet],
    stream: SkeletonStream,
    outputs: Sequence[Sequence[Output]],
    window: Window | None,
) -> Theatre | None:
    """The house, if anybody looks."""
    if window is None and not any(output.needs_picture for kept in outputs for output in kept):
        return None
    return Theatre(
        headless_context() if window is None else window.context,
        options.size if window is None else window.size,
        puppets,
        stream.skeleton,
        transparent=options.transparent,
    )


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
            kept.append(closing.enter_context(open_export(path, character, rate=rate)))
        outputs.append(kept)
    if options.video is not None:
        outputs[0].append(closing.enter_context(Video(options.video, rate=rate)))
    if options.frames is not None:
        outputs[0].append(closing.enter_context(Frames(options.frames)))
    return outputs


def _of(path: Path, name: str) -> Path:
    """The file for one of several characters: OUT-squid.pc2 beside OUT.pc2."""
    return path.with_name(f"{path.stem}-{name}{path.suffix}")
