"""Forward kinematics against SciPy, joint by joint; Unity's space against reflected matrices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from devices.bodies.unity_space import across_unity, turn_across_unity, unity_euler
from solvers.skeleton.joint_poses import ForwardKinematics
from solvers.skeleton.quaternions import conjugate, multiply, rotate

MIRROR = np.diag([-1.0, 1.0, 1.0])


@settings(deadline=None)
@given(st.integers(1, 70), st.integers(0, 2**32 - 1))
def test_the_poses_are_those_found_joint_by_joint(count: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    parents = np.array([random.integers(-1, joint) if joint else -1 for joint in range(count)])
    offsets = random.normal(size=(count, 3))
    turns = Rotation.random(count, rng=random)
    positions, rotations = ForwardKinematics(parents).world(offsets, turns.as_quat())
    world: list[tuple[np.ndarray, Rotation]] = []
    for joint, above in enumerate(parents):
        place, turn = world[above] if above >= 0 else (np.zeros(3), Rotation.identity())
        world.append((place + turn.apply(offsets[joint]), turn * turns[joint]))
        assert positions[joint] == pytest.approx(world[joint][0], abs=1e-9)
        assert (
            np.abs((Rotation.from_quat(rotations[joint]) * world[joint][1].inv()).magnitude())
            < 1e-7
        )


def test_many_frames_go_at_once_and_joints_may_come_in_any_order() -> None:
    random = np.random.default_rng(3)
    parents = [2, 0, -1, 1]
    offsets = random.normal(size=(5, 4, 3))
    turns = Rotation.random(20, rng=random).as_quat().reshape(5, 4, 4)
    kinematics = ForwardKinematics(parents)
    positions, rotations = kinematics.world(offsets, turns)
    for frame in range(5):
        one, other = kinematics.world(offsets[frame], turns[frame])
        assert positions[frame] == pytest.approx(one, abs=1e-12)
        assert rotations[frame] == pytest.approx(other, abs=1e-12)


@pytest.mark.parametrize("parents", [[0], [1, 0], [1, 2, 0], [-1, 2], [-2]])
def test_what_is_no_tree_is_refused(parents: list[int]) -> None:
    with pytest.raises(ValueError, match="Expected `parents`"):
        ForwardKinematics(parents)


def test_quaternions_are_those_of_scipy() -> None:
    p, q = (Rotation.random(9, rng=np.random.default_rng(seed)) for seed in (1, 2))
    vectors = np.random.default_rng(3).normal(size=(9, 3))
    assert rotate(p.as_quat(), vectors) == pytest.approx(p.apply(vectors), abs=1e-12)
    product = Rotation.from_quat(multiply(p.as_quat(), q.as_quat()))
    assert (product * (p * q).inv()).magnitude().max() < 1e-7
    assert rotate(conjugate(p.as_quat()), p.apply(vectors)) == pytest.approx(vectors, abs=1e-12)


def test_unity_is_our_space_reflected() -> None:
    turns = Rotation.random(20, rng=np.random.default_rng(4))
    points = np.random.default_rng(5).normal(size=(20, 3))
    ours = Rotation.from_quat(turn_across_unity(turns.as_quat()))
    assert ours.as_matrix() == pytest.approx(MIRROR @ turns.as_matrix() @ MIRROR, abs=1e-12)
    assert np.linalg.det(ours.as_matrix()) == pytest.approx(1.0)
    moved = across_unity(turns.apply(points))
    assert ours.apply(across_unity(points)) == pytest.approx(moved, abs=1e-12)
    assert across_unity([-0.3, 1.0, 0.1])[0] == 0.3  # a left hand in Unity is one here


def test_unity_euler_angles_turn_about_z_then_x_then_y() -> None:
    degrees = np.random.default_rng(6).uniform(-180.0, 180.0, (30, 3))
    # In a left-handed space positive angles turn clockwise, but quaternions multiply alike.
    expected = Rotation.from_euler("zxy", degrees[:, [2, 0, 1]], degrees=True)
    found = Rotation.from_quat(unity_euler(degrees))
    assert (found * expected.inv()).magnitude().max() < 1e-7
