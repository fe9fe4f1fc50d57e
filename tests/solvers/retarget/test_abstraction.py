"""The hierarchy of sub-trees, its root, and the simplified source."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.retarget.abstraction import abstract, find_root
from solvers.retarget.source_limbs import simplify
from solvers.skeleton.tree import Tree
from tests.thorough import examples


def grow(*chains):
    """A tree from chains of points; each starts at a point that is there already, the first not."""
    index, parents = {tuple(chains[0][0]): 0}, [-1]
    for chain in chains:
        for before, here in pairwise(chain):
            index[tuple(here)] = len(parents)
            parents.append(index[tuple(before)])
    return Tree(np.array(parents), np.array(list(index), dtype=float)), index


def figure_3():
    """Branch nodes a - p - q - b; only a and b have one neighbour that is not a leaf."""
    return grow(
        [(0, 0, 0), (-2, 0, 0), (-4, 0, 0), (-5, 1, 0), (-6, 2, 0)],  # middle, p, a, leaf
        [(-4, 0, 0), (-5, 0, 0)],
        [(-4, 0, 0), (-5, -1, 0)],
        [(-2, 0, 0), (-2, 3, 0)],
        [(0, 0, 0), (2.5, 0, 0), (4, 0, 0), (5, 1, 0)],  # q, b, leaf
        [(4, 0, 0), (5, -1, 0)],
        [(2.5, 0, 0), (2.5, -3, 0)],
    )


def test_levels_and_root_follow_the_rounds_of_the_paper():
    tree, index = figure_3()
    root, levels = find_root(tree)
    a, p, q, b = (index[x, 0, 0] for x in (-4, -2, 2.5, 4))
    assert levels == {a: 1, b: 1, p: 2, q: 2}
    assert root == index[0, 0, 0]  # the chain p - middle - q remains
    folded = {s.root: s for s in abstract(tree).subtrees if s.unfolding == 0}
    assert {node: (s.level, len(s.branches)) for node, s in folded.items()} == {
        a: (1, 3),
        b: (1, 2),
        p: (2, 2),
        q: (2, 2),
        root: (3, 2),
    }


def test_a_root_on_the_end_of_the_last_chain_keeps_both_its_sub_trees():
    tree, index = grow(
        [(0, 0, 0), (0, 3, 0)],
        [(0, 0, 0), (0, -3, 0)],
        [(0, 0, 0), (1, 0, 0), (1, 1, 0)],
        [(1, 0, 0), (1, -1, 0)],
    )
    hierarchy = abstract(tree)
    assert hierarchy.root == index[0, 0, 0]
    own, whole = (s for s in hierarchy.subtrees if s.root == hierarchy.root and s.unfolding == 0)
    assert (own.level, len(own.branches)) == (1, 2)
    assert (whole.level, len(whole.branches)) == (2, 3)


def test_positions_are_weighted_by_outgoing_bones():
    tree, _ = grow(
        [(0, 0, 0), (1, 0, 0), (3, 0, 0), (6, 0, 0)],
        [(0, 0, 0), (0, 2, 0)],
        [(0, 0, 0), (0, 0, 1), (0, 0, 2)],
    )
    (star,) = (s for s in abstract(tree).subtrees if s.unfolding == 0)
    ends = {branch.chain: branch for branch in star.branches}
    np.testing.assert_allclose(ends[0, 1, 2, 3].position, [(1 * 2 + 3 * 3) / 5, 0, 0])
    assert ends[0, 1, 2, 3].length == 6.0
    np.testing.assert_allclose(ends[0, 4].position, [0, 2, 0])  # no chain node: the leaf itself
    np.testing.assert_allclose(ends[0, 5, 6].position, [0, 0, 1])


def test_a_sub_tree_becomes_a_leaf_at_its_weighted_mean():
    tree, index = grow(
        [(0, 0, 0), (2, 0, 0), (4, 0, 0), (4, 3, 0)],  # root, chain, fork, leaf
        [(4, 0, 0), (4, -1, 0)],
        [(0, 0, 0), (-9, 1, 0)],
        [(0, 0, 0), (-9, -1, 0)],
    )
    hierarchy = abstract(tree, root=0)
    whole = next(s for s in hierarchy.subtrees if s.root == 0)
    branch = next(b for b in whole.branches if b.chain[-1] == index[4, 0, 0])
    fork = (3 * np.array([4, 3, 0]) + 1 * np.array([4, -1, 0])) / 4  # step 4
    expected = (2 * np.array([2, 0, 0]) + 4 * fork) / 6  # step 2, one level up
    np.testing.assert_allclose(branch.position, expected)
    assert branch.length == 8.0
    assert branch.extension == (index[4, 3, 0],)  # the longest chain leads on


def test_a_plain_chain_gives_its_halves_and_itself_from_either_end():
    tree, _ = grow([(float(x), 0.0, 0.0) for x in range(7)])
    hierarchy = abstract(tree)
    assert hierarchy.root == 3
    chains = sorted(tuple(b.chain for b in s.branches) for s in hierarchy.subtrees)
    assert chains == [
        ((0, 1, 2, 3, 4, 5, 6),),
        ((3, 2, 1, 0), (3, 4, 5, 6)),
        ((6, 5, 4, 3, 2, 1, 0),),
    ]


def test_a_single_node_has_no_sub_tree_worth_matching():
    hierarchy = abstract(Tree(np.array([-1]), np.zeros((1, 3))))
    assert hierarchy.root == 0
    assert all(not s.branches for s in hierarchy.subtrees)


@pytest.mark.parametrize("root", range(5))
def test_a_given_root_is_taken(root):
    tree, _ = figure_3()
    hierarchy = abstract(tree, root)
    assert hierarchy.root == root
    assert any(
        s.root == root and s.level == max(t.level for t in hierarchy.subtrees)
        for s in hierarchy.subtrees
    )


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 60))
def test_every_sub_tree_is_made_of_disjoint_ways_outward(seed, count):
    rng = np.random.default_rng(seed)
    parents = np.array([-1] + [rng.integers(max(0, n - 4), n) for n in range(1, count)])
    positions = rng.normal(size=(count, 3)).round(rng.integers(0, 2))  # duplicates, zero bones
    tree = Tree(parents, positions)
    hierarchy = abstract(tree)
    for sub in hierarchy.subtrees:
        bones = []
        for branch in sub.branches:
            full = branch.chain + branch.extension
            assert tree.chain(sub.root, full[-1])[-len(full) :] == full
            assert len(tree.neighbours[full[-1]]) == 1
            bones += list(pairwise(full))
            assert np.isfinite(branch.position).all()
        assert len(set(bones)) == len(bones)
    levels = find_root(tree)[1]
    assert set(levels) == set(np.flatnonzero(tree.degree > 2).tolist())


@settings(max_examples=examples(30), deadline=None)
@given(st.integers(0, 10_000))
def test_node_numbers_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    tree = Tree(
        np.array([-1] + [rng.integers(max(0, n - 4), n) for n in range(1, 40)]),
        rng.normal(size=(40, 3)),
    )
    name = rng.permutation(40)
    parents = np.full(40, -1)
    parents[name] = np.where(tree.parents >= 0, name[tree.parents], -1)
    positions = np.empty((40, 3))
    positions[name] = tree.positions
    renamed = abstract(Tree(parents, positions))
    hierarchy = abstract(tree)
    assert renamed.root == name[hierarchy.root]

    def summary(subtrees, named):
        return sorted(
            (named[s.root], s.level, s.unfolding, sorted(round(b.length, 9) for b in s.branches))
            for s in subtrees
        )

    assert summary(renamed.subtrees, np.arange(40)) == summary(hierarchy.subtrees, name)


def test_a_source_folds_its_hands_into_its_arms_but_a_hand_keeps_its_fingers():
    fingers = [[(10, 0, 0), (11, y, 0), (12, 2 * y, 0)] for y in (-1, 0, 1)]
    arm = [(0, 0, 0), (5, 0, 0), (10, 0, 0)]
    body, _ = grow(arm, *fingers, [(0, 0, 0), (-5, 0, 0), (-10, 0, 0)])
    assert sorted(map(len, simplify(body).chains)) == [3, 5]
    hand, index = grow(*fingers)
    assert [chain[0] for chain in simplify(hand).chains] == [index[10, 0, 0]] * 3
    assert simplify(hand).stem == ()


def test_a_source_arm_above_its_fingers_is_a_stem():
    tree, _ = grow([(0, 0, 0), (2, 0, 0)], *[[(2, 0, 0), (4, y, 0)] for y in (-1, 0, 1)])
    source = simplify(tree)
    assert source.stem == (0, 1)
    assert source.forks == (1,)
    assert len(source.chains) == 3


def test_branch_vectors_follow_the_pose():
    tree, _ = grow([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 0, 0), (0, 1, 0)])
    source = simplify(tree)
    turned = tree.positions @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]).T + 5.0
    np.testing.assert_allclose(source.branch_vectors(turned), [[0, 1, 0], [-1, 0, 0]], atol=1e-12)


def test_a_source_keeps_its_longest_limbs():
    angles = np.linspace(0.0, 6.0, 90)
    tips = np.column_stack([np.cos(angles), np.sin(angles), angles]) * (1 + angles[:, None])
    tree = Tree(np.array([-1] + [0] * 90), np.concatenate([np.zeros((1, 3)), tips]))
    source = simplify(tree)
    assert [chain[1] for chain in source.chains] == list(range(71, 91))
