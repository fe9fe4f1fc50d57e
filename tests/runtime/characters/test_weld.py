"""Welding: which vertices become one, and their weights."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from runtime.characters.weld import first_occurrences, weld, welded_weights
from tests.thorough import examples


def test_welding_joins_seams_and_keeps_first_appearances() -> None:
    points = np.array([[5.0, 0, 0], [0, 0, 0], [5, 0, 2e-8], [-0.0, 0, 0], [1, 1, 1]])
    groups = weld(points)
    np.testing.assert_array_equal(groups, [0, 1, 0, 1, 2])
    np.testing.assert_array_equal(first_occurrences(groups), [0, 1, 4])


def test_welding_keeps_fine_detail_apart() -> None:
    points = np.array([[0.0, 0, 0], [1e-5, 0, 0], [1, 0, 0]])
    assert len(np.unique(weld(points))) == 3


@given(st.integers(0, 2**32 - 1), st.floats(-6, 6))
@settings(max_examples=examples(30), deadline=None)
def test_welding_undoes_splitting_at_any_scale_and_order(seed: int, exponent: float) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(40, 3)) * 10.0**exponent
    copies = random.integers(0, 40, size=150)
    groups = weld(points[copies])
    np.testing.assert_array_equal(
        groups[:, None] == groups[None, :], copies[:, None] == copies[None, :]
    )
    assert (np.diff(first_occurrences(groups)) > 0).all()


def test_weights_of_welded_vertices_are_the_mean_of_theirs() -> None:
    weights = csr_array([[1.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.5, 0.5, 0.0]])
    welded = welded_weights(weights, np.array([0, 1, 0]))
    np.testing.assert_allclose(welded.toarray(), [[0.75, 0.25, 0.0], [0.0, 0.5, 0.5]])


def test_many_vertices_in_one_spot_far_from_another_stay_cheap() -> None:
    points = np.vstack([np.random.default_rng(0).normal(size=(20000, 3)), [[1e12, 0, 0]]])
    assert weld(points).max() >= 1
