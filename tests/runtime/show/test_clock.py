"""Ticks at a steady rate, and what the stages of a tick take, on a clock of our own."""

from __future__ import annotations

import pytest

from runtime.show.clock import StageTimer, Ticker


class Clock:
    """A clock that goes on when it is told to, or slept by."""

    def __init__(self) -> None:
        self.now = 100.0
        self.slept: list[float] = []

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_ticks_come_at_the_rate_whatever_the_work_takes(clock: Clock) -> None:
    ticker = Ticker(50.0, clock=clock, sleep=clock.sleep)
    ticks = []
    for work in (0.0, 0.003, 0.019, 0.011, 0.0, 0.0):
        ticker.wait()
        ticks.append(clock.now)
        clock.now += work
    assert ticks == pytest.approx([100.0 + 0.02 * tick for tick in range(6)])


def test_the_first_tick_is_at_once(clock: Clock) -> None:
    Ticker(50.0, clock=clock, sleep=clock.sleep).wait()
    assert clock.slept == []


def test_a_tick_is_due_when_its_time_has_come(clock: Clock) -> None:
    ticker = Ticker(50.0, clock=clock, sleep=clock.sleep)
    ticker.wait()
    assert not ticker.is_due()
    clock.now += 0.019
    assert not ticker.is_due()
    clock.now += 0.002
    assert ticker.is_due()
    ticker.wait()
    assert not ticker.is_due()


def test_a_late_tick_comes_at_once_and_is_not_made_up_for(clock: Clock) -> None:
    ticker = Ticker(10.0, clock=clock, sleep=clock.sleep)
    ticker.wait()
    clock.now += 0.73
    ticker.wait()
    assert clock.slept == []
    for _ in range(3):
        ticker.wait()
    assert clock.slept == pytest.approx([0.1, 0.1, 0.1])


def test_a_sleep_that_lasts_too_long_does_not_add_up(clock: Clock) -> None:
    def oversleep(seconds: float) -> None:
        clock.sleep(seconds + 0.004)

    ticker = Ticker(10.0, clock=clock, sleep=oversleep)
    for _ in range(11):
        ticker.wait()
    assert clock.now == pytest.approx(101.004)


def test_stages_add_up_and_nest(clock: Clock) -> None:
    timer = StageTimer(clock)
    with timer.stage("frame"):
        for seconds in (0.25, 0.5):
            with timer.stage("deform"):
                clock.now += seconds
        with timer.stage("render"):
            clock.now += 1.0
    assert timer.stages == {"deform": 0.75, "render": 1.0, "frame": 1.75}


def test_a_stage_that_fails_is_counted_too(clock: Clock) -> None:
    timer = StageTimer(clock)

    def publish() -> None:
        with timer.stage("publish"):
            clock.now += 0.5
            raise OSError("disk")

    with pytest.raises(OSError, match="disk"):
        publish()
    assert timer.stages == {"publish": 0.5}


def test_a_new_tick_forgets_the_last_but_not_what_was_kept_of_it(clock: Clock) -> None:
    timer = StageTimer(clock)
    with timer.stage("poll"):
        clock.now += 0.5
    kept = timer.stages
    timer.reset()
    assert timer.stages == {}
    assert kept == {"poll": 0.5}
