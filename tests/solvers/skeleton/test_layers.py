"""Layers of motion: closed forms, ends of the weights, and world and local as inverses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from solvers.skeleton.joint_poses import ForwardKinematics
from solvers.skeleton.layers import LayeredNodes, LayerFrame
from solvers.skeleton.tree import Tree

seeds = st.integers(0, 2**32 - 1)


def some_tree(random: np.random.Generator, count: int = 9) -> Tree:
    parents = np.array([-1, *(random.integers(0, node) for node in range(1, count))])
    shuffled = random.permutation(count)
    moved = np.empty(count, dtype=np.int64)
    moved[shuffled] = np.where(parents < 0, -1, shuffled[np.maximum(parents, 0)])
    return Tree(moved, random.normal(size=(count, 3)))


def some_turns(random: np.random.Generator, count: int) -> np.ndarray:
    return Rotation.random(count, rng=random).as_quat()


def some_frame(random: np.random.Generator, nodes: np.ndarray, share: float = 0.0) -> LayerFrame:
    first, second = (some_turns(random, len(nodes)).astype(np.float32) for _ in range(2))
    before, after = (random.normal(size=(len(nodes), 3)).astype(np.float32) for _ in range(2))
    return LayerFrame(nodes, (first, second), (before, after), share)


@given(seed=seeds)
def test_local_and_world_are_inverses(seed: int) -> None:
    random = np.random.default_rng(seed)
    layered = LayeredNodes(some_tree(random))
    positions, rotations = random.normal(size=(9, 3)), some_turns(random, 9)
    layered.turns[:], layered.shifts[:] = layered.local(positions, rotations)
    there, turned = layered.world()
    assert_allclose(there, positions, atol=1e-12)
    assert_allclose(np.abs((turned * rotations).sum(axis=1)), 1.0, atol=1e-12)


@given(seed=seeds)
def test_world_is_what_forward_kinematics_gives(seed: int) -> None:
    random = np.random.default_rng(seed)
    tree = some_tree(random)
    layered = LayeredNodes(tree)
    layered.override(some_frame(random, np.arange(9)), 1.0)
    above = tree.positions[np.maximum(tree.parents, 0)] * (tree.parents >= 0)[:, None]
    offsets = tree.positions - above + layered.shifts
    positions, rotations = ForwardKinematics(tree.parents).world(offsets, layered.turns)
    there, turned = layered.world()
    assert_allclose(there, positions, atol=1e-9)
    assert_allclose(np.abs((turned * rotations).sum(axis=1)), 1.0, atol=1e-9)


def test_nothing_on_it_is_the_rest_pose() -> None:
    tree = some_tree(np.random.default_rng(1))
    positions, rotations = LayeredNodes(tree).world()
    assert_allclose(positions, tree.positions, atol=1e-15)
    assert_array_equal(rotations, np.tile([0.0, 0.0, 0.0, 1.0], (9, 1)))


@given(seed=seeds, weight=st.floats(0.0, 1.0), share=st.floats(0.0, 1.0))
def test_override_goes_along_the_shortest_turn(seed: int, weight: float, share: float) -> None:
    """SciPy's logarithms give the same: q exp(w log(q^-1 p)), between frames too."""
    random = np.random.default_rng(seed)
    layered = LayeredNodes(some_tree(random))
    below, nodes = some_frame(random, np.arange(9)), np.array([2, 7, 4])
    layered.override(below, 1.0)
    start, shifted = Rotation.from_quat(layered.turns[nodes]), layered.shifts[nodes]
    over = some_frame(random, nodes, share)
    layered.override(over, weight)

    first, second = (Rotation.from_quat(turns) for turns in over.turns)
    own = first * Rotation.from_rotvec(share * (first.inv() * second).as_rotvec())
    wanted = start * Rotation.from_rotvec(weight * (start.inv() * own).as_rotvec())
    assert_allclose(
        (Rotation.from_quat(layered.turns[nodes]).inv() * wanted).magnitude(), 0, atol=1e-6
    )
    shift = (1.0 - share) * over.shifts[0] + share * over.shifts[1]
    assert_allclose(layered.shifts[nodes], (1 - weight) * shifted + weight * shift, atol=1e-6)
    others = np.setdiff1d(np.arange(9), nodes)
    assert_allclose(layered.turns[others], below.turns[0][others], atol=1e-6)


@given(seed=seeds, weight=st.floats(-1.0, 2.0))
def test_add_turns_further(seed: int, weight: float) -> None:
    random = np.random.default_rng(seed)
    layered = LayeredNodes(some_tree(random))
    layered.override(some_frame(random, np.arange(9)), 1.0)
    start, shifted = Rotation.from_quat(layered.turns), layered.shifts.copy()
    over = some_frame(random, np.arange(9))
    layered.add(over, weight)
    own = Rotation.from_rotvec(weight * Rotation.from_quat(over.turns[0]).as_rotvec())
    wanted = start * own
    assert_allclose((Rotation.from_quat(layered.turns).inv() * wanted).magnitude(), 0, atol=1e-6)
    assert_allclose(layered.shifts, shifted + weight * over.shifts[0], atol=1e-6)


def test_two_layers_that_add_about_one_axis_add_their_angles() -> None:
    layered = LayeredNodes(Tree(np.array([-1, 0]), np.array([[0.0, 0, 0], [0, 1, 0]])))
    half = Rotation.from_euler("z", [[0.0], [0.5]]).as_quat().astype(np.float32)
    still = np.zeros((2, 3), np.float32)
    frame = LayerFrame(np.arange(2), (half, half), (still, still))
    layered.add(frame, 1.0)
    layered.add(frame, 0.5)
    assert Rotation.from_quat(layered.turns[1]).as_rotvec()[2] == pytest.approx(0.75, abs=1e-7)


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_whole_weights_meet_the_ends_to_the_bit(weight: float) -> None:
    random = np.random.default_rng(3)
    layered = LayeredNodes(some_tree(random))
    layered.override(some_frame(random, np.arange(9)), 1.0)
    turns, shifts = layered.turns.copy(), layered.shifts.copy()
    over = some_frame(random, np.arange(9))
    layered.override(over, weight)
    alone = LayeredNodes(some_tree(random))
    alone.override(over, 1.0)
    assert_array_equal(layered.turns, turns if weight == 0.0 else alone.turns)
    assert_array_equal(layered.shifts, shifts if weight == 0.0 else alone.shifts)


@given(angle=st.floats(0.0, 0.25), share=st.floats(0.0, 1.0), seed=st.integers(0, 2**32 - 1))
def test_frames_that_are_close_are_gone_between_exactly(
    angle: float, share: float, seed: int
) -> None:
    """Within 12 degrees a series stands for the angle's functions: no jolt where it ends."""
    random = np.random.default_rng(seed)
    axis = random.normal(size=3)
    first = Rotation.random(random_state=seed % 1000)
    second = first * Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    ends = [each.as_quat().astype(np.float32)[None] for each in (first, second)]
    still = np.zeros((1, 3), np.float32)
    layered = LayeredNodes(Tree(np.array([-1]), np.zeros((1, 3))))
    layered.override(LayerFrame(np.array([0]), (ends[0], ends[1]), (still, still), share), 1.0)
    start, end = (Rotation.from_quat(each[0].astype(np.float64)) for each in ends)
    wanted = start * Rotation.from_rotvec(share * (start.inv() * end).as_rotvec())
    got = Rotation.from_quat(layered.turns[0])
    assert (wanted.inv() * got).magnitude() < 1e-10
