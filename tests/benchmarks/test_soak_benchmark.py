"""The soak counts what it says: every frame that came, and which of them the file gives back."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from runtime.benchmarks.soak import PERFORMERS, Soak, soaked

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="resident memory is measured on Linux only"
)


@pytest.mark.parametrize("real_time", [False, True])
def test_what_came_is_kept(tmp_path: Path, real_time: bool) -> None:
    soak = soaked(tmp_path / "a.mcap", 1.5, real_time=real_time)
    assert soak.kept == soak.sent
    assert soak.sent == pytest.approx(90 * PERFORMERS, abs=8 * PERFORMERS)
    assert soak.ticks.shape == soak.work.shape == soak.stolen.shape == (90,)
    assert (soak.stolen >= 0.0).all()
    assert (soak.work > 0.0).all()
    assert (soak.work <= 1.01 * soak.ticks + 1e-4).all()
    assert len(soak.memory) == 2
    assert np.isfinite(soak.growth)


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
