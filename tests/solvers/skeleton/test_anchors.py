"""The handles that bind a surface to a skeleton, for surfaces of one or many components."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from runtime.characters.open_character import load_character
from solvers.arap import ArapSolver
from solvers.skeleton.anchors import RING, SPACING, SkeletonBinding, bind
from solvers.skeleton.limbs import closest_bones, limbs


def tube(start: list[float], end: list[float], radius: float, rings: int = 20) -> trimesh.Trimesh:
    """A closed tube of sixteen sides whose rings are jittered, so that no two choices tie."""
    sides, random = 16, np.random.default_rng(7)
    axis = np.subtract(end, start)
    frame = trimesh.geometry.align_vectors([0, 0, 1], axis)[:3, :3]
    along = np.repeat(np.linspace(0.0, 1.0, rings), sides) + random.uniform(-0.01, 0.01, rings * 16)
    angle = np.tile(np.arange(sides) / sides * 2 * np.pi, rings) + random.uniform(
        0, 0.2, rings * 16
    )
    around = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])
    points = np.array(start) + along[:, None] * axis + radius * around @ frame.T
    grid = np.arange(rings * sides).reshape(rings, sides)
    a, b = grid[:-1], grid[1:]
    c, d = np.roll(b, -1, 1), np.roll(a, -1, 1)
    quads = [np.stack([a, d, c], -1).reshape(-1, 3), np.stack([a, c, b], -1).reshape(-1, 3)]
    caps = [grid[0][[0, i + 1, i]] for i in range(1, 15)] + [
        grid[-1][[0, i, i + 1]] for i in range(1, 15)
    ]
    return trimesh.Trimesh(points, np.concatenate([*quads, caps]), process=False)


CHAIN = np.arange(7) - 1
NODES = np.linspace([0.0, 0.0, 0.0], [0.0, 1.5, 0.0], 7)
CROSS_PARENTS = np.array([-1, 0, 1, 0, 3, 4, 0, 6, 7])
CROSS_NODES = np.array(
    [
        [0.0, 0.6, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.4, 0.0],
        [0.12, 0.6, 0.0],
        [0.5, 0.6, 0.0],
        [0.9, 0.6, 0.0],
        [-0.12, 0.6, 0.0],
        [-0.5, 0.6, 0.0],
        [-0.9, 0.6, 0.0],
    ]
)


def tentacle() -> trimesh.Trimesh:
    return tube([0.0, 0.0, 0.0], [0.0, 1.5, 0.0], 0.12)


def cross() -> trimesh.Trimesh:
    """A thick trunk and two thin arms, three components that stand in one another."""
    return trimesh.util.concatenate(
        [
            tube([0.0, 0.0, 0.0], [0.0, 1.4, 0.0], 0.25),
            tube([0.2, 0.6, 0.0], [0.9, 0.6, 0.0], 0.05),
            tube([-0.2, 0.6, 0.0], [-0.9, 0.6, 0.0], 0.05),
        ]
    )


def check(binding: SkeletonBinding, mesh: trimesh.Trimesh, parents: np.ndarray) -> None:
    """What holds of every binding."""
    handles, count = binding.handles, len(mesh.vertices)
    assert len(handles) == len(binding.anchor) > 0
    assert len(np.unique(handles)) == len(handles), "every handle once"
    assert handles.min() >= 0
    assert handles.max() < count
    assert binding.owner.shape == (count,)
    for numbers in (binding.anchor, binding.owner):
        assert numbers.min() >= 0
        assert numbers.max() < len(binding.node)
    bones = binding.node != binding.pivot
    assert (parents[binding.node[bones]] == binding.pivot[bones]).all()
    assert not binding.inside[binding.node[bones]].any(), "no anchor on a bone inside the trunk"
    faces = np.asarray(mesh.faces)
    pairs = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    held = np.bincount(label[handles], minlength=number)
    assert (held >= np.minimum(np.bincount(label), 3)).all(), "each component's turn is fixed"


def soup() -> trimesh.Trimesh:
    """A truck-like heap: many plates of two triangles, nothing welded."""
    random = np.random.default_rng(1)
    plate = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 0.1
    vertices, faces = [], []
    for number in range(60):
        turned = (plate + random.normal(0, 0.01, (4, 3))) @ Rotation.random(
            random_state=number
        ).as_matrix().T
        vertices.append(turned + random.uniform([-0.2, 0.0, -0.2], [0.2, 1.5, 0.2]))
        faces.append(np.array([[0, 1, 2], [0, 2, 3]]) + 4 * number)
    return trimesh.Trimesh(np.concatenate(vertices), np.concatenate(faces), process=False)


def loose() -> trimesh.Trimesh:
    """A tentacle with a button, a single triangle and two vertices without a face."""
    button = trimesh.creation.icosphere(1, 0.02).apply_translation(
        [0.17, 0.75, 0.0]
    )  # between two anchors
    button.vertices += np.random.default_rng(2).normal(0.0, 5e-4, button.vertices.shape)
    triangle = trimesh.Trimesh([[0.2, 0.3, 0], [0.25, 0.3, 0], [0.2, 0.35, 0]], [[0, 1, 2]])
    joined = trimesh.util.concatenate([tentacle(), button, triangle])
    lonely = np.vstack([joined.vertices, [[0.0, 2.0, 0.0], [0.3, 0.1, 0.0]]])
    return trimesh.Trimesh(lonely, joined.faces, process=False)


def boxes() -> trimesh.Trimesh:
    """Two boxes far from each other, both at one end of the skeleton."""
    far = trimesh.creation.box([0.4, 0.3, 0.2]).apply_translation([0.6, 0.1, 0.0])
    return trimesh.util.concatenate([trimesh.creation.box([0.3, 0.3, 0.3]), far])


@pytest.mark.parametrize("make", [tentacle, loose, soup, boxes])
def test_every_component_is_held(make) -> None:
    mesh = make()
    check(bind(mesh.vertices, mesh.faces, CHAIN, NODES), mesh, CHAIN)


def test_no_anchor_stands_inside_the_trunk() -> None:
    mesh = cross()
    binding = bind(mesh.vertices, mesh.faces, CROSS_PARENTS, CROSS_NODES)
    assert np.flatnonzero(binding.inside).tolist() == [3, 6]
    check(binding, mesh, CROSS_PARENTS)


@pytest.mark.parametrize("count", [1, 2])
def test_the_smallest_skeletons(count: int) -> None:
    mesh = tentacle()
    parents = np.arange(count) - 1
    binding = bind(mesh.vertices, mesh.faces, parents, NODES[[0, 6]][:count])
    check(binding, mesh, parents)
    assert (binding.node[0], binding.pivot[0]) == (0, 0)
    assert len(np.unique(binding.anchor)) >= count


def test_nodes_that_coincide_do_no_harm() -> None:
    mesh = tentacle()
    nodes = NODES.copy()
    nodes[3], nodes[6] = nodes[2], nodes[5]
    check(bind(mesh.vertices, mesh.faces, CHAIN, nodes), mesh, CHAIN)
    check(bind(mesh.vertices, mesh.faces, CHAIN, np.zeros((7, 3))), mesh, CHAIN)


def test_the_tip_of_every_limb_is_held() -> None:
    mesh = cross()
    binding = bind(mesh.vertices, mesh.faces, CROSS_PARENTS, CROSS_NODES)
    for leaf in (2, 5, 8):
        groups = np.flatnonzero((binding.node == leaf) & (binding.pivot != leaf))
        held = mesh.vertices[binding.handles[np.isin(binding.anchor, groups)]]
        radius = 0.25 if leaf == 2 else 0.05
        nearest = np.linalg.norm(held - CROSS_NODES[leaf], axis=1).min()
        assert nearest < 1.5 * radius


def test_anchors_of_a_limb_leave_room_to_bend() -> None:
    """However finely a skeleton is sampled, anchors are a limb's radius apart."""
    mesh = tentacle()
    nodes = np.linspace([0.0, 0.0, 0.0], [0.0, 1.5, 0.0], 61)
    binding = bind(mesh.vertices, mesh.faces, np.arange(61) - 1, nodes)
    heights = nodes[binding.node[binding.node != binding.pivot], 1]
    assert np.diff(heights).min() >= SPACING * 0.12 - 1.5 / 60
    assert len(heights) > 5
    rings = np.bincount(binding.anchor)
    assert rings.max() <= RING


