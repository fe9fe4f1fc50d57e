"""Restored filters return the same bytes as after the snapshot, whatever they did since."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from solvers.signal.floor_plane import FloorFit
from solvers.signal.one_euro import OneEuroFilter
from solvers.signal.prediction import Predictor
from solvers.signal.springs import Springs
from tests.thorough import examples

Sample = tuple[np.ndarray, float]

samples = st.lists(
    st.tuples(
        arrays(np.float64, (4, 3), elements=st.floats(-10.0, 10.0)),
        st.sampled_from([0.0, 1 / 60, 1 / 30, 0.5]),
    ),
    max_size=6,
)


def floor(fit: FloorFit, points: np.ndarray, dt: float) -> np.ndarray:
    fit.add(points, dt)
    return np.array(fit.plane())


@pytest.mark.parametrize(
    ("make", "step"),
    [
        (OneEuroFilter, OneEuroFilter.filter),
        (Predictor, Predictor.predict),
        (FloorFit, floor),
        (
            lambda: Springs(np.zeros(4), frequency=2.0, damping=0.5),
            lambda springs, points, dt: springs.step(points[:, 0], dt).copy(),
        ),
    ],
    ids=["one_euro", "prediction", "floor_plane", "springs"],
)
@settings(deadline=None, max_examples=examples(50))
@given(before=samples, after=samples, between=samples)
def test_going_on_from_a_snapshot_gives_the_same_bytes(
    make: Callable[[], Any],
    step: Callable[[Any, np.ndarray, float], np.ndarray],
    before: list[Sample],
    after: list[Sample],
    between: list[Sample],
) -> None:
    ours, other = make(), make()
    for sample in before:
        step(ours, *sample)
    state = ours.snapshot()
    expected = [step(ours, *sample).tobytes() for sample in after]
    for sample in between:
        step(ours, *sample)
    for restored in (ours, other, other):
        restored.restore(state)
        assert [step(restored, *sample).tobytes() for sample in after] == expected
