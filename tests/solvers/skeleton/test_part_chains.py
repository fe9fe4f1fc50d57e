"""Chains to point at: closed forms on small trees, and the promises that hold for any tree."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from solvers.skeleton.part_chains import part_chains
from solvers.skeleton.tree import Tree


def tree_of(*nodes: tuple[int, tuple[float, float, float]]) -> Tree:
    return Tree(np.array([parent for parent, _ in nodes]), np.array([at for _, at in nodes]))


STAR = tree_of(
    (-1, (0, 0, 0)), (0, (1, 0, 0)), (1, (2, 0, 0)), (0, (0, 1, 0)), (3, (0, 2, 0)), (0, (0, 0, 1))
)
HAND = tree_of(  # an arm of three bones with three fingers at its end
    (-1, (0, 0, 0)),
    (0, (1, 0, 0)),
    (1, (2, 0, 0)),
    (2, (2.3, 0.1, 0)),
    (2, (2.4, 0, 0)),
    (2, (2.3, -0.1, 0)),
)
TRUNK = tree_of(  # a trunk that ends in a head and two arms
    (-1, (0, 0, 0)), (0, (0, 0.5, 0)), (1, (0, 1, 0)), (1, (0.7, 0.5, 0)), (1, (-0.7, 0.5, 0))
)


def test_every_way_out_of_the_root_is_a_chain() -> None:
    found = part_chains(STAR, 0)
    assert found.chains == ((0, 1, 2), (0, 3, 4), (0, 5))
    assert found.of_node.tolist() == [0, 0, 0, 1, 1, 2], "the root counts to the longest"


def test_an_arm_goes_on_into_its_longest_finger() -> None:
    found = part_chains(HAND, 0)
    assert found.chains == ((0, 1, 2, 4), (2, 3), (2, 5))


def test_a_trunk_ends_where_limbs_as_long_as_itself_begin() -> None:
    assert part_chains(TRUNK, 0).chains == ((0, 1), (1, 2), (1, 3), (1, 4))


def test_chains_that_are_known_stay_as_they_are_and_take_the_way_to_them() -> None:
    given_chains = ((0, 1), (1, 2, 4))
    found = part_chains(HAND, 0, given_chains)
    assert found.chains[:2] == given_chains
    hand_only = part_chains(HAND, 0, [(2, 4)])
    assert hand_only.chains[0] == (2, 4)
    assert hand_only.of_node[[1, 2, 4]].tolist() == [0, 0, 0], "an arm's beginning is the arm"


def test_nodes_between_are_filled_in_and_what_cannot_be_is_left_out() -> None:
    assert part_chains(HAND, 0, [(0, 2)]).chains[0] == (0, 1, 2)
    assert (2, 1, 0) not in part_chains(HAND, 0, [(2, 1, 0)]).chains, "towards the root"
    twice = part_chains(HAND, 0, [(0, 1, 2), (1, 2, 3)])
    assert (1, 2, 3) not in twice.chains, "shares a bone"


def test_a_node_alone_has_no_chain() -> None:
    found = part_chains(tree_of((-1, (0, 0, 0))), 0)
    assert found.chains == ()
    assert found.of_node.tolist() == [-1]


@st.composite
def trees(draw: st.DrawFn) -> Tree:
    count = draw(st.integers(2, 25))
    parents = [-1, *(draw(st.integers(0, node - 1)) for node in range(1, count))]
    random = np.random.default_rng(draw(st.integers(0, 1000)))
    return Tree(np.array(parents), random.standard_normal((count, 3)))


@given(trees(), st.data())
def test_every_bone_is_in_one_chain_and_all_lead_away_from_the_root(
    tree: Tree, data: st.DataObject
) -> None:
    root = data.draw(st.integers(0, len(tree) - 1))
    found = part_chains(tree, root)
    parents = tree.rerooted(root).parents
    ends = [node for chain in found.chains for node in chain[1:]]
    assert sorted(ends) == sorted(set(range(len(tree))) - {root})
    for number, chain in enumerate(found.chains):
        assert [int(parents[node]) for node in chain[1:]] == list(chain[:-1])
        assert (found.of_node[list(chain[1:])] == number).all()
