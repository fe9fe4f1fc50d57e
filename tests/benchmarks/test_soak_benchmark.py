"""The soak counts every frame that came and every frame that the file gives back."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from devices.builtin.gestures import RATE
from devices.builtin.simulator import BACKLOG_SECONDS
from runtime.benchmarks.soak import PERFORMERS, TICKS_A_SAMPLE, Soak, Steps, Tempo, soaked

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="resident memory is measured on Linux only"
)


def assert_measured(soak: Soak, ticks: int) -> None:
    assert soak.kept == soak.sent
    assert soak.ticks.shape == soak.work.shape == soak.stolen.shape == (ticks,)
    assert (soak.stolen >= 0.0).all()
    assert (soak.work > 0.0).all()
    assert (soak.work <= 1.01 * soak.ticks + 1e-4).all()
    assert len(soak.memory) == (ticks - 1) // TICKS_A_SAMPLE + 1
    assert np.isfinite(soak.growth)


def test_what_came_is_kept(tmp_path: Path) -> None:
    soak = soaked(tmp_path / "a.mcap", 1.5, Tempo.accelerated())
    assert soak.sent == 90 * PERFORMERS
    assert_measured(soak, 90)


@pytest.mark.parametrize(("step", "ticks"), [(0.4, 4), (2.0, 1), (30.0, 1)])
def test_what_came_is_kept_however_long_a_tick_takes(
    tmp_path: Path, step: float, ticks: int
) -> None:
    slow = Steps(step)
    soak = soaked(tmp_path / "a.mcap", 1.5, Tempo(slow, slow, waits_for_disk=True))
    assert soak.sent == (int((ticks - 1) * step * RATE + 1e-6) + 1) * PERFORMERS
    assert_measured(soak, ticks)


def test_what_came_in_real_time_is_kept(tmp_path: Path) -> None:
    soak = soaked(tmp_path / "a.mcap", 0.2, Tempo.real())
    assert soak.sent >= PERFORMERS
    assert_measured(soak, len(soak.ticks))


def test_the_last_poll_may_be_late(tmp_path: Path) -> None:
    """A minute after the first, within a tick that began in time: the last second's frames come."""
    times = iter([0.0, 0.0, 0.0, 0.05])
    late = Tempo(lambda: next(times, 60.0), Steps(1.0), waits_for_disk=True)
    soak = soaked(tmp_path / "a.mcap", 0.1, late)
    assert soak.kept == soak.sent == (1 + RATE * BACKLOG_SECONDS) * PERFORMERS


def test_a_long_tick_is_the_hosts_when_it_took_cores_then_or_it_is_counted_just_after() -> None:
    soak = Soak(
        sent=0,
        kept=0,
        ticks=np.array([0.06, 0.01, 0.07, 0.02, 0.08, 0.09], np.float32),
        work=np.full(6, 0.01, np.float32),
        stolen=np.array([0.0, 0.0, 0.01, 0.0, 0.0, 0.03], np.float32),
        memory=np.ones(1),
    )
    assert soak.slow.tolist() == [True, False, True, False, True, True]
    assert soak.stalled.tolist() == [False, False, True, False, True, True]
