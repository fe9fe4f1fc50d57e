"""Trajectories by example: examples met, frames of reference, smoothness, constraints."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from replay.formats import read_recording
from solvers.retarget.limb_shapes import most_different_poses
from solvers.spacetime import (
    ACCELERATION,
    Constraint,
    equality_constraint,
    position_constraint,
    retarget_trajectories,
    velocity_constraint,
)

Array = NDArray[np.float64]

SIMPLEX = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def examples(count: int, joints: int = 2, seed: int = 0) -> tuple[Array, Array]:
    """Pairs of poses, (count, joints, 3) each."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, joints, 3)), rng.normal(size=(count, joints, 3))


def wander(frames: int, joints: int = 2) -> Array:
    """A smooth path among the examples, (frames, joints, 3)."""
    time = np.linspace(0.0, 3.0, frames)[:, None, None]
    rate = np.arange(1.0, 1.0 + 3 * joints).reshape(joints, 3)
    return 0.5 * np.sin(rate / joints * time + rate)


def jerkiness(path: Array) -> float:
    return float(np.square(np.diff(path, 2, axis=0)).sum())


def least_norm(joints: Array, point: Array) -> tuple[Array, Array]:
    """The weights of equation 14 for one point, by its Lagrangian; and the nearness."""
    offsets = joints - point
    near = 1.0 / np.square(offsets).sum(axis=1)
    ridge = 0.01 * len(joints) / 3.0
    system = np.ones((len(joints) + 1, len(joints) + 1))
    system[:-1, :-1] = np.diag(1.0 / near) + offsets @ offsets.T / ridge
    system[-1, -1] = 0.0
    weights = np.linalg.solve(system, np.r_[np.zeros(len(joints)), 1.0])[:-1]
    return weights, near / near.sum()


def by_hand(
    examples: tuple[Array, Array],
    path: Array,
    acceleration: float,
    rows: Callable[[Array], Array] | None = None,
    values: Array | None = None,
) -> Array:
    """Equations 16 to 25 written out for the weights of one joint, as one dense system."""
    joints, controls = (points - points.mean(axis=0) for points in examples)
    unit, spread = (np.sqrt(np.square(p).sum(axis=1).mean()) for p in (joints, controls))
    start, middle = examples[0].mean(axis=0), examples[1].mean(axis=0)
    joints, controls, path = joints / unit, controls / spread, (path - start) / unit
    frames, count = len(path), len(joints)
    J = np.vstack([joints.T, np.ones(count)])
    steps = acceleration * np.kron(np.diff(np.eye(frames), 2, axis=0), controls.T)
    usual, N = np.zeros(frames * count), steps.T @ steps
    for frame in range(frames):
        own = slice(frame * count, (frame + 1) * count)
        usual[own], near = least_norm(joints, path[frame])
        N[own, own] += J.T @ J + 0.01 * np.diag(1.0 / near)
    r = (N - steps.T @ steps) @ usual
    if rows is not None and values is not None:
        B = rows(np.kron(np.eye(frames), spread * controls.T))
        h = values - rows(np.tile(middle, frames)[:, None])[:, 0]
        N = np.block([[N, B.T], [B, np.zeros((len(B), len(B)))]])
        r = np.concatenate([r, h])
    weights = np.linalg.solve(N, r)[: frames * count].reshape(frames, count)
    return middle + spread * weights @ controls


@given(count=st.integers(1, 9), which=st.integers(0, 8), seed=st.integers(0, 99))
def test_a_joint_at_rest_at_an_example_gives_that_example(
    count: int, which: int, seed: int
) -> None:
    joints, controls = examples(count, seed=seed)
    still = np.repeat(joints[which % count][None], 7, axis=0)
    given = np.repeat(controls[which % count][None], 7, axis=0)
    np.testing.assert_allclose(retarget_trajectories(joints, controls, still), given, atol=1e-9)


def test_examples_in_one_plane_or_on_one_spot_are_met_as_well() -> None:
    joints, controls = examples(8)
    joints[:, 0, 2] = 0.5
    joints[:, 1] = joints[0, 1]
    controls[:, 1] = controls[0, 1]
    path = retarget_trajectories(joints, controls, np.repeat(joints[5:6], 4, axis=0))
    np.testing.assert_allclose(path, np.repeat(controls[5:6], 4, axis=0), atol=1e-9)


