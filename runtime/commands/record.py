"""`bunraku record`: a live stream goes to a file, without a character."""

from __future__ import annotations

import argparse
import sys

from devices.stream import open_stream
from replay.mcap_writer import McapWriter
from runtime.clock import Ticker

POLLS = 240.0  # a second: twice the fastest sensor


def record(options: argparse.Namespace) -> int:
    """Write every frame that comes until Ctrl-C or `--seconds`."""
    frames = 0
    with (
        open_stream(options.device) as stream,
        McapWriter(options.out, stream.skeleton) as writer,
    ):
        ticker = Ticker(POLLS)
        first: float | None = None
        try:
            while not stream.ended:
                for frame in stream.poll():
                    first = frame.time if first is None else first
                    if options.seconds and frame.time - first >= options.seconds:
                        return _told(frames, options)
                    writer.write(frame)
                    frames += 1
                ticker.wait()
        except KeyboardInterrupt:
            _told(frames, options)
            raise
    return _told(frames, options)


def _told(frames: int, options: argparse.Namespace) -> int:
    print(f"bunraku: {frames} frames in {options.out}", file=sys.stderr)
    return 0
