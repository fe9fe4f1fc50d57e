"""Heat from bones gives skin weights that stay within a limb and blend at its joints."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from solvers.surface.heat_weights import is_rigid, skin_of_heat, skin_of_rigid_weights
from solvers.surface.skin_weights import Skin
from tests.solvers.bars import bar

VERTICES, FACES = bar(rings=80)
PARENTS = np.array([-1, 0, 1])
NODES = np.array([[0.1, 0.0, 0.0], [2.0, 0.0, 0.0], [3.9, 0.0, 0.0]])


def dense(skin: Skin, count: int) -> np.ndarray:
    """The weights (N, K) of all nodes."""
    weights = np.zeros((len(skin.nodes), count))
    np.add.at(weights, (np.arange(len(weights))[:, None], skin.nodes), skin.weights)
    return weights


def test_a_limb_follows_one_bone_far_from_joints_and_both_at_a_joint() -> None:
    weights = dense(skin_of_heat(VERTICES, FACES, PARENTS, NODES), 3)
    x = VERTICES[:, 0]
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert weights.min() >= 0.0
    assert weights[x < 0.8, 0].min() > 0.9
    assert weights[x > 3.2, 1].min() > 0.9, "the bone belongs to the node at which it starts"
    np.testing.assert_allclose(weights[abs(x - 2.0) < 0.03, 0], 0.5, atol=0.05)
    assert weights[:, 2].max() == 0.0, "no bone starts at a tip"
    ring = x.round(6)
    for at in np.unique(ring):
        assert np.ptp(weights[ring == at, 0]) < 1e-4, "alike around the limb"


def test_a_mirrored_surface_has_mirrored_weights() -> None:
    random = np.random.default_rng(3)
    lumpy = VERTICES + random.normal(0.0, 0.01, VERTICES.shape)
    mirror = np.array([1.0, 1.0, -1.0])
    nodes = NODES + np.array([[0.0, 0.0, 0.1], [0.0, 0.05, -0.1], [0.0, 0.0, 0.0]])
    first = skin_of_heat(lumpy, FACES, PARENTS, nodes)
    second = skin_of_heat(lumpy * mirror, FACES[:, ::-1], PARENTS, nodes * mirror)
    np.testing.assert_allclose(dense(first, 3), dense(second, 3), atol=1e-5)


def test_size_does_not_matter() -> None:
    first = dense(skin_of_heat(VERTICES, FACES, PARENTS, NODES), 3)
    for scale in (1e-6, 1e6):
        again = dense(skin_of_heat(scale * VERTICES, FACES, PARENTS, scale * NODES), 3)
        np.testing.assert_allclose(again, first, atol=1e-6)


def folded_bar() -> tuple[np.ndarray, np.ndarray]:
    """The bar bent to a U around x = 2, so that its halves lie side by side, nearly touching."""
    x, y, z = VERTICES.T
    angle = np.clip((x - 1.2) / 1.6, 0.0, 1.0) * np.pi
    centre = np.where(x < 2.0, np.minimum(x, 1.2), 1.2 - np.maximum(x - 2.8, 0.0))
    radius = 0.52 - y
    u_shape = np.stack([centre + np.sin(angle) * radius, 0.52 - np.cos(angle) * radius, z], axis=1)
    return u_shape, FACES


def test_heat_does_not_jump_across_a_gap() -> None:
    """A bone along one leg of a U lies nearer to the inside of the other leg than its own bone."""
    vertices, faces = folded_bar()
    nodes = np.array([[1.9, 0.52, 0.0], [1.1, 0.35, 0.0], [0.0, 0.35, 0.0], [1.1, 1.45, 0.0],
                      [0.0, 1.45, 0.0]])  # fmt: skip
    weights = dense(skin_of_heat(vertices, faces, np.array([-1, 0, 1, 0, 3]), nodes), 5)
    inner = (vertices[:, 0] < 0.6) & (VERTICES[:, 0] > 2.0) & (VERTICES[:, 1] > 0.45)
    own, other = (abs(vertices[inner, 1] - y) for y in (1.45, 0.35))
    assert inner.sum() > 10
    assert (other < own).all(), "the other leg's bone is nearer"
    assert weights[inner, 1].max() < 0.03
    assert weights[inner, 3].min() > 0.7


@pytest.mark.parametrize("faces", [FACES, FACES[:, ::-1]], ids=["outward", "inward"])
def test_a_bone_outside_the_body_heats_no_skin(faces: np.ndarray) -> None:
    """The bone of a thumb may stick out of a hand that hangs beside a hip."""
    above = VERTICES[:, 1].max() + 0.05
    nodes = np.vstack([NODES, [[0.6, above, 0.0], [1.4, above, 0.0]]])
    weights = dense(skin_of_heat(VERTICES, faces, np.array([-1, 0, 1, 0, 3]), nodes), 5)
    assert weights[:, 3].max() < 1e-6


def test_parts_that_see_no_bone_follow_the_nearest_one_rigidly() -> None:
    small = 0.02 * VERTICES + [3.0, 0.7, 0.0]
    vertices = np.concatenate([VERTICES, small, [[0.5, 0.6, 0.0]]])  # and a vertex without a face
    faces = np.concatenate([FACES, FACES + len(VERTICES)])
    weights = dense(skin_of_heat(vertices, faces, PARENTS, NODES), 3)
    pea = weights[len(VERTICES) : -1]
    np.testing.assert_allclose(pea, np.broadcast_to(pea[0], pea.shape), atol=1e-3)
    assert pea[0].argmax() == 1
    np.testing.assert_allclose(weights[-1], [1.0, 0.0, 0.0], atol=1e-6)


def broken_surfaces() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    keep = FACES[VERTICES[FACES].mean(axis=1)[:, 1] > 0.0]  # open: half of the bar
    fin = np.array([[2.0, 0.5, 0.0], [2.3, 0.5, 0.0], [2.1, 0.9, 0.0]])
    flat = VERTICES * [1.0, 1.0, 0.0]
    return {
        "open": (VERTICES, keep),
        "non-manifold": (
            np.vstack([VERTICES, fin]),
            np.vstack([FACES, FACES[:5, ::-1], [[0, 1, len(VERTICES)]], [[7, 7, 7]]]),
        ),
        "flat": (flat, FACES),
        "no faces": (VERTICES, np.zeros((0, 3), dtype=np.int64)),
        "one point": (np.zeros((4, 3)), np.array([[0, 1, 2], [0, 2, 3]])),
    }


@pytest.mark.parametrize("name", broken_surfaces())
@pytest.mark.parametrize("nodes", [NODES, 0.0 * NODES, NODES + 10.0])
def test_broken_surfaces_get_finite_weights(name: str, nodes: np.ndarray) -> None:
    vertices, faces = broken_surfaces()[name]
    skin = skin_of_heat(vertices, faces, PARENTS, nodes)
    assert np.isfinite(skin.weights).all()
    assert (skin.weights >= 0.0).all()
    np.testing.assert_allclose(skin.weights.sum(axis=1), 1.0, atol=1e-9)
    assert (skin.nodes >= 0).all()


def test_a_single_node_moves_everything() -> None:
    skin = skin_of_heat(VERTICES, FACES, np.array([-1]), np.zeros((1, 3)))
    assert (dense(skin, 1) == 1.0).all()


def one_node(owner: np.ndarray, count: int) -> csr_array:
    """Weights (N, count) by which each vertex follows one node alone."""
    rows = np.arange(len(owner))
    return csr_array((np.ones(len(owner)), (rows, owner)), shape=(len(owner), count))


def test_rigid_weights_are_spread_where_the_surface_goes_on() -> None:
    x = VERTICES[:, 0]
    rigid = one_node((x > 2.0).astype(np.int64), 3)
    assert is_rigid(rigid)
    weights = dense(skin_of_rigid_weights(VERTICES, FACES, rigid), 3)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert weights[x < 1.2, 1].max() < 0.01
    assert weights[x > 2.8, 1].min() > 0.99
    middle = weights[np.abs(x - 2.0) < 0.06, 1]
    assert ((middle > 0.2) & (middle < 0.8)).all()


def test_rigid_parts_that_are_apart_stay_rigid() -> None:
    both = np.concatenate([VERTICES, VERTICES + np.array([9.0, 0.0, 0.0])])
    owner = np.repeat([0, 2], len(VERTICES))
    faces = np.concatenate([FACES, FACES + len(VERTICES)])
    weights = dense(skin_of_rigid_weights(both, faces, one_node(owner, 3)), 3)
    np.testing.assert_allclose(weights[np.arange(len(owner)), owner], 1.0)


def test_a_thick_trunk_keeps_its_flank_from_a_thin_limb_that_begins_inside_it() -> None:
    """A bone from the middle of a bar to its side: the nearest one, but a thin one."""
    nodes = np.array([[0.1, 0.0, 0.0], [2.0, 0.0, 0.0], [3.9, 0.0, 0.0], [2.0, 0.15, 0.0],
                      [2.0, 0.3, 0.0]])  # fmt: skip
    parents = np.array([-1, 0, 1, 1, 3])
    alike = dense(skin_of_heat(VERTICES, FACES, parents, nodes), 5)
    radii = np.array([1.0, 1.0, 1.0, 0.2, 0.2])
    thin = dense(skin_of_heat(VERTICES, FACES, parents, nodes, radii), 5)
    beside = (abs(VERTICES[:, 0] - 2.0) < 0.3) & (VERTICES[:, 1] > 0.0)
    assert alike[beside, 3].max() > 0.3
    assert thin[beside, 3].max() < 0.5 * alike[beside, 3].max()
    every = dense(skin_of_heat(VERTICES, FACES, parents, nodes, np.full(5, 3.0)), 5)
    np.testing.assert_allclose(every, alike, atol=1e-6)
