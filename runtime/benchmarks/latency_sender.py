"""The other process of `bunraku bench latency`: it sends a performer's frames at an exact rate.

It prints a line when it is ready: the address that it publishes at, or "ready". It begins after one
line on its input and stays until the input is closed. Each frame carries the host monotonic time
of its sending.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack

import numpy as np

from devices.builtin.gestures import RATE, MotionClip
from devices.builtin.motions import motion_clip
from devices.skeleton import SkeletonFrame
from runtime.driving.performer import Performer
from runtime.output.live.bridge_publisher import BridgePublisher, binding
from runtime.output.live.vmc_performer import VmcPerformer
from runtime.output.output import PerformedFrame
from runtime.show.clock import Ticker

ACT = "walk"
_NOTHING = np.zeros((0, 3))

Send = Callable[[SkeletonFrame], None]


def main(arguments: list[str]) -> None:
    """Send COUNT frames at RATE a second by WAY: ``zmq``, or ``vmc`` to PORT."""
    way, rate, count = arguments[0], float(arguments[1]), int(arguments[2])
    played = motion_clip(ACT)
    with ExitStack() as closing:
        send = (
            _by_bridge(played, closing)
            if way == "zmq"
            else _by_vmc(played, int(arguments[3]), closing)
        )
        sys.stdin.readline()
        _send_all(played, send, rate, count)
        sys.stdin.read()


def _send_all(played: MotionClip, send: Send, rate: float, count: int) -> None:
    """Send `count` frames; the performance has the same speed at every rate."""
    ticker = Ticker(rate)
    for number in range(count):
        ticker.wait()
        at = round(number * RATE / rate) % len(played.times)
        send(
            SkeletonFrame(
                time=time.perf_counter(),
                positions=played.positions[at],
                rotations=played.rotations[at],
                confidence=np.ones(len(played.skeleton.names)),
            )
        )


def _by_bridge(played: MotionClip, closing: ExitStack) -> Send:
    where = binding("tcp://127.0.0.1:*", None, option="keys")
    publisher = BridgePublisher(where, played.skeleton, report=lambda _: None)
    closing.enter_context(publisher)
    print(publisher.endpoint, flush=True)
    return publisher.write


def _by_vmc(played: MotionClip, port: int, closing: ExitStack) -> Send:
    performer = Performer(played.skeleton)
    sender = closing.enter_context(VmcPerformer(played.skeleton, "127.0.0.1", port))
    print("ready", flush=True)

    def send(frame: SkeletonFrame) -> None:
        pose = performer.follow(frame)
        sender.write(PerformedFrame(0, frame.time, _NOTHING, None, (pose,)))

    return send


if __name__ == "__main__":
    main(sys.argv[1:])
