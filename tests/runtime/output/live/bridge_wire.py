"""A stage and a bridge that are joined by hand, without sockets, threads or a real clock."""

from __future__ import annotations

import numpy as np

from devices.bridge.receiver import BridgeReceiver
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.output.live.bridge_subscribers import BridgeSubscribers

BODY = Skeleton(("hips", "hand"), np.array([-1, 0]), np.array([[0.0, 1.0, 0.0], [0.5, 1.0, 0.0]]))


def frame(number: int, performer: int = 0, time: float | None = None) -> SkeletonFrame:
    place = np.array([[number, 0.0, 0.0], [number, 1.0, 0.0]])
    at = number / 60.0 if time is None else time
    return SkeletonFrame(at, place, None, np.ones(2), performer)


def number_of(heard: SkeletonFrame) -> int:
    return int(heard.positions[0, 0])


class Wire:
    """A stage, a bridge, and a way between them that takes its time and can be cut.

    The bridge's clock is `offset` ahead of the stage's.
    """

    def __init__(
        self, mode: int, *, offset: float = 0.0, there: float = 0.0, back: float = 0.0
    ) -> None:
        self.now = 1000.0  # on the stage
        self.offset, self.there, self.back = offset, there, back
        self.subscribers = self.new_bridge()
        self.receiver = BridgeReceiver(mode)
        self.route = b"one"
        self.under_way: list[bytes] = []  # to the stage
        self.heard: list[SkeletonFrame] = []

    def new_bridge(self) -> BridgeSubscribers:
        self.subscribers = BridgeSubscribers(BODY, lambda: self.now + self.offset)
        return self.subscribers

    def call(self, waiting: int = 0) -> None:
        data = self.receiver.call(self.now, waiting)
        self.now += self.there
        self.under_way += self.subscribers.read(self.route, data)
        self.load()

    def load(self) -> None:
        self.under_way += [data for _, data in self.subscribers.due()]

    def deliver(self) -> list[SkeletonFrame]:
        self.now += self.back
        came = [one for data in self.under_way for one in self.receiver.feed(data, self.now)]
        self.under_way = []
        self.heard += came
        return came

    def exchange(self) -> list[SkeletonFrame]:
        self.call()
        return self.deliver()
