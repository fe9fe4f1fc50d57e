"""Detections are matched to known bodies by the least sum of distances."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.signal.association import KNOWN_NAME_BONUS, NEW_COST, associate
from tests.thorough import examples


def test_nobody_is_somebody_new() -> None:
    none = np.zeros((2, 0), dtype=bool)
    assert associate(np.zeros((2, 0)), none, none).tolist() == [-1, -1]
    assert associate(np.zeros((0, 3)), *(np.zeros((0, 3), dtype=bool),) * 2).tolist() == []


def test_the_sum_decides_and_not_who_is_asked_first() -> None:
    near = np.array([[0.1, 0.2], [0.1, 0.9]])
    nowhere, anywhere = np.zeros((2, 2), dtype=bool), np.ones((2, 2), dtype=bool)
    assert associate(near, nowhere, anywhere).tolist() == [1, 0]


def test_what_is_too_far_is_new_unless_it_bears_the_name() -> None:
    no, yes = np.array([[False]]), np.array([[True]])
    assert associate(np.array([[0.1]]), no, no).tolist() == [-1]
    assert associate(np.array([[0.1]]), no, yes).tolist() == [0]
    assert associate(np.array([[50.0]]), yes, no).tolist() == [0]


def test_a_name_outweighs_a_little_distance_only() -> None:
    same, within = np.array([[True, False]]), np.array([[True, True]])
    assert associate(np.array([[0.9 * KNOWN_NAME_BONUS, 0.0]]), same, within).tolist() == [0]
    assert associate(np.array([[1.1 * KNOWN_NAME_BONUS, 0.0]]), same, within).tolist() == [1]


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_no_other_assignment_costs_less(detections: int, known: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    distance = random.uniform(0.0, 2.0, (detections, known))
    within = random.uniform(size=distance.shape) < 0.7
    found = associate(distance, np.zeros_like(within), within)

    def cost(answer: tuple[int, ...]) -> float:
        return sum(
            NEW_COST if k < 0 else distance[d, k] if within[d, k] else 1e6
            for d, k in enumerate(answer)
        )

    every = set(permutations([*range(known), *[-1] * detections], detections))
    assert abs(cost(tuple(found.tolist())) - min(map(cost, every))) < 1e-9
    taken = found[found >= 0]
    assert len(set(taken.tolist())) == len(taken)
