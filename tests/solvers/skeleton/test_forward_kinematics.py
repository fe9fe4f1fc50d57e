"""Nodes and bones of a posed skeleton, in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.skeleton.forward_kinematics import SkeletonPose, pose
from solvers.skeleton.tree import Tree
from tests.thorough import examples

STILL = np.array([0.0, 0.0, 0.0, 1.0])


def turn(degrees, axis="z"):
    return Rotation.from_euler(axis, degrees, degrees=True).as_quat()


def spine_with_arms():
    """0 pelvis - 1 spine - 2 chest; arms 3-4 and 5-6 at the chest, a tail 7 at the pelvis."""
    return Tree(
        np.array([-1, 0, 1, 2, 3, 2, 5, 0]),
        np.array(
            [
                (0, 0, 0),
                (0, 1, 0),
                (0, 2, 0),
                (1, 2, 0),
                (2, 2, 0),
                (-1, 2, 0),
                (-2, 2, 0),
                (0, 0, -1),
            ],
            dtype=float,
        ),
    )


def test_nothing_driven_stays_at_rest():
    tree = spine_with_arms()
    rotations, positions = pose(tree, 0, [], [])
    np.testing.assert_array_equal(rotations, np.tile(STILL, (8, 1)))
    np.testing.assert_array_equal(positions, tree.positions)


def test_a_chain_bends_at_its_nodes_and_carries_what_hangs_on_it():
    tree = spine_with_arms()
    spine = np.array([turn(90), turn(90)])
    rotations, positions = pose(tree, 0, [(0, 1, 2)], [spine])
    np.testing.assert_allclose(
        positions[[1, 2, 3, 4, 5, 6]],
        [(-1, 0, 0), (-2, 0, 0), (-2, 1, 0), (-2, 2, 0), (-2, -1, 0), (-2, -2, 0)],
        atol=1e-12,
    )
    np.testing.assert_array_equal(rotations[0], STILL)  # where the chain starts the body holds on
    np.testing.assert_allclose(rotations[[2, 3, 4]], [turn(90)] * 3, atol=1e-12)
    np.testing.assert_array_equal(positions[7], tree.positions[7])  # not on the chain


def test_a_node_inside_a_chain_turns_with_the_bone_that_starts_there():
    tree = spine_with_arms()
    rotations, _ = pose(tree, 0, [(0, 1, 2)], [np.array([turn(20), -turn(80)])])
    np.testing.assert_allclose(np.abs(rotations[1] @ turn(80)), 1.0, atol=1e-12)


def test_a_limb_starts_where_the_spine_has_moved_to_but_points_where_it_is_told():
    tree = spine_with_arms()
    spine = np.array([turn(90), turn(90)])
    arm = np.array([turn(0), turn(0)])
    rotations, positions = pose(tree, 0, [(0, 1, 2), (2, 3, 4)], [spine, arm])
    np.testing.assert_allclose(
        positions[[2, 3, 4]], [(-2, 0, 0), (-1, 0, 0), (0, 0, 0)], atol=1e-12
    )
    np.testing.assert_allclose(np.abs(rotations[2] @ turn(90)), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(rotations[4] @ STILL), 1.0, atol=1e-12)


def test_any_node_may_be_the_one_that_stays():
    tree = spine_with_arms()
    _, positions = pose(tree, 4, [(4, 3, 2, 1, 0)], [np.array([turn(180)] * 4)])
    np.testing.assert_allclose(positions[4], tree.positions[4])
    np.testing.assert_allclose(positions[0], 2 * tree.positions[4] - tree.positions[0], atol=1e-12)


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(0, 100_000), st.integers(2, 40))
def test_bones_keep_their_lengths_and_nodes_ride_rigidly(seed, count):
    rng = np.random.default_rng(seed)
    parents = np.array([-1] + [rng.integers(max(0, n - 3), n) for n in range(1, count)])
    tree = Tree(parents, rng.normal(size=(count, 3)))
    chain = tree.chain(0, int(rng.integers(1, count)))
    bones = Rotation.random(len(chain) - 1, rng=rng).as_quat()
    rotations, positions = pose(tree, 0, [chain], [bones])
    offsets = positions[1:] - positions[parents[1:]]
    np.testing.assert_allclose(
        np.linalg.norm(offsets, axis=1), tree.bone_lengths[1:], rtol=1e-12, atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.norm(rotations, axis=1), 1.0, atol=1e-12)
    for node in range(1, count):
        if node not in chain:
            np.testing.assert_allclose(rotations[node], rotations[parents[node]], atol=1e-12)
            carried = Rotation.from_quat(rotations[node]).apply(
                tree.positions[node] - tree.positions[parents[node]]
            )
            np.testing.assert_allclose(offsets[node - 1], carried, atol=1e-12)


@pytest.mark.parametrize(
    ("root", "chains", "message"),
    [
        (0, [(2, 1)], "away from node 0"),
        (0, [(0, 2)], "away from node 0"),
        (3, [(2, 3)], "away from node 3"),
        (0, [(0, 1, 2), (1, 2, 3)], "driven once"),
    ],
)
def test_chains_that_cannot_be_driven_are_refused(root, chains, message):
    with pytest.raises(ValueError, match=message):
        SkeletonPose(spine_with_arms(), root, chains)


def test_a_missing_rotation_is_refused():
    with pytest.raises(ValueError, match="Expected 2 rotations"):
        pose(spine_with_arms(), 0, [(0, 1, 2)], [np.array([STILL])])


def test_each_bone_is_known_with_its_turn():
    tree = spine_with_arms()
    placed = SkeletonPose(tree, 0, [(0, 1, 2), (2, 3, 4)]).place(
        np.array([turn(20), turn(50), turn(-10), turn(70)])
    )
    bones = Rotation.from_quat(placed.turns[len(tree) :])
    for node, parent in enumerate(tree.parents):
        if parent >= 0:
            bone = bones[node].apply(tree.positions[node] - tree.positions[parent])
            moved = placed.positions[node] - placed.positions[parent]
            np.testing.assert_allclose(moved, bone, atol=1e-12)


def test_a_longer_bone_carries_what_hangs_on_it_outward():
    tree = spine_with_arms()
    skeleton = SkeletonPose(tree, 0, [])
    shares = np.ones(8)
    shares[[1, 4]] = 1.5, 3.0
    out = skeleton.stretched(tree.positions, shares)
    moved = np.array([(0, 0, 0)] + 6 * [(0, 0.5, 0)] + [(0, 0, 0)])
    moved[4] += (2.0, 0.0, 0.0)
    np.testing.assert_allclose(out, tree.positions + moved, atol=1e-15)
