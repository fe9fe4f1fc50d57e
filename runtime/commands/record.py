"""`bunraku record`: a live stream goes to a file, without a character."""

from __future__ import annotations

import argparse
import math
import sys
import time

from devices.stream import SkeletonStream, open_stream
from replay.mcap_writer import McapWriter
from runtime.clock import Ticker
from runtime.interrupt import held
from runtime.output.whole_file import check_writable

POLLS = 240.0  # a second: twice the fastest sensor


def record(options: argparse.Namespace) -> int:
    """Write every frame that comes until Ctrl-C or `--seconds`."""
    check_writable(options.out)
    with open_stream(options.device) as stream:
        writer = McapWriter(options.out, stream.skeleton)
        try:
            _write_all(stream, writer, options.seconds or math.inf)
        finally:
            with held():
                writer.close()
            print(f"bunraku: {writer.frames} frames in {options.out}", file=sys.stderr)
    return 0


def _write_all(stream: SkeletonStream, writer: McapWriter, seconds: float) -> None:
    """Write what comes within `seconds` of the first frame; wait no longer than that for any."""
    ticker = Ticker(POLLS)
    began = time.monotonic()
    first: float | None = None
    over = False
    while not (stream.ended or over):
        over = time.monotonic() - began >= seconds
        with held():
            for frame in stream.poll():
                first = frame.time if first is None else first
                if frame.time - first < seconds:
                    writer.write(frame)
        ticker.wait()
