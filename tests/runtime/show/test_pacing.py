"""When ticks come, by a clock that the test holds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from devices.bridge.frame_queues import LatestFrames
from devices.builtin.simulator import Simulator
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.transport.inbox import Inbox
from runtime.show.clock import Ticker
from runtime.show.pacing import LULL, MOST_TICKS, TICKS, AtOnce, OnArrival, Pace, SpareTime, pace_of


class Arrivals:
    """A clock, and a stream on it whose frames come at known times."""

    def __init__(self, *times: float) -> None:
        self.now = 0.0
        self._times = list(times)

    def clock(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    def wait(self, seconds: float) -> bool:
        due = [time for time in self._times if time <= self.now + seconds]
        self.now = max(self.now, min(due, default=self.now + seconds))
        return bool(due)

    def poll(self) -> int:
        came = [time for time in self._times if time <= self.now]
        self._times = [time for time in self._times if time > self.now]
        return len(came)


def ticks(arrivals: Arrivals, count: int) -> list[tuple[float, int]]:
    """When each tick began, and how many frames it found."""
    pace = OnArrival(arrivals, clock=arrivals.clock, sleep=arrivals.sleep)
    found = []
    for _ in range(count):
        pace.wait()
        found.append((arrivals.now, arrivals.poll()))
    return found


def test_a_frame_is_performed_the_moment_it_comes() -> None:
    came = [0.0131, 0.0297, 0.0464, 0.0633]
    assert ticks(Arrivals(*came), 4) == [(pytest.approx(time), 1) for time in came]


def test_whoever_looks_is_served_when_nothing_comes() -> None:
    found = ticks(Arrivals(), 5)
    np.testing.assert_allclose([time for time, _ in found], np.arange(1, 6) / TICKS)
    found = ticks(Arrivals(0.01, 0.095), 5)
    lull = 0.01 + LULL + np.arange(3) / TICKS
    np.testing.assert_allclose([time for time, _ in found], [0.01, *lull, 0.095])
    assert [frames for _, frames in found] == [1, 0, 0, 0, 1]


def test_a_burst_is_taken_together_and_a_flood_in_steps() -> None:
    first, second, third = ticks(Arrivals(0.010, 0.0101, 0.0102, 0.0103), 3)
    assert first == (0.010, 1)
    assert second == (pytest.approx(0.010 + 1.0 / MOST_TICKS), 3)
    assert third[1] == 0
    flood = ticks(Arrivals(*np.arange(0.0, 0.1, 1e-4)), 20)
    np.testing.assert_allclose(np.diff([time for time, _ in flood]), 1.0 / MOST_TICKS)


class Surfaces:
    """Notes what is asked of them."""

    def __init__(self) -> None:
        self.settled: list[bool] = []

    def settle(self) -> None:
        self.settled.append(True)

    def hurry(self) -> None:
        self.settled.append(False)


def settled(pace: Pace, arrivals: Arrivals, *work: float) -> list[bool]:
    """After which ticks surfaces settled that were given these times [s] to be shown."""
    surfaces = Surfaces()
    spare = SpareTime(pace, surfaces)
    for seconds in work:
        pace.wait()
        arrivals.sleep(seconds)
        spare.spend()
    return surfaces.settled


def test_surfaces_are_left_unsettled_once_where_a_tick_is_late() -> None:
    arrivals = Arrivals()
    ticker = Ticker(TICKS, clock=arrivals.clock, sleep=arrivals.sleep)
    work = 0.01, 0.01, 0.02, 0.02, 0.02, 0.02, 0.01, 0.02
    expected = [True, True, False, True, False, True, True, False]
    assert settled(ticker, arrivals, *work) == expected


def test_surfaces_always_settle_where_nobody_waits() -> None:
    arrivals = Arrivals()
    assert settled(AtOnce(), arrivals, 0.01, 0.2, 0.2) == [True, True, True]
    assert arrivals.now == pytest.approx(0.41)


def test_a_tick_is_due_when_a_frame_waits() -> None:
    arrivals = Arrivals(0.01, 0.02)
    pace = OnArrival(arrivals, clock=arrivals.clock, sleep=arrivals.sleep)
    pace.wait()
    arrivals.poll()
    assert not pace.is_due()
    arrivals.sleep(0.009)
    assert not pace.is_due()
    arrivals.sleep(0.002)
    assert pace.is_due()


def test_what_can_be_waited_for_is_waited_for() -> None:
    with open_stream("vmc://127.0.0.1:0") as live, open_stream("sim://walk") as simulated:
        assert isinstance(pace_of(live), OnArrival)
        assert isinstance(simulated, Simulator)
        assert isinstance(pace_of(simulated), Ticker)


@pytest.mark.parametrize("make", [lambda: Inbox(2), LatestFrames])
def test_an_inbox_can_be_waited_for(make: Callable[[], Inbox | LatestFrames]) -> None:
    inbox = make()
    frame = SkeletonFrame(0.0, np.zeros((1, 3)), None, np.ones(1))
    inbox.put([])
    assert not inbox.wait(0.0)
    inbox.put([frame, frame, frame])
    assert inbox.wait(0.0)
    assert inbox.wait(0.0)  # until they are taken
    assert len(inbox.take()) == 3 - inbox.dropped
    assert not inbox.wait(0.0)
    inbox.put([frame])
    inbox.take()
    assert not inbox.wait(0.0)  # nor for what was taken without waiting