def test_each_ring_surrounds_its_bone() -> None:
    """A ring on one side only would leave the bone's turn about itself to chance."""
    mesh = tentacle()
    binding = bind(mesh.vertices, mesh.faces, CHAIN, NODES)
    for group in np.unique(binding.anchor):
        ring = mesh.vertices[binding.handles[binding.anchor == group]]
        angles = np.sort(np.arctan2(ring[:, 2], ring[:, 0]))
        gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
        assert gaps.max() < np.radians(120.0)


def test_rings_follow_their_anchors_rigidly() -> None:
    """Turn every anchor about its own pivot: the solver keeps each ring's shape and its place."""
    mesh = tentacle()
    binding = bind(mesh.vertices, mesh.faces, CHAIN, NODES)
    solver = ArapSolver(mesh.vertices, mesh.faces, binding.handles, groups=binding.anchor)
    turns = Rotation.from_rotvec(np.linspace(0.0, 0.3, 7)[:, None] * [0.0, 0.0, 1.0])
    pivots = NODES[binding.pivot[binding.anchor]]
    offsets = mesh.vertices[binding.handles] - pivots
    targets = turns[binding.node[binding.anchor]].apply(offsets) + pivots
    moved = solver.solve(targets, iterations=2)
    np.testing.assert_allclose(moved[binding.handles], targets, atol=1e-9)
    for group in np.unique(binding.anchor):
        ring = binding.handles[binding.anchor == group]
        for before, after in itertools.pairwise(ring):
            rest = np.linalg.norm(mesh.vertices[before] - mesh.vertices[after])
            now = np.linalg.norm(moved[before] - moved[after])
            assert now == pytest.approx(rest, abs=1e-9)


