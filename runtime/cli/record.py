"""`bunraku record`: a live stream goes to a file, without a character."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable

from devices.errors import InputError
from devices.skeleton import SkeletonFrame
from devices.stream import SkeletonStream, open_stream
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from runtime.output.files.whole_file import check_writable
from runtime.show.clock import Ticker
from runtime.show.interrupt import held
from runtime.show.provenance import provenance
from runtime.show.takes import set_aside
from runtime.show.warn import warn

POLLS = 240.0  # a second: twice the fastest sensor


def record(options: argparse.Namespace) -> int:
    """Write every frame that comes until Ctrl-C or `--seconds`.

    Raises:
        InputError: the device cannot be opened, or the disk fails; the frames until then are kept.
    """
    check_writable(options.out)
    warnings: list[str] = []
    with open_stream(options.device) as stream:
        set_aside(options.out, warn)
        recorder = Recorder(
            options.out,
            stream.skeleton,
            source=provenance(options.device),
            tell=warnings.append,
        )
        seconds = options.seconds or math.inf
        recorded = RecordedStream(stream, _first_seconds(recorder.offer, seconds))
        try:
            _watch(recorded, recorder, warnings, seconds)
        finally:
            with held():
                recorder.close()
            lost = f", {recorder.lost} lost" if recorder.lost else ""
            print(f"bunraku: {recorder.frames} frames in {options.out}{lost}", file=sys.stderr)
    if recorder.fault:
        raise InputError(recorder.fault)
    return 0


def _first_seconds(
    keep: Callable[[SkeletonFrame], None], seconds: float
) -> Callable[[SkeletonFrame], None]:
    """`keep` for frames of less than `seconds` [s] after the first, nothing for those after."""
    began: float | None = None

    def take(frame: SkeletonFrame) -> None:
        nonlocal began
        began = frame.time if began is None else began
        if frame.time - began < seconds:
            keep(frame)

    return take


def _watch(stream: SkeletonStream, recorder: Recorder, warnings: list[str], seconds: float) -> None:
    """Let frames come for so long [s], or until the recorder fails, and say what it has to say."""
    ticker = Ticker(POLLS)
    began = time.perf_counter()
    over = False
    while not (stream.ended or over or recorder.fault):
        over = time.perf_counter() - began >= seconds
        with held():
            stream.poll()
        while warnings and not recorder.fault:
            warn(warnings.pop(0))
        ticker.wait()
