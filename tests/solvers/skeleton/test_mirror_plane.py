"""Mirror planes: found whichever way a body is turned, and paired limbs across them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.skeleton.limbs import surface_points
from solvers.skeleton.mirror_pairs import mirrored_tree
from solvers.skeleton.mirror_plane import SYMMETRIC, MirrorPlane, mirror_planes
from solvers.skeleton.rejoined import rejoined
from solvers.skeleton.tree import Tree
from tests.runtime.capsule_bodies import DOG, MOUSE, CapsuleBody, capsule_body
from tests.thorough import combined

ACROSS = MirrorPlane(np.array([1.0, 0.0, 0.0]), 0.0, 0.0)


def planes(body: CapsuleBody, count: int = 3) -> list[MirrorPlane]:
    return mirror_planes(surface_points(body.vertices, body.faces), count)


@pytest.mark.parametrize(
    ("name", "yaw", "scale"),
    combined(["mouse", "dog"], [0.0, 20.0, 90.0, 130.0], [1e-3, 1.0, 1e3]),
)
def test_the_plane_of_a_turned_body_is_found(name: str, yaw: float, scale: float) -> None:
    branches = {"mouse": MOUSE, "dog": DOG}[name]
    rotation = Rotation.from_euler("y", yaw, degrees=True).as_matrix()
    shift = np.array([2.0, 1.0, -3.0])
    body = capsule_body(branches).moved(scale * rotation, scale * shift)
    plane = planes(body)[0]
    assert abs(plane.normal @ rotation[:, 0]) > np.cos(np.radians(2.0))
    assert plane.distance(scale * shift[None])[0] == pytest.approx(0.0, abs=0.02 * scale)
    assert plane.asymmetry < SYMMETRIC / 4


def test_a_mirror_image_of_a_mirror_image_is_the_point_itself() -> None:
    plane = MirrorPlane(np.array([0.6, 0.0, -0.8]), 0.3, 0.0)
    points = np.random.default_rng(0).normal(size=(20, 3))
    images = plane.mirrored(points)
    np.testing.assert_allclose(plane.mirrored(images), points)
    np.testing.assert_allclose(plane.distance(images), -plane.distance(points))


def test_a_lopsided_heap_is_not_symmetric() -> None:
    points = np.random.default_rng(1).random((3000, 3)) * [1.0, 1.0, 0.2]
    points = points[points[:, 1] < 0.2 + 0.8 * points[:, 0] * points[:, 2] / 0.2]
    points[:600] = points[:600] * 0.2 + [1.5, 0.0, 0.7]
    assert all(plane.asymmetry > SYMMETRIC for plane in mirror_planes(points, 4))


def test_limbs_are_paired_and_the_middle_line_joins_them() -> None:
    body = capsule_body(MOUSE)
    halves = mirrored_tree(body.tree, ACROSS, 2.0)
    pairs = [{body.branch[chain[-1]] for chain in pair.chains} for pair in halves.pairs]
    assert pairs == [{"leg.L", "leg.R"}, {"arm.L", "arm.R"}, {"ear.L", "ear.R"}]
    assert all(body.branch[pair.chains[0][-1]].endswith("L") for pair in halves.pairs)
    assert all(pair.cost < 1e-9 for pair in halves.pairs)
    assert {body.branch[node] for node in halves.middle} == {"trunk", "head", "tail"}
    assert {body.branch[node] for node in halves.ends} == {"head", "tail"}


def test_a_leg_that_hangs_on_the_other_foot_is_hung_on_the_trunk() -> None:
    right = [(-0.02, 0.8, 0.0), (-0.12, 0.55, 0.0), (-0.13, 0.3, 0.0), (-0.1, 0.05, 0.0)]
    left = [(-x, y, z) for x, y, z in reversed(right)]
    above = [(0.0, y, 0.0) for y in (3.0, 2.4, 1.8, 1.2, 0.85)]  # far more than legs
    tree = Tree(np.arange(-1, 12), np.array([*above, *right, *left[:3], (0.1, 0.75, 0.0)]))
    parents = rejoined(tree, ACROSS, 3.0)
    assert parents is not None
    assert parents[9] == 10  # the sole hangs on its own leg
    assert parents[8] == 7
    assert parents[12] in (4, 5)  # and the hip on the trunk
    assert rejoined(Tree(parents, tree.positions), ACROSS, 3.0) is None


@pytest.mark.parametrize("branches", [MOUSE, DOG], ids=["mouse", "dog"])
def test_a_sound_tree_stays_as_it_is(branches) -> None:
    assert rejoined(capsule_body(branches).tree, ACROSS, 2.0) is None