def test_a_button_is_carried_as_one_and_a_large_piece_is_bent() -> None:
    mesh = loose()
    binding = bind(mesh.vertices, mesh.faces, CHAIN, NODES)
    button = np.arange(len(tentacle().vertices), len(tentacle().vertices) + 42)
    carriers = binding.anchor[np.isin(binding.handles, button)]
    assert len(carriers) >= 3
    assert len(np.unique(carriers)) == 1
    sleeve = trimesh.util.concatenate([tentacle(), tube([0, 0.1, 0], [0, 1.4, 0], 0.2)])
    binding = bind(sleeve.vertices, sleeve.faces, CHAIN, NODES)
    outer = np.arange(len(sleeve.vertices) // 2, len(sleeve.vertices))
    assert len(np.unique(binding.anchor[np.isin(binding.handles, outer)])) > 3


def test_owners_lie_on_their_vertices_own_limb() -> None:
    mesh = cross()
    binding = bind(mesh.vertices, mesh.faces, CROSS_PARENTS, CROSS_NODES)
    limb_of = {
        node: number for number, limb in enumerate(limbs(CROSS_PARENTS)) for node in limb[1:]
    }
    bone, _ = closest_bones(mesh.vertices, CROSS_PARENTS, CROSS_NODES)
    for vertex, owner in enumerate(binding.owner):
        node, pivot = int(binding.node[owner]), binding.pivot[owner]
        assert node == pivot or limb_of[node] == limb_of[int(bone[vertex])]
    np.testing.assert_array_equal(binding.owner[binding.handles], binding.anchor)


def test_a_rigs_weights_say_whose_a_vertex_is() -> None:
    """A hand that rests on the hip: near the trunk in space, the arm's by the rig."""
    mesh = trimesh.util.concatenate(
        [tube([0, 0, 0], [0, 1.5, 0], 0.1), tube([0.13, 0.2, 0], [0.13, 1.0, 0], 0.02)]
    )
    half = len(mesh.vertices) // 2
    parents = np.array([-1, 0, 1, 1, 3, 4])
    nodes = np.array(
        [[0, 0.1, 0], [0, 1.2, 0], [0, 1.5, 0], [0.4, 1.1, 0], [0.4, 0.6, 0], [0.4, 0.2, 0]]
    )
    belongs = np.where(np.arange(len(mesh.vertices)) < half, 1, 5)
    by_rig = bind(mesh.vertices, mesh.faces, parents, nodes, belongs)
    check(by_rig, mesh, parents)
    arm = np.isin(by_rig.node, [3, 4, 5])
    free = by_rig.node != by_rig.pivot
    assert not arm[by_rig.owner[:half]].any()
    assert (arm | ~free)[by_rig.owner[half:]].all()
    assert arm[by_rig.owner[half:]].any()
    by_distance = bind(mesh.vertices, mesh.faces, parents, nodes)
    assert not arm[by_distance.owner[half:]].any()


@pytest.mark.parametrize("make", [tentacle, loose, soup])
@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_size_place_and_turn_do_not_change_the_choice(make, size: float) -> None:
    mesh = make()
    turn = Rotation.from_euler("xyz", [0.4, -1.1, 2.0])

    def moved(points: np.ndarray) -> np.ndarray:
        return size * np.add(turn.apply(points), [0.3, 0.2, -0.1])

    first = bind(mesh.vertices, mesh.faces, CHAIN, NODES)
    second = bind(moved(mesh.vertices), mesh.faces, CHAIN, moved(NODES))
    np.testing.assert_array_equal(first.owner, second.owner)
    assert carriers(first) == carriers(second)


def carriers(binding: SkeletonBinding) -> dict[int, int]:
    """The anchor of each handle; their order may differ where two are equally far out."""
    return dict(zip(binding.handles.tolist(), binding.anchor.tolist(), strict=True))


def test_the_choice_is_the_same_every_time() -> None:
    mesh = cross()
    first, second = (bind(mesh.vertices, mesh.faces, CROSS_PARENTS, CROSS_NODES) for _ in "ab")
    for name in SkeletonBinding.__slots__:
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_rings_that_have_room_do_not_touch(shared: Path) -> None:
    character = load_character(str(shared / "mesh" / "elephant.obj"))
    skeleton = character.skeleton
    binding = bind(character.vertices, character.faces, skeleton.parents, skeleton.rest_positions)
    anchor_at = np.full(len(character.vertices), -1)
    anchor_at[binding.handles] = binding.anchor
    held = anchor_at[character.faces]
    several = [{int(a) for a in corners if a >= 0} for corners in held]
    assert sum(len(anchors) > 1 for anchors in several) < 0.01 * len(binding.handles)
