"""A bridge on loopback, what its operator is told, and frames taken from its other end."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import zmq

from devices.bridge.stream import BridgeStream
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.output.live.bridge_publisher import BridgePublisher, binding
from tests.waiting import PATIENCE

ROOT = Path(__file__).resolve().parents[3]
BODY = Skeleton(("hips", "hand"), np.array([-1, 0]), np.array([[0.0, 1.0, 0.0], [0.5, 1.0, 0.0]]))
ANYWHERE = "tcp://127.0.0.1:*"
posix_only = pytest.mark.skipif(os.name != "posix", reason="permissions and signals as POSIX has")


def frame(number: int, performer: int = 0, time: float = 0.0) -> SkeletonFrame:
    place = np.array([[number, 0.0, 0.0], [number, 1.0, 0.0]])
    return SkeletonFrame(time, place, None, np.ones(2), performer)


def numbers(frames: list[SkeletonFrame]) -> list[int]:
    return [int(one.positions[0, 0]) for one in frames]


class Told:
    """What the operator of a bridge is told, and a way to wait for it."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._more = threading.Condition()

    def __call__(self, line: str) -> None:
        with self._more:
            self.lines.append(line)
            self._more.notify_all()

    def wait_for(self, words: str) -> None:
        with self._more:
            assert self._more.wait_for(lambda: any(words in one for one in self.lines), PATIENCE), (
                words
            )


@contextmanager
def bridge(
    bind: str = ANYWHERE,
    *,
    keys: Path | None = None,
    told: Told | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> Iterator[BridgePublisher]:
    where = binding(bind, keys, option="--keys DIR")
    with BridgePublisher(where, BODY, report=told or Told(), clock=clock) as publisher:
        yield publisher


def take(stream: BridgeStream, enough: Callable[[list[SkeletonFrame]], bool]) -> list:
    """Frames of a stream until they are enough."""
    frames: list[SkeletonFrame] = []
    deadline = time.monotonic() + PATIENCE
    while not enough(frames):
        assert time.monotonic() < deadline, f"only {len(frames)} frames came: {stream.traffic}"
        stream.wait(0.05)
        frames += stream.poll()
    return frames


def take_until(stream: BridgeStream, last: int) -> list[SkeletonFrame]:
    return take(stream, lambda frames: bool(frames) and numbers(frames)[-1] >= last)


def publish_until_heard(publisher: BridgePublisher, stream: BridgeStream) -> list[SkeletonFrame]:
    """Frames written one by one until one comes out of the other end."""
    deadline = time.monotonic() + PATIENCE
    number = 0
    while time.monotonic() < deadline:
        number += 1
        publisher.write(frame(number, time=time.monotonic()))
        if stream.wait(0.02):
            return list(stream.poll())
    raise AssertionError(f"nothing came: {stream.traffic}")


@contextmanager
def raw(kind: int, endpoint: str | None = None) -> Iterator[tuple[zmq.Socket, str]]:
    """A plain ZeroMQ socket, as any other program has one."""
    with zmq.Context() as context, context.socket(kind) as socket:
        socket.linger = 0
        if endpoint is None:
            endpoint = f"tcp://127.0.0.1:{socket.bind_to_random_port('tcp://127.0.0.1')}"
        else:
            socket.connect(endpoint)
        yield socket, endpoint
