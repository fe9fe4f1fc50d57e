"""A skinned surface follows its nodes: rigidly where they agree, without collapse where not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.deform.skinning import SkinnedSurface
from solvers.surface.skin_weights import Skin
from tests.solvers.bars import bar

VERTICES, _ = bar()
NODES = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
SHARE = np.clip(VERTICES[:, 0] / 2.0 - 0.5, 0.0, 1.0)  # of the second node, along the bar
SKIN = Skin(np.tile([0, 1], (len(VERTICES), 1)), np.stack([1.0 - SHARE, SHARE], axis=1))
SURFACE = SkinnedSurface(VERTICES, NODES, SKIN)
UNTURNED = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))


def test_at_rest_nothing_moves() -> None:
    np.testing.assert_allclose(SURFACE.place(NODES, UNTURNED), VERTICES, atol=1e-14)


def test_nodes_that_move_as_one_move_the_surface_rigidly() -> None:
    turn = Rotation.from_rotvec([2.0, -1.0, 1.5])
    away = np.array([3.0, -2.0, 1.0])
    rotations = np.stack([turn.as_quat(), -3.0 * turn.as_quat()])  # both mean the same rotation
    placed = SURFACE.place(turn.apply(NODES) + away, rotations)
    np.testing.assert_allclose(placed, turn.apply(VERTICES) + away, atol=1e-13)


def test_a_twisted_bar_keeps_its_radius() -> None:
    """Linear blending would leave 71 % of it halfway between two nodes a right angle apart."""
    quarter = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0])
    placed = SURFACE.place(NODES, np.stack([UNTURNED[0], quarter.as_quat()]))
    radius = np.linalg.norm(VERTICES[:, 1:], axis=1)
    np.testing.assert_allclose(np.linalg.norm(placed[:, 1:], axis=1), radius, atol=1e-14)
    np.testing.assert_allclose(placed[:, 0], VERTICES[:, 0], atol=1e-14)
    # the angle of the normalised blend (1 - s) + s (cos 45, sin 45)
    angle = 2.0 * np.arctan2(SHARE * np.sin(np.pi / 4), 1.0 - SHARE + SHARE * np.cos(np.pi / 4))
    expected = Rotation.from_rotvec(angle[:, None] * [1.0, 0.0, 0.0]).apply(VERTICES)
    np.testing.assert_allclose(placed, expected, atol=1e-14)


def test_a_node_turns_what_follows_it_about_itself() -> None:
    turn = Rotation.from_rotvec([0.0, 0.0, 1.2])
    placed = SURFACE.place(NODES, np.stack([UNTURNED[0], turn.as_quat()]))
    beyond, before = SHARE == 1.0, SHARE == 0.0
    np.testing.assert_allclose(placed[before], VERTICES[before], atol=1e-14)
    turned = turn.apply(VERTICES[beyond] - NODES[1]) + NODES[1]
    np.testing.assert_allclose(placed[beyond], turned, atol=1e-14)


def test_the_four_strongest_of_many_nodes_count() -> None:
    rest = np.zeros((6, 3))
    weights = np.array([[0.02, 0.3, 0.3, 0.03, 0.2, 0.15]])
    surface = SkinnedSurface(np.ones((1, 3)), rest, Skin(np.arange(6)[None], weights))
    moved = np.zeros((6, 3))
    moved[[0, 3]] = 100.0
    np.testing.assert_allclose(surface.place(moved, np.tile(UNTURNED[0], (6, 1))), 1.0)
    moved[1] = 1.0
    placed = surface.place(moved, np.tile(UNTURNED[0], (6, 1)))
    np.testing.assert_allclose(placed, 1.0 + 0.3 / 0.95)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8)])
def test_no_vertex_leaps_where_nodes_pass_half_a_turn(axis: tuple[float, float, float]) -> None:
    steps = []
    before = None
    for degrees in np.arange(140.0, 221.0, 2.0):
        turn = Rotation.from_rotvec(np.radians(degrees) * np.array(axis))
        placed = SURFACE.place(NODES, np.stack([UNTURNED[0], turn.as_quat()]))
        if before is not None:
            steps.append(float(np.linalg.norm(placed - before, axis=1).max()))
        before = placed
    assert max(steps) < 5.0 * steps[0]  # of the blend alone: over 50 times


def test_a_weight_that_hardly_counts_changes_nothing_near_half_a_turn() -> None:
    weights = np.array([[1.0 - 1e-9, 1e-9]])
    surface = SkinnedSurface(np.ones((1, 3)), NODES, Skin(np.array([[0, 1]]), weights))
    half = Rotation.from_rotvec([0.0, np.pi, 0.0])
    placed = surface.place(NODES, np.stack([UNTURNED[0], half.as_quat()]))
    np.testing.assert_allclose(placed, 1.0, atol=1e-7)
