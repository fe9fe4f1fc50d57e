"""Stiff segments of a surface along its skeleton: the joints and the rigidity."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.deform.stiff_segments import StiffSegments, find_stiff_segments
from tests.solvers.bars import bar


def along_x(*x: float, bend: tuple[float, float] | None = None) -> np.ndarray:
    """Nodes on the bar's axis; from x = bend[0] on they rise by bend[1] a unit."""
    points = np.stack([np.array(x), np.zeros(len(x)), np.zeros(len(x))], axis=1)
    if bend is not None:
        points[:, 1] = np.maximum(points[:, 0] - bend[0], 0.0) * bend[1]
    return points


def chain(points: np.ndarray) -> np.ndarray:
    return np.arange(len(points)) - 1


def cut(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> StiffSegments:
    inside = np.zeros(len(points), dtype=bool)
    return find_stiff_segments(vertices, faces, chain(points), points, inside)


def borders(articulation: StiffSegments, vertices: np.ndarray) -> list[float]:
    """Where along x one region ends and the next begins."""
    order = np.argsort(vertices[:, 0], kind="stable")
    region, x = articulation.region_of[order], vertices[order, 0]
    change = np.flatnonzero(region[1:] != region[:-1])
    return [float(0.5 * (x[i] + x[i + 1])) for i in change]


@pytest.mark.parametrize("elbow", [1.3, 1.8, 2.6])
def test_a_rigs_elbow_is_a_joint(elbow: float) -> None:
    vertices, faces = bar()
    found = cut(along_x(-0.1, elbow, 4.1), vertices, faces)
    assert found.region_of.max() == 1
    assert borders(found, vertices) == pytest.approx([elbow], abs=0.11)


def test_a_curve_skeleton_bends_where_it_turns_most() -> None:
    vertices, faces = bar()
    bend = 1.75
    nodes = along_x(*np.arange(0.0, 4.01, 0.25), bend=(bend, 0.5))
    surface = vertices + np.maximum(vertices[:, :1] - bend, 0.0) * [0.0, 0.5, 0.0]
    assert any(abs(x - bend) < 0.15 for x in borders(cut(nodes, surface, faces), vertices))


def test_no_segment_is_so_short_that_nothing_of_it_is_stiff() -> None:
    vertices, faces = bar()
    found = cut(along_x(*np.arange(0.0, 4.01, 0.1)), vertices, faces)
    joints = [0.0, *borders(found, vertices), 4.0]
    assert len(joints) == 4
    assert np.diff(joints).min() > 2.3 * 0.5
    for region in range(found.region_of.max() + 1):
        assert found.rigidity[found.region_of == region].max() == 1.0


def test_rigidity_falls_to_zero_within_a_radius_of_the_joint() -> None:
    vertices, faces = bar(160, 48)
    rigidity = cut(along_x(-0.1, 2.0, 4.1), vertices, faces).rigidity
    gap = abs(vertices[:, 0] - 2.0)
    assert rigidity[gap < 0.03].max() < 0.05
    assert rigidity[gap > 0.56].min() == 1.0
    assert rigidity.min() == 0.0
    middle = rigidity[abs(gap - 0.25) < 0.02]
    np.testing.assert_allclose(middle, 0.5, atol=0.15)
    a, b = faces[:, 0], faces[:, 1]
    assert abs(rigidity[a] - rigidity[b]).max() < 0.25  # smoothly


def test_short_bones_inside_the_body_are_one_trunk() -> None:
    """A cross: four arms that meet in the middle, their first bones inside the body."""
    vertices, faces = bar(81, 16)
    other = vertices[:, [1, 0, 2]] - [-2.0, 2.0, 0.0]
    points = np.concatenate([vertices, other])
    triangles = np.concatenate([faces, faces[:, ::-1] + len(vertices)])
    directions = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    nodes = [[2.0, 0, 0]]
    parents = [-1]
    inside = [False]
    for direction in directions:
        for step, reach in enumerate((0.6, 2.0)):
            parents.append(0 if step == 0 else len(nodes) - 1)
            nodes.append((np.array([2.0, 0, 0]) + reach * direction).tolist())
            inside.append(step == 0)
    found = find_stiff_segments(
        points, triangles, np.array(parents), np.array(nodes), np.array(inside)
    )
    reach = np.linalg.norm(points - [2.0, 0, 0], axis=1)
    trunk = np.unique(found.region_of[reach < 0.5])
    assert len(trunk) == 1
    for direction in directions:
        tip = (points - [2.0, 0, 0]) @ direction > 0.8
        region = np.unique(found.region_of[tip])
        assert len(region) == 1
        assert region[0] != trunk[0]
    assert found.region_of.max() == 4


def test_what_a_rig_says_goes_before_what_is_near() -> None:
    vertices, faces = bar()
    nodes = along_x(-0.1, 2.0, 4.1)
    bone = np.where(vertices[:, 0] > 3.0, 2, 1)
    inside = np.zeros(3, dtype=bool)
    found = find_stiff_segments(vertices, faces, chain(nodes), nodes, inside, bone)
    assert borders(found, vertices) == pytest.approx([3.0], abs=0.11)


def test_a_stray_patch_joins_what_it_lies_in() -> None:
    vertices, faces = bar()
    nodes = along_x(-0.1, 2.0, 4.1)
    bone = np.where(vertices[:, 0] > 2.0, 2, 1)
    bone[np.linalg.norm(vertices - [3.2, 0.5, 0.0], axis=1) < 0.25] = 1
    inside = np.zeros(3, dtype=bool)
    found = find_stiff_segments(vertices, faces, chain(nodes), nodes, inside, bone)
    assert len(np.unique(found.region_of[vertices[:, 0] > 2.1])) == 1


def test_one_node_or_no_face_is_one_region() -> None:
    vertices, faces = bar()
    root = np.array([-1])
    found = find_stiff_segments(vertices, faces, root, np.zeros((1, 3)), np.zeros(1, dtype=bool))
    assert (found.region_of == 0).all()
    assert (found.rigidity == 1.0).all()
    nothing = np.zeros((0, 3), dtype=np.int64)
    nodes = along_x(-0.1, 2.0, 4.1)
    loose = find_stiff_segments(vertices, nothing, chain(nodes), nodes, np.zeros(3, dtype=bool))
    assert loose.region_of.max() == 1
    assert (loose.rigidity == 1.0).all()


def test_the_numbering_of_vertices_does_not_matter() -> None:
    vertices, faces = bar()
    nodes = along_x(*np.arange(0.0, 4.01, 0.25), bend=(1.75, 0.3))
    found = cut(nodes, vertices, faces)
    name = np.random.default_rng(2).permutation(len(vertices))
    renamed = np.empty_like(vertices)
    renamed[name] = vertices
    other = cut(nodes, renamed, name[faces])
    assert (other.region_of[name] == found.region_of).all()
    np.testing.assert_allclose(other.rigidity[name], found.rigidity, atol=1e-12)
