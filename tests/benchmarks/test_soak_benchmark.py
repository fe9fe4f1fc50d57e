"""The soak counts what it says: every frame that came, and which of them the file gives back."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from runtime.benchmarks.soak import PERFORMERS, soaked

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="resident memory is measured on Linux only"
)


@pytest.mark.parametrize("real_time", [False, True])
def test_what_came_is_kept(tmp_path: Path, real_time: bool) -> None:
    soak = soaked(tmp_path / "a.mcap", 1.5, real_time=real_time)
    assert soak.kept == soak.sent
    assert soak.sent == pytest.approx(90 * PERFORMERS, abs=8 * PERFORMERS)
    assert soak.ticks.shape == soak.work.shape == (90,)
    assert (soak.work > 0.0).all()
    assert (soak.work <= 1.01 * soak.ticks + 1e-4).all()
    assert len(soak.memory) == 2
    assert np.isfinite(soak.growth)
