"""The latency benchmark measures what it says: real packets, each stamp after the last."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from runtime.benchmarks.latency import WAYS, measured
from runtime.cli import main


@pytest.mark.parametrize("way", WAYS)
def test_stamps_follow_one_another(context: moderngl.Context, way: str) -> None:
    rate, seconds = 30.0, 0.5
    times = measured(context, way, rate, drawn=True, seconds=seconds)
    assert 0 < len(times.came) <= rate * seconds
    assert len(times.came) + times.lost == pytest.approx(rate * seconds, abs=1)
    assert (times.sent <= times.came).all()
    assert (times.came < times.uploaded).all()
    assert (times.uploaded < times.drawn).all()
    for stamps in (times.sent, times.came, times.uploaded, times.drawn):
        assert (np.diff(stamps) > 0.0).all()


def test_load_is_for_latency(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "match", "--load"]) == 2
    assert "--load is for `bunraku bench latency`" in capsys.readouterr().err
    assert main(["bench", "latency", "--real-time"]) == 2
    assert "--real-time is for `bunraku bench soak`" in capsys.readouterr().err