@pytest.mark.parametrize("acceleration", [0.0, ACCELERATION, 2.0])
def test_it_solves_the_papers_system(acceleration: float) -> None:
    joints, controls = examples(7, joints=1)
    path = wander(12, joints=1)
    found = retarget_trajectories(joints, controls, path, acceleration=acceleration)
    expected = by_hand((joints[:, 0], controls[:, 0]), path[:, 0], acceleration)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-9)


def test_it_solves_the_papers_system_with_constraints() -> None:
    joints, controls = examples(7, joints=1)
    path = wander(12, joints=1)
    constraints = [
        position_constraint(3, 0, (0.1, 0.2, 0.3)),
        velocity_constraint(8, 0, (0.0, 0.1), axes=(0, 2)),
    ]

    def rows(paths: Array) -> Array:
        return np.vstack([paths[9:12], (paths[24:27] - paths[21:24])[[0, 2]]])

    values = np.array([0.1, 0.2, 0.3, 0.0, 0.1])
    found = retarget_trajectories(joints, controls, path, constraints=constraints)
    one = joints[:, 0], controls[:, 0]
    expected = by_hand(one, path[:, 0], ACCELERATION, rows, values)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-8)


@pytest.mark.parametrize("count", [4, 8])
def test_between_examples_an_affine_map_is_found(count: int) -> None:
    """Control points that are an affine map of their joints stay so, but for the ridge."""
    turn = np.array([[0.0, -2.0, 0.3], [1.0, 0.0, 0.0], [0.2, 0.0, 0.5]])
    joints = np.concatenate([SIMPLEX, 1.0 - SIMPLEX])[:count, None]
    controls = joints @ turn.T + 3.0
    share = np.linspace(0.1, 0.9, 60)[:, None]
    path = (share * [0.5, 0.3, 0.1] + (1.0 - share) * [0.1, 0.2, 0.4])[:, None]
    found = retarget_trajectories(joints, controls, path)
    np.testing.assert_allclose(found, path @ turn.T + 3.0, atol=0.03)


@given(
    turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    shift=st.tuples(*[st.floats(-9.0, 9.0)] * 3),
    size=st.floats(0.01, 100.0),
)
def test_where_and_how_large_the_performer_is_does_not_matter(
    turn: tuple[float, ...], shift: tuple[float, ...], size: float
) -> None:
    joints, controls = examples(6)
    path = wander(20)
    R = Rotation.from_rotvec(turn).as_matrix()

    def elsewhere(points: Array) -> Array:
        return size * points @ R.T + shift

    before = retarget_trajectories(joints, controls, path)
    after = retarget_trajectories(elsewhere(joints), controls, elsewhere(path))
    np.testing.assert_allclose(after, before, atol=1e-6)
    moved = retarget_trajectories(joints, elsewhere(controls), path)
    np.testing.assert_allclose(moved, elsewhere(before), atol=1e-7 * max(size, 1.0))


def test_the_more_acceleration_weighs_the_smoother_is_the_path() -> None:
    joints, controls = examples(6)
    path = wander(80) + np.random.default_rng(1).normal(scale=0.03, size=(80, 2, 3))
    weights = (0.0, 0.1, 0.3, 1.0, 10.0)
    rough = [
        jerkiness(retarget_trajectories(joints, controls, path, acceleration=w)) for w in weights
    ]
    assert (np.diff(rough) < 0.0).all()
    assert rough[-1] < 0.01 * rough[0]


def test_constraints_are_met_exactly_and_change_little_elsewhere() -> None:
    joints, controls = examples(8, joints=3)
    path = wander(200, joints=3)
    there = controls[2, 0] + 0.1
    constraints = [
        position_constraint(50, 0, there),
        position_constraint(51, 0, there[1:2], axes=[1]),
        velocity_constraint(120, 1, (0.0, 0.0, 0.0)),
        equality_constraint(20, 0, 2),
    ]
    free = retarget_trajectories(joints, controls, path)
    found = retarget_trajectories(joints, controls, path, constraints=constraints)
    np.testing.assert_allclose(found[50, 0], there, atol=1e-9)
    assert found[51, 0, 1] == pytest.approx(there[1], abs=1e-9)
    np.testing.assert_allclose(found[120, 1], found[119, 1], atol=1e-9)
    assert found[20, 0, 1] == pytest.approx(found[20, 2, 1], abs=1e-9)
    assert abs(free[20, 0, 1] - free[20, 2, 1]) > 0.1
    np.testing.assert_allclose(found[150:], free[150:], atol=1e-4)


