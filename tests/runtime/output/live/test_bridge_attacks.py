"""Subscribers that mean harm, on loopback: the memory stays, and the honest stage is served."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import zmq

from devices.bridge.messages import LATEST, LOSSLESS, MAX_CREDIT, Call, encode_call
from devices.builtin.body import builtin_skeleton
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from runtime.output.live.bridge_publisher import BridgePublisher, binding
from tests.waiting import until

BODY = builtin_skeleton()
PAGE = 4096  # [bytes]
MOST = 20e6  # [bytes]


def resident() -> int:
    """Bytes of memory that this process has."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def frame() -> SkeletonFrame:
    count = len(BODY.names)
    return SkeletonFrame(time.perf_counter(), np.zeros((count, 3)), None, np.ones(count))


@contextmanager
def bridge() -> Iterator[BridgePublisher]:
    where = binding("tcp://127.0.0.1:0", None, option="--publish-keys DIR")
    with BridgePublisher(where, BODY, report=lambda _: None) as opened:
        yield opened


@contextmanager
def deaf(publisher: BridgePublisher) -> Iterator[zmq.Socket[bytes]]:
    """A connection that sends calls and reads nothing."""
    with zmq.Context() as context, context.socket(zmq.DEALER) as socket:
        socket.rcvhwm, socket.rcvbuf, socket.linger = 1, 4096, 0
        socket.connect(publisher.endpoint)
        yield socket


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_subscriber_that_never_reads_takes_no_memory_and_no_frames_of_others() -> None:
    with (
        bridge() as publisher,
        deaf(publisher) as socket,
        open_stream(f"zmq+{publisher.endpoint}") as honest,
    ):
        before, served, numbers = resident(), 0, itertools.count()

        def is_served_beside_it() -> bool:
            nonlocal served
            for _ in range(50):
                number = next(numbers)
                socket.send(encode_call(Call(99, 0, number, 0.0, MAX_CREDIT, LOSSLESS)))
                publisher.write(frame())
            served += len(honest.poll())
            return served >= 20 and number >= 20_000

        until(is_served_beside_it)
        assert resident() - before < MOST


def test_forty_invented_subscribers_do_not_shut_out_an_honest_stage() -> None:
    with bridge() as publisher, deaf(publisher) as socket:
        for client in range(1, 41):
            socket.send(encode_call(Call(client, 0, 0, 0.0, 16, LATEST)))
        until(lambda: publisher.subscribers.count > 0)
        with open_stream(f"zmq+{publisher.endpoint}") as honest:

            def is_served() -> bool:
                publisher.write(frame())
                return len(honest.poll()) > 0

            until(is_served)
