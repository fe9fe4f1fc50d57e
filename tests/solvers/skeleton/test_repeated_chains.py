"""Chains that repeat: closed forms in rings and rows, and what any turn and mirror leaves alike."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.skeleton.part_chains import part_chains
from solvers.skeleton.repeated_chains import repeated_chains
from solvers.skeleton.tree import Tree


def body(*chains: np.ndarray) -> Tree:
    """Chains (n, 3) from a common root at the origin."""
    parents, positions = [-1], [np.zeros(3)]
    for chain in chains:
        for step, point in enumerate(chain):
            parents.append(0 if step == 0 else len(positions) - 1)
            positions.append(point)
    return Tree(np.array(parents), np.array(positions))


def arm(angle: float, *, length: float = 1.0, bend: float = 0.3) -> np.ndarray:
    """A bent chain of four bones, in the floor's plane at an angle."""
    along = np.arange(1, 5) / 4.0 * length
    points = np.column_stack([along, -bend * along**2, np.zeros(4)])
    return Rotation.from_euler("y", angle).apply(points)


def groups(tree: Tree, radii: list[float] | None = None) -> list[tuple[int, ...]]:
    return repeated_chains(tree, 0, part_chains(tree, 0).chains, radii)


def test_a_ring_of_arms_repeats_and_goes_round() -> None:
    shuffled = [0, 3, 1, 4, 2]
    tree = body(*(arm(2.0 * np.pi * place / 5) for place in shuffled))
    (ring,) = groups(tree)
    places = [shuffled[chain] for chain in ring]
    assert places in ([0, 1, 2, 3, 4], [0, 4, 3, 2, 1])


def test_left_and_right_repeat_left_first_and_what_stands_alone_does_not() -> None:
    left = np.array([[0.3, 0.2, 0.0], [0.7, 0.3, 0.2]])
    neck = np.array([[0.0, 0.4, 0.0], [0.0, 0.5, 0.1]])
    tree = body(left * (-1, 1, 1), neck, left)
    assert groups(tree) == [(2, 0)]


def test_a_row_goes_along_itself() -> None:
    legs = [np.array([[0.2, 0, z], [0.6, 0, z], [0.7, -0.4, z]]) for z in (0.2, 0.0, -0.2)]
    (row,) = groups(body(*legs))
    assert row in ((0, 1, 2), (2, 1, 0))


@pytest.mark.parametrize(
    "other",
    [
        arm(2.0, length=0.6),  # too short
        arm(2.0, bend=1.1),  # bent otherwise
        arm(2.0) + np.array([0.0, 1.2, 0.0]),  # elsewhere
    ],
)
def test_chains_that_differ_do_not_repeat(other: np.ndarray) -> None:
    assert groups(body(arm(0.0), other)) == []


def test_thick_and_thin_do_not_repeat() -> None:
    tree = body(arm(0.0), arm(2.0))
    assert groups(tree, [0.1, 0.1]) == [(0, 1)]
    assert groups(tree, [0.1, 0.25]) == []


def test_what_is_known_to_repeat_does_and_what_is_known_not_to_does_not() -> None:
    tree = body(arm(0.0), arm(1.0, length=0.5), arm(2.0), arm(4.0))
    chains = part_chains(tree, 0).chains
    assert repeated_chains(tree, 0, chains, pairs=[(0, 1)], single=[3]) == [(0, 1)]
    (found,) = repeated_chains(tree, 0, chains)
    assert sorted(found) == [0, 2, 3]


def test_the_arms_of_a_star_may_differ_more() -> None:
    lengths = (1.0, 0.6, 0.9, 1.0, 0.7)
    star = body(*(arm(1.2 * place, length=length) for place, length in enumerate(lengths)))
    assert [sorted(group) for group in groups(star)] == [[0, 1, 2, 3, 4]]
    few = body(*(arm(2.0 * place, length=length) for place, length in enumerate(lengths[:3])))
    assert [sorted(group) for group in groups(few)] == [[0, 2]]


def test_ever_longer_chains_are_no_single_group() -> None:
    tree = body(*(arm(1.5 * place, length=1.25**place) for place in range(4)))
    for group in groups(tree):
        assert max(group) - min(group) <= 1


def test_arms_that_differ_a_little_repeat() -> None:
    random = np.random.default_rng(4)
    arms = [
        arm(2.0 * np.pi * place / 8, length=random.uniform(0.9, 1.1), bend=random.uniform(0.2, 0.4))
        for place in range(8)
    ]
    (ring,) = groups(body(*arms))
    assert len(ring) == 8


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_turned_and_mirrored_and_in_another_unit_the_groups_are_the_same(mirror: float) -> None:
    chains = [*(arm(a) for a in (0.0, 1.5, 3.0)), *(arm(a, length=3.0) for a in (0.7, 2.2))]
    turn = Rotation.from_euler("xyz", (0.4, 1.0, -2.0))
    moved = [1e3 * turn.apply(chain * (mirror, 1, 1)) for chain in chains]
    found = {frozenset(group) for group in groups(body(*chains))}
    assert found == {frozenset({0, 1, 2}), frozenset({3, 4})}
    assert {frozenset(group) for group in groups(body(*moved))} == found


def test_one_chain_repeats_nothing() -> None:
    assert groups(body(arm(0.0))) == []
