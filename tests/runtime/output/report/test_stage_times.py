"""The times of a tick's stages: medians, percentiles and maxima."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from runtime.output.report.stage_times import STAGES, StageTimes


def test_percentiles_are_in_milliseconds() -> None:
    times = StageTimes()
    samples = np.random.default_rng(0).permutation(np.arange(1, 1001)) / 1e6  # 1 to 1000 us
    for seconds in samples:
        times.add("match", float(seconds))
    summary = times.summary()
    assert tuple(summary) == STAGES
    assert summary["match"] == pytest.approx({"p50": 0.5, "p99": 0.99, "max": 1.0}, rel=0.005)
    assert summary["match"]["max"] == 1.0


def test_a_block_is_measured_once_and_not_when_it_fails() -> None:
    times = StageTimes()
    with times.measure("render"):
        pass
    assert 0 < times.summary()["render"]["max"] < 1000

    def failing() -> None:
        with times.measure("frame"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        failing()
    assert times.summary()["frame"]["max"] == 0.0


def test_an_unknown_stage_is_an_error() -> None:
    with pytest.raises(KeyError):
        StageTimes().add("lunch", 1.0)


def test_an_hour_takes_no_more_memory_than_a_minute() -> None:
    times = StageTimes()
    before = None
    tracemalloc.start()
    for number in range(4_000):
        for stage in STAGES:
            times.add(stage, 1e-3 * (1 + number % 100))
        if number == 500:
            before = tracemalloc.get_traced_memory()[0]
    after = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert before is not None
    assert after - before < 4096


@pytest.mark.parametrize("seconds", [0.0, 1e-12, 5e-8, 1e-3, 3.0, 86_400.0, 1e12])
def test_any_time_is_counted(seconds: float) -> None:
    times = StageTimes()
    times.add("poll", seconds)
    assert times.summary()["poll"] == pytest.approx(
        dict.fromkeys(("p50", "p99", "max"), 1e3 * seconds), rel=1.0 if seconds > 1e3 else 0.005
    )