def test_constraints_may_say_the_same_twice() -> None:
    joints, controls = examples(8)
    twice = [position_constraint(3, 0, (0.1, 0.2, 0.3)), position_constraint(3, 0, (0.1, 0.2, 0.3))]
    once = retarget_trajectories(joints, controls, wander(9), constraints=twice[:1])
    found = retarget_trajectories(joints, controls, wander(9), constraints=twice)
    np.testing.assert_allclose(found, once, atol=1e-8)


@pytest.mark.parametrize(
    "constraints",
    [
        [position_constraint(3, 0, (0.0,), axes=[0]), position_constraint(3, 0, (1.0,), axes=[0])],
        [position_constraint(3, 1, (0.0, 0.0, 0.1))],
    ],
)
def test_what_cannot_be_met_is_told(constraints: list[Constraint]) -> None:
    joints, controls = examples(5)
    controls[:, 1, 2] = 0.0
    with pytest.raises(ValueError, match=r"constraint \d cannot be met: .* there in frame 3, or"):
        retarget_trajectories(joints, controls, wander(9), constraints=constraints)


@pytest.mark.parametrize("frames", [1, 2, 3, 4])
def test_short_paths_are_paths(frames: int) -> None:
    joints, controls = examples(5)
    found = retarget_trajectories(joints, controls, wander(frames))
    assert found.shape == (frames, 2, 3)
    assert np.isfinite(found).all()
    held = position_constraint(frames - 1, 1, (0.1, 0.2, 0.3))
    met = retarget_trajectories(joints, controls, wander(frames), constraints=[held])
    np.testing.assert_allclose(met[-1, 1], held.value, atol=1e-9)
    np.testing.assert_array_equal(met[:, 0], found[:, 0])


def test_what_is_given_is_checked() -> None:
    joints, controls = examples(5)
    path = wander(9)
    broken = path.copy()
    broken[4, 1, 2] = np.nan
    for wrong, told in (
        (lambda: retarget_trajectories(joints[0], controls, path), r"joint_examples \(at least 1"),
        (lambda: retarget_trajectories(joints[:0], controls[:0], path), "at least 1"),
        (lambda: retarget_trajectories(joints, controls[:4], path), "as many control_examples"),
        (lambda: retarget_trajectories(joints, controls, path[:, :1]), "expected 2 joints"),
        (lambda: retarget_trajectories(joints, controls, broken), "finite joint_path, got nan"),
        (
            lambda: retarget_trajectories(joints, controls, path, acceleration=-1.0),
            "acceleration of at least 0, got -1",
        ),
        (
            lambda: retarget_trajectories(
                joints, controls, path, constraints=[velocity_constraint(0, 0, (0.0, 0.0, 0.0))]
            ),
            "constraint 0 names frame -1 of joint 0, but there are 9 frames of 2 joints",
        ),
        (
            lambda: retarget_trajectories(
                joints, controls, path, constraints=[position_constraint(1, 1, ())]
            ),
            "a value for each of the axes",
        ),
        (
            lambda: retarget_trajectories(
                joints, controls, path, constraints=[Constraint((), (1.0,), (0,))]
            ),
            "at least one position and axis in constraint 0",
        ),
        (
            lambda: retarget_trajectories(
                joints, controls, path, constraints=[position_constraint(1, 1, (), axes=())]
            ),
            "at least one position and axis in constraint 0",
        ),
    ):
        with pytest.raises(ValueError, match=told):
            wrong()


def test_a_real_dance_stays_within_reach_of_its_examples(shared: Path) -> None:
    """What a puppeteer poses is never quite consistent; the path must not run away between."""
    recording = read_recording(shared / "bvh/cmu_daz_salsa_10.bvh")
    poses = np.stack([recording.frame(k).positions for k in range(len(recording))])
    names = [name.lower() for name in recording.skeleton.names]
    ends = [k for k, name in enumerate(names) if name in ("lhand", "rhand", "lfoot", "rfoot")]
    path = (poses - poses[:, :1])[:, ends]
    chosen = most_different_poses(path, 8)
    controls = path[chosen] * [0.5, 1.5, 0.3]
    controls += np.random.default_rng(0).normal(scale=0.05, size=controls.shape)
    found = retarget_trajectories(path[chosen], controls, path)
    middle = controls.mean(axis=0)
    reach = np.linalg.norm(controls - middle, axis=2).max(axis=0)
    assert (np.linalg.norm(found - middle, axis=2).max(axis=0) < 1.5 * reach).all()
    missed = np.linalg.norm(found[chosen] - controls, axis=2)
    assert np.median(missed) < 0.15 * reach.max()
