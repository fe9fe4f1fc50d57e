"""The other machine's clock is estimated within the bound that is possible."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.bridge.clock_offset import DRIFT, SAMPLES, ClockOffset


def exchange(
    clock: ClockOffset, now: float, offset: float, *, there: float, back: float, think: float = 0.0
) -> float:
    """One exchange over ways of so many seconds; returns when it ended."""
    heard = now + there + offset
    end = now + there + think + back
    assert clock.add(now, heard, heard + think, end)
    return end


def test_even_ways_give_the_offset_exactly() -> None:
    clock = ClockOffset()
    assert not clock.known
    exchange(clock, 100.0, offset=-5.5, there=0.003, back=0.003, think=0.4)
    assert clock.seconds == pytest.approx(-5.5, abs=1e-9)
    assert clock.bound == pytest.approx(0.003, abs=1e-9)


def test_there_is_no_offset_before_an_exchange() -> None:
    with pytest.raises(ValueError, match="before `seconds`"):
        _ = ClockOffset().seconds


@given(
    st.floats(-1e6, 1e6),
    st.lists(st.tuples(st.floats(0.0, 0.5), st.floats(0.0, 0.5)), min_size=1, max_size=30),
)
def test_however_uneven_the_ways_the_bound_holds(
    offset: float, ways: list[tuple[float, float]]
) -> None:
    clock, now = ClockOffset(), 50.0
    for there, back in ways:
        now = exchange(clock, now, offset, there=there, back=back) + 0.1
        assert abs(clock.seconds - offset) <= clock.bound + 1e-6
    best = min(there + back for there, back in ways)
    assert clock.bound <= best + DRIFT * (now - 50.0) + 1e-5


def test_the_shortest_of_many_exchanges_counts() -> None:
    rng = np.random.default_rng(3)
    clock, now = ClockOffset(), 0.0
    for number in range(60):
        wait = 0.0001 if number == 20 else 0.001 + rng.exponential(0.02)
        now = exchange(clock, now, 3.0, there=0.0002 + wait, back=0.0002) + 0.25
    assert clock.seconds == pytest.approx(3.0, abs=0.002)


def test_clocks_that_drift_apart_are_followed() -> None:
    """40 parts in a million for ten minutes: 24 ms in all."""
    clock, now = ClockOffset(), 0.0
    for _ in range(2400):
        offset = 7.0 + 40e-6 * now
        now = exchange(clock, now, offset, there=0.001, back=0.001) + 0.25
        assert abs(clock.seconds - offset) <= clock.bound <= 0.0025
    assert clock.seconds == pytest.approx(7.024, abs=0.003)


def test_the_offset_stays_where_nothing_new_is_known() -> None:
    rng = np.random.default_rng(5)
    clock, now = ClockOffset(), 0.0
    now = exchange(clock, now, 1.0, there=0.0005, back=0.0005)
    first = clock.seconds
    for _ in range(SAMPLES // 2):
        there, back = rng.uniform(0.001, 0.1, 2)
        now = exchange(clock, now, 1.0, there=there, back=back)
    assert clock.seconds == first


def test_a_clock_that_was_set_is_taken_over_at_once() -> None:
    clock, now = ClockOffset(), 0.0
    for _ in range(10):
        now = exchange(clock, now, 0.0, there=0.001, back=0.001)
    exchange(clock, now, 3600.0, there=0.02, back=0.02)
    assert clock.seconds == pytest.approx(3600.0, abs=1e-6)
    assert clock.bound == pytest.approx(0.02)


@pytest.mark.parametrize(
    "times",
    [
        (10.0, 5.0, 5.0, 9.0),  # heard back before asking
        (10.0, 5.0, 4.0, 11.0),  # answered before it heard
        (10.0, 5.0, 8.0, 11.0),  # thought longer than we waited
        (10.0, float("nan"), 5.0, 11.0),
    ],
)
def test_times_that_make_no_sense_are_left_out(times: tuple[float, float, float, float]) -> None:
    clock = ClockOffset()
    assert not clock.add(*times)
    assert not clock.known
