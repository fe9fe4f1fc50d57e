"""A placement puts a character where it says, and as high above the floor as it says."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.driving.targets import Placement
from runtime.puppet.placement import put_on_stage

BODY = np.random.default_rng(0).normal(size=(40, 3))
ROOT = np.array([0.1, 0.9, 0.0])


@pytest.mark.parametrize("lift", [-3.0, 0.0, 5.0])
@pytest.mark.parametrize("clearance", [0.0, 0.4])
def test_a_clearance_puts_the_lowest_vertex_there_whatever_the_lift(
    lift: float, clearance: float
) -> None:
    out = np.empty_like(BODY)
    placement = Placement(0.3, (1.0, -2.0), lift, clearance)
    stance = put_on_stage(BODY, placement, ROOT, out)
    assert out[:, 1].min() == pytest.approx(clearance, abs=1e-14)
    np.testing.assert_allclose(stance.place(BODY), out, atol=1e-12)


def test_without_a_clearance_the_lift_or_the_floor_raises_it() -> None:
    out = np.empty_like(BODY)
    assert put_on_stage(BODY, Placement(lift=9.0), ROOT, out).shift[1] == 9.0
    assert put_on_stage(BODY, Placement(lift=0.0), ROOT, out).shift[1] == -BODY[:, 1].min()
