"""Limbs and trunk: a T of capsules, a tentacle, and the limits of what may count as trunk."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from solvers.skeleton.limbs import KEPT, bones_in_trunk, closest_bones, limbs, surface_points

# A thick upright trunk with two thin arms that a curve skeleton lets begin in its middle.
T_PARENTS = np.array([-1, 0, 1, 1, 3, 4, 5, 6, 1, 8, 9, 10, 11])
ARM = [0.13, 0.27, 0.5, 0.72, 0.95]
T_NODES = np.array(
    [[0.0, 0.0, 0.0], [0.0, 0.7, 0.0], [0.0, 1.1, 0.0]]
    + [[x, 0.7, 0.0] for x in ARM]
    + [[-x, 0.7, 0.0] for x in ARM]
)
IN_TRUNK = [3, 4, 8, 9]  # the arms' bones up to the trunk's side, at 0.25


def capsule(start: list[float], end: list[float], radius: float) -> trimesh.Trimesh:
    a, b = np.array(start), np.array(end)
    mesh = trimesh.creation.capsule(np.linalg.norm(b - a), radius, count=[12, 12])
    mesh.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], b - a))
    mesh.apply_translation((a + b) / 2.0)
    # Bones need vertices along them, not at the caps only.
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, 0.12)
    return trimesh.Trimesh(vertices, faces, process=True)


@pytest.fixture(scope="module")
def t_shape() -> trimesh.Trimesh:
    return trimesh.util.concatenate(
        [
            capsule([0.0, 0.0, 0.0], [0.0, 1.1, 0.0], 0.25),
            capsule([0.26, 0.7, 0.0], [0.95, 0.7, 0.0], 0.06),
            capsule([-0.26, 0.7, 0.0], [-0.95, 0.7, 0.0], 0.06),
        ]
    )


def test_only_the_first_bones_of_the_arms_lie_in_the_trunk(t_shape: trimesh.Trimesh) -> None:
    inside = bones_in_trunk(t_shape.vertices, t_shape.faces, T_PARENTS, T_NODES)
    assert np.flatnonzero(inside).tolist() == IN_TRUNK


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_size_and_place_do_not_matter(t_shape: trimesh.Trimesh, size: float) -> None:
    moved = size * np.add(t_shape.vertices, [3.0, -2.0, 1.0])
    nodes = size * np.add(T_NODES, [3.0, -2.0, 1.0])
    inside = bones_in_trunk(moved, t_shape.faces, T_PARENTS, nodes)
    assert np.flatnonzero(inside).tolist() == IN_TRUNK


def test_a_limb_is_never_all_trunk(t_shape: trimesh.Trimesh) -> None:
    """A skeleton of ever so many short bones, wherever it lies, keeps its outer share."""
    for points in (
        np.linspace([0.0, 0.7, 0.0], [0.3, 0.7, 0.0], 21),  # hardly leaves the trunk
        np.linspace([0.0, 0.7, 0.0], [0.95, 0.7, 0.0], 21),
        np.linspace([5.0, 5.0, 5.0], [6.0, 5.0, 5.0], 21),  # outside the surface altogether
    ):
        parents = np.arange(len(points)) - 1
        inside = bones_in_trunk(t_shape.vertices, t_shape.faces, parents, points)
        assert np.count_nonzero(inside) <= (1.0 - KEPT) * 20 + 1e-9
        assert not inside[0]
        first_free = np.argmin(inside[1:]) + 1
        assert not inside[first_free:].any(), "only the beginning of a limb is trunk"
    assert inside[1], "where no surface is, there is no limb of its own"


def test_a_plain_tentacle_has_no_trunk() -> None:
    tube = capsule([0.0, 0.0, 0.0], [0.0, 1.5, 0.0], 0.1)
    nodes = np.linspace([0.0, 0.0, 0.0], [0.0, 1.5, 0.0], 7)
    assert not bones_in_trunk(tube.vertices, tube.faces, np.arange(7) - 1, nodes).any()


def test_nodes_on_one_spot_and_a_lone_node_have_no_trunk(t_shape: trimesh.Trimesh) -> None:
    for count in (1, 3):
        nodes = np.zeros((count, 3))
        parents = np.arange(count) - 1
        assert not bones_in_trunk(t_shape.vertices, t_shape.faces, parents, nodes).any()


def test_limbs_reach_from_forks_and_root_to_forks_and_leaves() -> None:
    assert sorted(limbs(T_PARENTS)) == [[0, 1], [1, 2], [1, 3, 4, 5, 6, 7], [1, 8, 9, 10, 11, 12]]
    assert limbs(np.array([-1])) == []
    assert limbs(np.array([1, -1])) == [[1, 0]]
    bones = [bone for limb in limbs(T_PARENTS) for bone in limb[1:]]
    assert sorted(bones) == list(range(1, len(T_PARENTS))), "every bone in one limb"


def test_closest_bones_are_those_of_a_dense_sampling() -> None:
    random = np.random.default_rng(3)
    points = random.uniform(-1.0, 1.5, (300, 3))
    bone, distance = closest_bones(points, T_PARENTS, T_NODES)
    shares = np.linspace(0.0, 1.0, 401)[:, None]
    gaps = np.array(
        [
            np.linalg.norm(
                points[:, None]
                - ((1 - shares) * T_NODES[T_PARENTS[node]] + shares * T_NODES[node]),
                axis=2,
            ).min(axis=1)
            for node in range(1, len(T_NODES))
        ]
    )
    np.testing.assert_allclose(distance, gaps.min(axis=0), atol=2e-3)
    own = gaps[bone - 1, np.arange(len(points))]
    np.testing.assert_allclose(own, gaps.min(axis=0), atol=2e-3)


def test_a_lone_node_is_nearest_to_everything() -> None:
    points = np.array([[0.0, 3.0, 4.0], [1.0, 0.0, 0.0]])
    bone, distance = closest_bones(points, np.array([-1]), np.zeros((1, 3)))
    assert bone.tolist() == [0, 0]
    np.testing.assert_allclose(distance, [5.0, 1.0])


def test_surface_points_are_spread_by_area_and_lie_on_the_surface() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [8, 0, 0], [5, 3, 0]], float)
    faces = np.array([[0, 1, 2], [3, 4, 5]])  # areas 1 : 9
    points = surface_points(vertices, faces)
    np.testing.assert_array_equal(points, surface_points(vertices, faces))
    assert np.mean(points[:, 0] > 3.0) == pytest.approx(0.9, abs=0.001)
    assert np.all(points[:, 2] == 0.0)
    assert points.min() >= 0.0
    flat = np.zeros((3, 3))
    np.testing.assert_array_equal(surface_points(flat, np.array([[0, 1, 2]])), flat)
