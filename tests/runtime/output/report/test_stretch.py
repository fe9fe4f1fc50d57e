"""Edge stretch over a performance: means and percentiles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from runtime.output.report.stretch import StretchStatistic
from solvers.surface.edges import Edges
from tests.runtime.tentacle import make_show, make_tentacle

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
FACE = np.array([[0, 1, 2]])
EDGES = Edges.of(TRIANGLE, FACE)


def test_a_rigid_motion_stretches_nothing() -> None:
    character = make_tentacle()
    edges, statistic = Edges.of(character.vertices, character.faces), StretchStatistic()
    moved = Rotation.from_rotvec([0.3, 1, 2]).apply(character.vertices) + 5
    statistic.add(edges.stretch(moved))
    assert statistic.mean < 1e-12
    assert statistic.p99 == 0.0


@given(scale=st.floats(0.0, 9.0))
def test_a_scaling_stretches_all_alike(scale: float) -> None:
    statistic = StretchStatistic()
    statistic.add(EDGES.stretch(scale * TRIANGLE))
    assert statistic.mean == pytest.approx(abs(scale - 1), abs=1e-12)
    assert statistic.p99 == pytest.approx(abs(scale - 1), abs=1.01e-4)


def test_mean_and_p99_are_those_of_all_edges_of_all_frames() -> None:
    character = make_tentacle()
    found, statistic = Edges.of(character.vertices, character.faces), StretchStatistic()
    sides = np.sort(np.concatenate([character.faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]))
    edges = np.unique(sides, axis=0)
    stretches = []
    for frame in make_show(character, frames=20):
        statistic.add(found.stretch(frame.vertices))
        lengths = [
            np.linalg.norm(v[edges[:, 0]] - v[edges[:, 1]], axis=1)
            for v in (frame.vertices, character.vertices)
        ]
        stretches.append(np.abs(lengths[0] / lengths[1] - 1))
    everything = np.concatenate(stretches)
    assert statistic.mean == pytest.approx(everything.mean(), rel=1e-9)
    expected = np.percentile(everything, 99, method="inverted_cdf")
    assert statistic.p99 == pytest.approx(expected, abs=1e-4)


def test_what_tears_or_is_no_number_counts_as_ten() -> None:
    statistic = StretchStatistic()
    torn = TRIANGLE.copy()
    torn[2] = (np.nan, 0, 0)
    statistic.add(EDGES.stretch(torn))
    statistic.add(EDGES.stretch(1e30 * TRIANGLE))
    assert statistic.p99 == pytest.approx(10.0)
    assert statistic.mean == pytest.approx((2 + 3) * 10 / 6)


def test_edges_without_length_are_left_out() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]])
    statistic = StretchStatistic()
    moved = vertices + np.array([[0, 0, 0], [0, 0, 0], [0.5, 0, 0]])
    statistic.add(Edges.of(vertices, FACE).stretch(moved))
    assert statistic.mean == pytest.approx(0.25)


def test_no_faces_and_no_frames_give_zero() -> None:
    statistic = StretchStatistic()
    assert (statistic.mean, statistic.p99) == (0.0, 0.0)
    statistic.add(Edges.of(TRIANGLE, np.zeros((0, 3), np.int64)).stretch(TRIANGLE))
    assert (statistic.mean, statistic.p99) == (0.0, 0.0)
