from __future__ import annotations

import numpy as np
import pytest

from runtime.output.stage_times import STAGES, StageTimes


def test_percentiles_are_in_milliseconds() -> None:
    times = StageTimes()
    samples = np.random.default_rng(0).permutation(np.arange(1, 1001)) / 1e6  # 1 to 1000 us
    for seconds in samples:
        times.add("match", float(seconds))
    summary = times.summary()
    assert tuple(summary) == STAGES
    assert summary["match"] == pytest.approx({"p50": 0.5005, "p99": 0.99001, "max": 1.0}, rel=1e-5)


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
