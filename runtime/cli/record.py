"""`bunraku record`: writes a live performer's frames to a file, without a character."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from runtime.cli.options.arguments import positive
from runtime.show.interrupts import interrupts_deferred

if TYPE_CHECKING:
    from devices.skeleton import SkeletonFrame
    from devices.stream import SkeletonStream
    from replay.recorder import Recorder

HELP = "record a live performer, without a character"
USAGE = "OUT.mcap --device URL [--seconds N]"
POLLS = 240.0  # a second: twice the rate of the fastest sensor


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument("out", type=Path, metavar="OUT.mcap", help="the file to write")
    needed.add_argument(
        "--device", required=True, metavar="URL", help="the device; `bunraku devices` lists them"
    )
    time = parser.add_argument_group("time")
    time.add_argument(
        "--seconds", type=positive, metavar="N", help="stop after N seconds (default: at Ctrl-C)"
    )


def run(options: argparse.Namespace) -> int:
    """Write every frame that comes until Ctrl-C or `--seconds`.

    Raises:
        InputError: the device cannot be opened, no frame came from it, or the disk fails; the
            frames until then are kept.
    """
    from devices.errors import InputError
    from devices.stream import open_stream
    from replay.bounds import check_recordable
    from replay.recorded_stream import RecordedStream
    from replay.recorder import Recorder
    from runtime.output.files.whole_file import check_writable
    from runtime.show.messages import say, warn
    from runtime.show.provenance import provenance
    from runtime.show.takes import set_aside

    check_recordable(options.out)
    check_writable(options.out)
    warnings: list[str] = []
    with open_stream(options.device) as stream:
        set_aside(options.out, warn)
        source = provenance(options.device)
        recorder = Recorder(options.out, stream.skeleton, source=source, tell=warnings.append)
        seconds = options.seconds or math.inf
        recorded = RecordedStream(stream, _first_seconds(recorder.offer, seconds))
        try:
            _poll(recorded, recorder, warnings, seconds)
        finally:
            with interrupts_deferred():
                recorder.close()
            lost = f", {recorder.lost} lost" if recorder.lost else ""
            say(f"{recorder.frames} frames in {options.out}{lost}")
        traffic = getattr(stream, "traffic", None)
    if recorder.fault:
        raise InputError(recorder.fault)
    if recorder.frames == 0:
        why = "" if traffic is None else traffic.unused(options.device)
        raise InputError(f"nothing was recorded: {why or 'no frame came'}")
    return 0


def _first_seconds(
    keep: Callable[[SkeletonFrame], None], seconds: float
) -> Callable[[SkeletonFrame], None]:
    """`keep`, limited to frames of less than `seconds` [s] after the first."""
    began: float | None = None

    def take(frame: SkeletonFrame) -> None:
        nonlocal began
        began = frame.time if began is None else began
        if frame.time - began < seconds:
            keep(frame)

    return take


def _poll(stream: SkeletonStream, recorder: Recorder, warnings: list[str], seconds: float) -> None:
    """Poll for `seconds` [s], or until the recorder fails, and print its warnings."""
    from runtime.show.clock import Ticker
    from runtime.show.messages import warn

    ticker = Ticker(POLLS)
    began = time.perf_counter()
    over = False
    while not (stream.ended or over or recorder.fault):
        over = time.perf_counter() - began >= seconds
        with interrupts_deferred():
            stream.poll()
        while warnings and not recorder.fault:
            warn(warnings.pop(0))
        ticker.wait()
