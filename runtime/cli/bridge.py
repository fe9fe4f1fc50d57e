"""`bunraku bridge`: sends the performer at this machine's device to shows on other machines."""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

from devices.errors import InputError
from runtime.cli.options.arguments import positive
from runtime.show.interrupts import interrupts_deferred

if TYPE_CHECKING:
    from devices.stream import SkeletonStream
    from runtime.output.live.bridge_publisher import BridgePublisher

HELP = "send a live performer to shows on other machines"
USAGE = """--device URL [--bind tcp://HOST:PORT] [--keys DIR] [--seconds N]
--make-keys DIR"""
POLLS = 240.0  # a second: twice the rate of the fastest sensor


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed, one of both")
    needed.add_argument("--device", metavar="URL", help="the device; `bunraku devices` lists them")
    needed.add_argument(
        "--make-keys", type=Path, metavar="DIR", help="write keys for both machines and exit"
    )
    sent = parser.add_argument_group("where the performer is sent, and how long")
    sent.add_argument(
        "--bind",
        default="tcp://127.0.0.1:5570",
        metavar="tcp://HOST:PORT",
        help="the address of the bridge; the --device of a show is zmq+tcp://HOST:PORT (default: "
        "%(default)s)",
    )
    sent.add_argument(
        "--keys",
        type=Path,
        metavar="DIR",
        help="the keys of this machine, which shows on other machines need (default: none)",
    )
    sent.add_argument(
        "--seconds", type=positive, metavar="N", help="stop after N seconds (default: at Ctrl-C)"
    )


def run(options: argparse.Namespace) -> int:
    """Send every frame that comes until Ctrl-C or `--seconds`; or make keys and end.

    Raises:
        InputError: the device cannot be opened, the address cannot be bound, or it has no keys.
    """
    from devices.bridge.keys import PUBLISHER
    from devices.stream import open_stream
    from runtime.output.live.bridge_publisher import binding
    from runtime.show.messages import say
    from runtime.show.outputs import open_publisher

    if options.make_keys is not None:
        return _make_keys(options.make_keys)
    if options.device is None:
        raise InputError("a bridge needs --device URL, as `bunraku devices` lists them")
    with open_stream(options.device) as stream:
        endpoint = binding(options.bind, options.keys, option=f"--keys DIR/{PUBLISHER}")
        publisher = open_publisher(endpoint, stream.skeleton)
        try:
            _carry(stream, publisher, options.seconds or math.inf)
        finally:
            with interrupts_deferred():
                publisher.close()
            subscribers, lost = publisher.subscribers, publisher.lost
            line = f"{subscribers.frames} frames received, {subscribers.sent} sent to subscribers"
            say(line + (f", {lost} lost" if lost else ""))
    return 0


def _carry(stream: SkeletonStream, publisher: BridgePublisher, seconds: float) -> None:
    """Give the publisher every frame for `seconds` [s]."""
    from replay.recorded_stream import RecordedStream
    from runtime.show.clock import Ticker

    ticker = Ticker(POLLS)
    over = time.perf_counter() + seconds
    carried = RecordedStream(stream, publisher.write)
    while not stream.ended and time.perf_counter() < over:
        with interrupts_deferred():
            carried.poll()
        ticker.wait()
    carried.keep = None


def _make_keys(folder: Path) -> int:
    from devices.bridge.keys import PUBLISHER, SUBSCRIBER, make_keys
    from devices.printable import printable

    make_keys(folder)
    print(
        f"{printable(str(folder / PUBLISHER))}: for the machine of the device: "
        f"bunraku bridge --keys {PUBLISHER} ..."
    )
    print(
        f"{printable(str(folder / SUBSCRIBER))}: copy it to the machine of the show: "
        f"zmq+tcp://HOST:PORT?keys={SUBSCRIBER}"
    )
    return 0
