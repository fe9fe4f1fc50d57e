"""Fitted skin weights reproduce a performance."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from solvers.skeleton.tree import Tree
from solvers.surface.skin_weights import (
    PosedSamples,
    Skin,
    deviations,
    fit_skin,
    skin_of_distances,
    skin_of_weights,
)


def make_chain(count: int) -> Tree:
    rest = np.linspace([0, 0, 0], [0, 1, 0], count)
    return Tree(np.arange(count) - 1, rest)


def skinned(vertices: NDArray[np.float64], tree: Tree, skin: Skin, frames: int) -> PosedSamples:
    """What a skin makes of random motions of the nodes."""
    random = np.random.default_rng(7)
    count = len(tree)
    positions = tree.positions + random.normal(0, 0.2, (frames, count, 3))
    turns = Rotation.random(frames * count, rng=random)
    matrices = turns.as_matrix().reshape(frames, count, 3, 3)
    offsets = vertices[:, None] - tree.positions[None]  # (N, K, 3)
    carried = np.einsum("skij,nkj->snki", matrices, offsets) + positions[:, None]
    dense = np.zeros((len(vertices), count))
    np.add.at(dense, (np.arange(len(vertices))[:, None], skin.nodes), skin.weights)
    posed = np.einsum("nk,snki->sni", dense, carried)
    return PosedSamples(posed, positions, turns.as_quat().reshape(frames, count, 4))


def test_the_weights_that_made_a_performance_are_found_again() -> None:
    random = np.random.default_rng(1)
    tree = make_chain(8)
    vertices = random.uniform([-0.1, 0, -0.1], [0.1, 1, 0.1], (60, 3))
    nodes = np.array([random.permutation(8)[:3] for _ in vertices])
    truth = Skin(nodes, random.dirichlet(np.ones(3), len(vertices)))
    samples = skinned(vertices, tree, truth, frames=20)
    prior = skin_of_distances(vertices, tree)
    found = fit_skin(vertices, tree, prior, samples)
    assert found.nodes.shape == (60, 4)
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, atol=1e-12)
    assert found.weights.min() >= 0
    dense = np.zeros((2, 60, 8))
    for table, skin in zip(dense, (truth, found), strict=True):
        np.add.at(table, (np.arange(60)[:, None], skin.nodes), skin.weights)
    np.testing.assert_allclose(dense[1], dense[0], atol=0.01)
    assert deviations(vertices, tree, found, samples).max() < 0.01


def test_where_all_nodes_move_alike_the_prior_stands() -> None:
    random = np.random.default_rng(1)
    tree = make_chain(3)
    vertices = random.uniform([-0.1, 0, -0.1], [0.1, 1, 0.1], (20, 3))
    prior = skin_of_distances(vertices, tree)
    turn = Rotation.from_rotvec([0.4, 1, 0])
    rest = np.array(tree.positions)
    samples = PosedSamples(
        turn.apply(vertices)[None], turn.apply(rest)[None], np.tile(turn.as_quat(), (1, 3, 1))
    )
    found = fit_skin(vertices, tree, prior, samples)
    np.testing.assert_allclose(found.weights, prior.weights, atol=1e-9)


def test_limbs_that_hang_side_by_side_do_not_follow_each_other() -> None:
    rest = [[0.0, 1, 0]]
    parents = [-1]
    for x in (-0.05, 0.05):
        for step in range(1, 8):
            parents.append(0 if step == 1 else len(parents) - 1)
            rest.append([x, 1 - 0.1 * step, 0])
    tree = Tree(np.array(parents), np.array(rest))
    left_tip = np.array([[-0.004, 0.32, 0.0]])
    skin = skin_of_distances(left_tip, tree)
    right = skin.nodes[0] >= 8
    assert skin.weights[0][right].sum() < 0.01
    assert skin.nodes[0][0] == 7


def test_the_strongest_weights_of_a_file_are_kept_and_sum_to_one() -> None:
    rows = np.zeros((3, 6))
    rows[0] = (0.1, 0.3, 0.05, 0.2, 0.3, 0.05)
    rows[1, 4] = 2.0
    skin = skin_of_weights(csr_array(rows))
    assert sorted(skin.nodes[0].tolist()) == [0, 1, 3, 4]
    np.testing.assert_allclose(np.sort(skin.weights[0]), np.array([1, 2, 3, 3]) / 9)
    assert (skin.nodes[1, 0], skin.weights[1, 0]) == (4, 1.0)
    assert (skin.nodes[2, 0], skin.weights[2, 0]) == (0, 1.0)  # followed nothing


@pytest.mark.parametrize("nodes", [1, 2, 5])
def test_few_nodes_and_no_samples_are_no_trouble(nodes: int) -> None:
    rest = np.linspace([0, 0, 0], [0, 1, 0], nodes)
    tree = Tree(np.arange(nodes) - 1, rest)
    prior = skin_of_distances(np.array(rest), tree)  # vertices right on the nodes
    none = PosedSamples(np.zeros((0, nodes, 3)), np.zeros((0, nodes, 3)), np.zeros((0, nodes, 4)))
    skin = fit_skin(np.array(rest), tree, prior, none)
    np.testing.assert_array_equal(skin.nodes[:, 0], np.arange(nodes))
    np.testing.assert_allclose(skin.weights[:, 0], 1.0, atol=1e-9)
