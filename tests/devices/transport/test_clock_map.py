"""Device clocks on the host's: no jitter in, drift followed, jumps and restarts survived."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.transport.clock_map import FARTHEST, ClockMap


def mapped(devices: np.ndarray, arrivals: np.ndarray) -> tuple[np.ndarray, ClockMap]:
    clock = ClockMap()
    times = [clock.host_time(d, a) for d, a in zip(devices, arrivals, strict=True)]
    return np.array(times), clock


def test_the_jitter_of_the_network_is_taken_out() -> None:
    sent = np.arange(0, 20, 1 / 60)
    delays = 0.002 + np.random.default_rng(0).exponential(0.01, len(sent))
    times, clock = mapped(sent - 500.0, 1000.0 + sent + delays)
    settled = sent > 1.0
    assert np.abs(np.diff(times[settled]) - 1 / 60).max() < 0.002
    assert np.std(np.diff(1000.0 + sent + delays)) > 0.01
    assert clock.jumps == 0


def test_a_clock_that_runs_fast_or_slow_is_followed() -> None:
    sent = np.arange(0, 600, 0.1)
    for rate in (1.0005, 0.9995):
        times, clock = mapped(sent * rate, 50.0 + sent)
        assert (50.0 + sent - times).max() < 0.01
        assert clock.jumps == 0


@pytest.mark.parametrize("step", [-100.0, -0.3, 3.0, 1e6])
def test_a_clock_that_is_set_starts_anew_at_once(step: float) -> None:
    sent = np.arange(0, 4, 1 / 60)
    devices = sent + np.where(sent > 2.0, step, 0.0)
    times, clock = mapped(devices, 10.0 + sent)
    assert clock.jumps == 1
    assert np.abs(10.0 + sent - times).max() < 1e-6


def test_a_pause_of_the_device_clock_does_not_leave_the_show_behind() -> None:
    sent = np.concatenate([np.arange(0, 2, 0.1), np.arange(7, 9, 0.1)])
    devices = np.where(sent > 5, sent - 5, sent)
    times, _ = mapped(devices, sent)
    assert (sent - times).max() <= FARTHEST


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(allow_nan=True, allow_infinity=True), st.floats(0.0, 5.0)), max_size=40
    )
)
def test_times_neither_fall_nor_pass_their_arrival(steps: list[tuple[float, float]]) -> None:
    clock, arrival, last = ClockMap(), 1000.0, -math.inf
    for device, step in steps:
        arrival += step
        time = clock.host_time(device, arrival)
        assert last <= time <= arrival
        last = time
