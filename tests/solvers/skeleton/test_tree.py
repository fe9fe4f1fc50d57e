"""Queries on trees: order, chains, lengths, other roots."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.skeleton.tree import Tree, extend_to_leaf

# 0 - 1 - 2 - 3 and 1 - 4 - 5, rooted at 2
PARENTS = [1, 2, -1, 2, 1, 4]
POSITIONS = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [4, 0, 0], [1, 1, 0], [1, 4, 0]]


def random_tree(seed: int, count: int) -> Tree:
    rng = np.random.default_rng(seed)
    parents = np.array([-1] + [rng.integers(0, node) for node in range(1, count)])
    shuffled = rng.permutation(count)
    renamed = np.full(count, -1)
    renamed[shuffled] = np.where(parents >= 0, shuffled[parents], -1)
    return Tree(renamed, rng.normal(size=(count, 3)))


def test_queries_see_the_unrooted_tree():
    tree = Tree(np.array(PARENTS), np.array(POSITIONS))
    assert tree.root == 2
    assert tree.children[1] == (0, 4)
    assert tree.neighbours[1] == (0, 2, 4)
    assert tree.degree.tolist() == [1, 3, 2, 1, 2, 1]
    assert tree.leaves == (0, 3, 5)
    assert tree.chain(5, 3) == (5, 4, 1, 2, 3)
    assert tree.chain(0, 0) == (0,)
    assert tree.length((5, 4, 1, 2, 3)) == 7.0
    assert set(tree.subtree(1)) == {0, 1, 4, 5}
    assert set(tree.subtree(1, away_from=4)) == {0, 1, 2, 3}
    assert tree.heights[2] == 5.0
    assert tree.order[0] == 2


def test_a_chain_is_extended_along_the_longest_way():
    tree = Tree(np.array(PARENTS), np.array(POSITIONS))
    assert extend_to_leaf(tree, (3, 2)) == (3, 2, 1, 4, 5)
    assert extend_to_leaf(tree, (5, 4, 1)) == (5, 4, 1, 2, 3)
    assert extend_to_leaf(tree, (1, 0)) == (1, 0)
    with pytest.raises(ValueError, match="at least two nodes"):
        extend_to_leaf(tree, (1,))


@given(st.integers(0, 1000), st.integers(1, 30))
def test_rerooting_keeps_bones_and_reverses_the_way_to_the_root(seed, count):
    tree = random_tree(seed, count)
    root = seed % count
    turned = tree.rerooted(root)
    assert turned.root == root
    assert turned.neighbours == tree.neighbours
    assert turned.bone_lengths.sum() == pytest.approx(tree.bone_lengths.sum())
    np.testing.assert_allclose(turned.centroid, tree.centroid, atol=1e-12)
    for node in range(count):
        assert turned.chain(root, node) == tree.chain(root, node)


@pytest.mark.parametrize(
    ("parents", "positions", "message"),
    [
        ([], np.zeros((0, 3)), r"shape \(K,\), K > 0"),
        ([-1, 0], np.zeros((3, 3)), r"shape \(2, 3\)"),
        ([-1, 0.5], np.zeros((2, 3)), "integers"),
        ([-1, -1], np.zeros((2, 3)), "one root"),
        ([0, 1], np.zeros((2, 3)), "one root"),
        ([-1, 2, 1], np.zeros((3, 3)), "form a tree"),
        ([-1, 7], np.zeros((2, 3)), "form a tree"),
        ([-1, -3], np.zeros((2, 3)), "form a tree"),
        ([-1, 0], [[0, 0, 0], [0, np.nan, 0]], "finite"),
    ],
)
def test_what_is_no_tree_is_refused(parents, positions, message):
    with pytest.raises(ValueError, match=message):
        Tree(np.array(parents), np.array(positions))


def test_a_tree_cannot_be_changed():
    tree = Tree(np.array(PARENTS), np.array(POSITIONS))
    with pytest.raises(ValueError, match="read-only"):
        tree.positions[0] = 1.0
