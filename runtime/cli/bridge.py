"""`bunraku bridge`: the performer before this machine's device drives shows on others."""

from __future__ import annotations

import argparse
import math
import sys
import time
from contextlib import suppress
from pathlib import Path

from tqdm import tqdm

from devices.bridge.keys import PUBLISHER, SUBSCRIBER, make_keys
from devices.errors import InputError
from devices.skeleton import Skeleton
from devices.stream import SkeletonStream, open_stream
from replay.recorded_stream import RecordedStream
from runtime.output.live.bridge_publisher import BoundEndpoint, BridgePublisher, binding
from runtime.show.clock import Ticker
from runtime.show.interrupt import held

POLLS = 240.0  # a second: twice the fastest sensor; what has a thread of its own does not wait


def bridge(options: argparse.Namespace) -> int:
    """Send every frame that comes until Ctrl-C or `--seconds`; or make keys and end.

    Raises:
        InputError: the device cannot be opened, or the address not be bound or not be guarded.
    """
    if options.make_keys is not None:
        return _make_keys(options.make_keys)
    if options.device is None:
        raise InputError("a bridge needs --device URL, as `bunraku devices` lists them")
    with open_stream(options.device) as stream:
        where = binding(options.bind, options.keys, option=f"--keys DIR/{PUBLISHER}")
        publisher = open_publisher(where, stream.skeleton)
        try:
            _carry(stream, publisher, options.seconds or math.inf)
        finally:
            with held():
                publisher.close()
            audience, lost = publisher.audience, publisher.lost
            said = f"{audience.frames} frames came, {audience.sent} went to stages"
            say(said + (f", {lost} lost" if lost else ""))
    return 0


def open_publisher(where: BoundEndpoint, skeleton: Skeleton) -> BridgePublisher:
    """A publisher that tells the operator where it is, and who comes and goes.

    Raises:
        InputError: the address cannot be bound.
    """
    publisher = BridgePublisher(where, skeleton, tell=say)
    say(f"sending to whoever opens zmq+{publisher.endpoint}")
    return publisher


def say(line: str) -> None:
    """One line to the operator, from any thread, without tearing a progress bar."""
    with suppress(OSError, ValueError):
        tqdm.write(f"bunraku: {line}", file=sys.stderr)
        sys.stderr.flush()


def _carry(stream: SkeletonStream, publisher: BridgePublisher, seconds: float) -> None:
    ticker = Ticker(POLLS)
    over = time.perf_counter() + seconds
    carried = RecordedStream(stream, publisher.write)
    while not stream.ended and time.perf_counter() < over:
        with held():
            carried.poll()
        ticker.wait()
    carried.keep = None


def _make_keys(folder: Path) -> int:
    make_keys(folder)
    print(
        f"{folder / PUBLISHER}: for the machine of the device: "
        f"bunraku bridge --keys {PUBLISHER} ..."
    )
    print(
        f"{folder / SUBSCRIBER}: copy it to the machine of the show: "
        f"zmq+tcp://HOST:PORT?keys={SUBSCRIBER}"
    )
    return 0
