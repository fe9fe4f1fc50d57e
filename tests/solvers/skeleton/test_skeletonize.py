"""Curve skeletons: closed forms, invariants, hostile surfaces, and real characters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from runtime.characters.formats.mesh_file import read_mesh_file
from solvers.retarget.abstraction import abstract
from solvers.skeleton.curve_tree import MOST_NODES
from solvers.skeleton.skeletonize import extract_skeleton
from solvers.skeleton.tree import Tree
from solvers.surface.voxel_solid import surface_samples, voxel_solid
from tests.thorough import third_of

pytest.importorskip("pygel3d")
pytest.importorskip("fast_simplification")

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]


def _skeleton(mesh: Mesh) -> Tree:
    """The skeleton as a tree, which refuses what is none, checked for what always holds."""
    parents, positions = extract_skeleton(*mesh)
    tree = Tree(parents, positions)
    assert parents.dtype == np.int64
    assert 2 <= len(tree) <= MOST_NODES
    assert (parents < np.arange(len(parents))).all()
    assert abstract(tree).root == tree.root
    return tree


def _tube(length: float, radius: float, rings: int = 40, sides: int = 12) -> Mesh:
    """A capped tube along x from 0 to `length`."""
    turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    ring = np.stack([np.zeros(sides), np.cos(turn), np.sin(turn)], axis=1) * radius
    along = np.linspace(0.0, length, rings)
    tips = np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]])
    vertices = np.concatenate([ring + np.array([x, 0.0, 0.0]) for x in along] + [tips])
    this = np.arange(sides)
    after = (this + 1) % sides
    walls = [
        np.concatenate(
            [
                np.stack([this, after, after + sides], axis=1),
                np.stack([this, after + sides, this + sides], axis=1),
            ]
        )
        + sides * k
        for k in range(rings - 1)
    ]
    last = sides * (rings - 1)
    ends = np.full(sides, sides * rings)
    caps = [np.stack([after, this, ends], axis=1)]
    caps += [np.stack([this + last, after + last, ends + 1], axis=1)]
    return vertices, np.concatenate(walls + caps)


def _capsules(tips: ArrayLike, radii: ArrayLike) -> Mesh:
    """Overlapping capsules from the origin to each tip: closed pieces, nothing cut."""
    pieces = []
    for tip, radius in zip(np.array(tips, dtype=float), np.array(radii), strict=True):
        piece = trimesh.creation.capsule(height=float(np.linalg.norm(tip)), radius=radius)
        piece.apply_translation([0.0, 0.0, -radius - piece.bounds[0, 2]])
        piece.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], tip))
        pieces.append(piece)
    whole = trimesh.util.concatenate(pieces)
    return np.asarray(whole.vertices), np.asarray(whole.faces, dtype=np.int64)


def _limbs(tree: Tree, share: float = 0.2) -> int:
    """Leaves that are left when this share of the tree's height is cut off every limb.

    Hands and heads then are the one limb that carries them.
    """
    kept = tree.heights >= share * tree.heights[tree.root]
    return sum(kept[k] and not kept[list(below)].any() for k, below in enumerate(tree.children))


def test_a_tube_becomes_its_axis_from_tip_to_tip() -> None:
    tree = _skeleton(_tube(10.0, 0.5))
    assert len(tree.leaves) == 2
    assert tree.degree.max() == 2
    np.testing.assert_allclose(tree.positions[:, 1:], 0.0, atol=0.3)
    ends = np.sort(tree.positions[list(tree.leaves), 0])
    np.testing.assert_allclose(ends, [0.0, 10.0], atol=0.1)
    bones = np.delete(tree.bone_lengths, tree.root)
    assert bones.max() < 1.5 * bones.min()


TIPS = np.array([[0.0, 4.0, 0.0], [3.0, -3.0, 0.0], [-3.0, -3.0, 0.5]])


@pytest.fixture(scope="module")
def of_capsules() -> Tree:
    return _skeleton(_capsules(TIPS, [0.4] * 3))


def test_three_capsules_become_one_branch_node_with_a_limb_to_each_tip(of_capsules: Tree) -> None:
    tips, tree = TIPS, of_capsules
    assert len(tree.leaves) == 3
    assert np.count_nonzero(tree.degree > 2) == 1
    fork = tree.positions[np.argmax(tree.degree)]
    assert np.linalg.norm(fork) < 0.5
    for tip in tips:
        end = tip * (1.0 + 0.4 / np.linalg.norm(tip))
        assert np.linalg.norm(tree.positions[list(tree.leaves)] - end, axis=1).min() < 0.3
    assert 3 * 3 <= len(tree) - 1 <= 3 * 12


def test_the_loop_of_a_torus_is_opened() -> None:
    torus = trimesh.creation.torus(2.0, 0.4, major_sections=48, minor_sections=12)
    tree = _skeleton((np.asarray(torus.vertices), np.asarray(torus.faces, dtype=np.int64)))
    around = np.hypot(tree.positions[:, 0], tree.positions[:, 1])
    assert np.median(around) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize(("tip", "radius", "limbs"), [(0.7, 0.6, 2), (4.0, 0.3, 3)])
def test_a_bump_is_no_limb_but_a_horn_is(tip: float, radius: float, limbs: int) -> None:
    body = [[5.0, 0.0, 0.0], [-5.0, 0.0, 0.0]]
    tree = _skeleton(_capsules([*body, [0.0, tip, 0.0]], [1.0, 1.0, radius]))
    assert len(tree.leaves) == limbs


def test_two_pieces_apart_are_one_tree() -> None:
    first, faces = _tube(4.0, 0.3)
    vertices = np.concatenate([first, first + np.array([5.0, 0.0, 0.0])])
    tree = _skeleton((vertices, np.concatenate([faces, faces + len(first)])))
    assert np.ptp(tree.positions[:, 0]) > 8.0


def test_a_seam_that_splits_every_vertex_changes_nothing() -> None:
    vertices, faces = _tube(10.0, 0.5)
    split = vertices[faces].reshape(-1, 3)
    split = split + np.random.default_rng(0).uniform(-1e-7, 1e-7, split.shape)  # float32's grain
    whole = _skeleton((vertices, faces))
    apart = _skeleton((split, np.arange(len(split)).reshape(-1, 3)))
    assert len(whole) == len(apart)
    np.testing.assert_allclose(
        np.sort(whole.positions[:, 0]), np.sort(apart.positions[:, 0]), atol=0.3
    )


def test_same_surface_same_bits(of_capsules: Tree) -> None:
    parents, positions = extract_skeleton(*_capsules(TIPS, [0.4] * 3))
    assert parents.tobytes() == of_capsules.parents.tobytes()
    assert positions.tobytes() == of_capsules.positions.tobytes()


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_rigid_motion_and_scale_carry_the_skeleton_along(scale: float) -> None:
    vertices, faces = _tube(10.0, 0.5)
    rest = _skeleton((vertices, faces))
    turn, offset = Rotation.from_rotvec([0.4, -1.1, 0.7]), np.array([3.0, -2.0, 9.0])
    moved = _skeleton((scale * (turn.apply(vertices) + offset), faces))
    back = turn.inv().apply(moved.positions / scale - offset)
    assert len(moved.leaves) == len(rest.leaves)
    for points, others in ((back, rest.positions), (rest.positions, back)):
        gaps = np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1)
        assert gaps.max() < 1.0


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    extract_skeleton(*_tube(10.0, 0.5))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        pytest.param([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], id="one triangle"),
        pytest.param([[0, 0, 0]], [[0, 0, 0]], id="one point"),
        pytest.param([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], id="a line"),
        pytest.param([[1e100, 0, 0], [-1e100, 0, 0], [0, 1e100, 0]], [[0, 1, 2]], id="huge"),
        pytest.param([[1e-320, 0, 0], [0, 0, 0], [0, 1e-320, 0]], [[0, 1, 2]], id="denormal"),
        pytest.param([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan] * 3], [[0, 1, 2]], id="unused"),
    ],
)
def test_a_lump_becomes_a_short_straight_chain(
    vertices: list[list[float]], faces: list[list[int]]
) -> None:
    tree = _skeleton((np.array(vertices, dtype=np.float64), np.array(faces)))
    assert 3 <= len(tree) <= 5
    assert len(tree.leaves) == 2


def test_a_cube_becomes_a_short_chain_across_it() -> None:
    box = trimesh.creation.box((1.0, 1.0, 3.0))
    tree = _skeleton((np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int64)))
    np.testing.assert_allclose(np.ptp(tree.positions, axis=0), [0.0, 0.0, 3.0], atol=1e-9)


def test_no_face_and_positions_that_are_not_finite_are_refused() -> None:
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, np.inf, 0.0]])
    with pytest.raises(ValueError, match="not to be empty"):
        extract_skeleton(vertices, np.empty((0, 3), dtype=np.int64))
    with pytest.raises(ValueError, match="finite"):
        extract_skeleton(vertices, np.array([[0, 1, 2]]))


@settings(max_examples=6, deadline=None)
@example(13, 1799548, 0.015625, False)  # specks, more of them at one end
@given(st.integers(1, 40), st.integers(0, 2**32 - 1), st.floats(0.001, 1.0), st.booleans())
def test_any_soup_gives_a_tree(faces: int, seed: int, size: float, flat: bool) -> None:
    random = np.random.default_rng(seed)
    middles = random.uniform(-1.0, 1.0, (faces, 1, 3))
    vertices = (middles + size * random.normal(size=(faces, 3, 3))).reshape(-1, 3)
    vertices[:, 2] *= not flat
    corners = random.integers(0, len(vertices), (faces, 3)) if seed % 2 else None
    own = np.arange(3 * faces).reshape(-1, 3)
    tree = _skeleton((vertices, own if corners is None else corners))
    size = np.ptp(vertices, axis=0).max()
    assert np.abs(tree.positions).max() <= np.abs(vertices).max() + 0.1 * size


def test_a_sheet_of_paper_is_one_chain_or_few_limbs() -> None:
    x, y = np.meshgrid(np.linspace(0, 4, 41), np.linspace(0, 0.5, 6), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    grid = np.arange(x.size).reshape(x.shape)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    faces = np.concatenate(
        [np.stack([p.ravel() for p in t], axis=1) for t in ((a, b, c), (a, c, d))]
    )
    tree = _skeleton((vertices, faces))
    assert len(tree.leaves) == 2
    assert np.ptp(tree.positions[:, 0]) > 3.4
    assert (tree.positions[:, 2] == 0.0).all()


def test_samples_cover_a_triangle_at_the_spacing() -> None:
    points = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 2.0, 1.0]])
    samples = surface_samples(points, np.array([[0, 1, 2]]), 0.2)
    weights = np.random.default_rng(0).dirichlet([1.0, 1.0, 1.0], 200)
    gaps = np.linalg.norm(weights @ points - samples[:, None], axis=2).min(axis=0)
    assert gaps.max() <= 0.2
    np.testing.assert_allclose(samples @ [0.0, -1.0, 2.0], 0.0, atol=1e-12)


def test_a_box_without_a_floor_is_solid_and_closed() -> None:
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    faces = np.asarray(box.faces, dtype=np.int64)[box.face_normals[:, 2] > -0.5]
    solid = voxel_solid(np.asarray(box.vertices), faces)
    assert solid.voxels.sum() * solid.size**3 == pytest.approx(6.0, rel=0.12)
    closed = trimesh.Trimesh(*solid.closed_surface(), process=False)
    assert closed.is_watertight
    assert closed.volume == pytest.approx(6.0, rel=0.15)


@pytest.mark.parametrize(
    ("name", "limbs", "leaves"),
    third_of(
        [
            ("mesh/cgal_man.off", 5, 17),  # fingers, toes and features of the face are leaves
            ("mesh/cow.off", 6, 11),  # four legs, tail, head with ears and horns
            ("mesh/camel_b.obj", 6, 14),  # knees that touch in a point
            ("mesh/woody_planar.obj", 5, 5),
            ("mesh/octopus-low.mesh", 8, 8),
            ("mesh/decimated-knight.off", 5, 9),
            ("mesh/cat_dt/cat_reference.obj", 6, 8),
            ("mesh/cgal_cactus.off", 4, 4),
        ]
    ),
)
def test_real_characters_have_their_limbs(shared: Path, name: str, limbs: int, leaves: int) -> None:
    mesh = read_mesh_file(shared / name)
    tree = _skeleton((mesh.vertices, mesh.faces))
    assert _limbs(tree) == limbs
    assert len(tree.leaves) <= leaves


@pytest.mark.parametrize(
    "name", third_of(["cgal_elephant-with-holes.off", "truck.obj", "teapot.obj"])
)
def test_broken_real_surfaces_have_few_limbs_inside(shared: Path, name: str) -> None:
    mesh = read_mesh_file(shared / "mesh" / "bad" / name)
    tree = _skeleton((mesh.vertices, mesh.faces))
    assert 2 <= len(tree.leaves) <= 14
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    margin = 0.02 * (high - low).max()
    assert (tree.positions >= low - margin).all()
    assert (tree.positions <= high + margin).all()
