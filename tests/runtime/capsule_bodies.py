"""Bodies of tubes around a skeleton without names: what the tests of shapes recognise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import BodyPlan
from devices.skeleton import Skeleton
from runtime.characters.character import Character, Material, Surface
from runtime.characters.plan_by_shape import plan_by_shape
from solvers.skeleton.limbs import surface_points
from solvers.skeleton.mirror_plane import mirror_planes
from solvers.skeleton.tree import Tree

BONE = 0.06  # [m], about
SIDES = 10

Array = NDArray[np.float64]
Branch = tuple[str, list[tuple[float, float, float]], float]  # parent, places, radius
Branches = Mapping[str, Branch]

TRUNK: Branches = {
    "trunk": ("", [(0, 0.9, 0), (0, 1.35, 0)], 0.12),
    "head": ("trunk", [(0, 1.5, 0), (0, 1.75, 0.02)], 0.08),
}


def both(name: str, parent: str, places: list[tuple[float, float, float]], radius: float) -> dict:
    """A limb at the left, +X, and its mirror image at the right."""
    return {
        f"{name}.L": (parent, places, radius),
        f"{name}.R": (parent, [(-x, y, z) for x, y, z in places], radius),
    }


LEGS = both(
    "leg", "hips", [(0.1, 0.85, 0), (0.11, 0.45, 0.03), (0.11, 0.04, 0), (0.11, 0.02, 0.16)], 0.05
)
ARMS = both("arm", "trunk", [(0.17, 1.33, 0), (0.42, 1.15, -0.03), (0.6, 0.95, 0.05)], 0.04)
EARS = both("ear", "head", [(0.1, 1.85, 0), (0.2, 2.0, 0)], 0.03)
TAIL = {"tail": ("hips", [(0, 0.75, -0.2), (0, 0.55, -0.5)], 0.04)}
PERSON: Branches = {**TRUNK, **LEGS, **ARMS}
MOUSE: Branches = {**PERSON, **EARS, **TAIL}

DOG: Branches = {
    "trunk": ("", [(0, 0.6, -0.4), (0, 0.62, 0.4)], 0.12),
    "head": ("trunk", [(0, 0.8, 0.6), (0, 0.85, 0.7), (0, 0.8, 0.9)], 0.07),
    **both("ear", "head:0.6", [(0.08, 0.95, 0.7), (0.1, 1.05, 0.68)], 0.03),
    "tail": ("hips", [(0, 0.7, -0.7), (0, 0.9, -0.95)], 0.03),
    **both("leg", "hips", [(0.12, 0.55, -0.4), (0.12, 0.3, -0.35), (0.12, 0.03, -0.42)], 0.04),
    **both("arm", "trunk", [(0.12, 0.55, 0.4), (0.12, 0.3, 0.36), (0.12, 0.03, 0.4)], 0.04),
}
SPIDER: Branches = {
    "trunk": ("", [(0, 0.3, -0.1), (0, 0.3, 0.1)], 0.1),
    **{
        name: branch
        for index, z in enumerate((-0.6, -0.2, 0.2, 0.6))
        for name, branch in both(
            f"leg{index}", "hips", [(0.3, 0.5, z / 2), (0.7, 0.02, z)], 0.03
        ).items()
    },
}


@dataclass(frozen=True)
class CapsuleBody:
    """A surface, its skeleton, and the branch that each node belongs to."""

    vertices: Array
    faces: NDArray[np.int64]
    tree: Tree
    branch: tuple[str, ...]

    def names(self, nodes: tuple[int, ...]) -> set[str]:
        """The branches of some nodes, without the node that they hang on."""
        return {self.branch[node] for node in nodes[1:]}

    def moved(self, matrix: Array, shift: Array | float = 0.0) -> CapsuleBody:
        """The body turned or mirrored by a matrix (3, 3) and shifted."""
        faces = self.faces if np.linalg.det(matrix) > 0.0 else self.faces[:, ::-1]
        tree = Tree(self.tree.parents, self.tree.positions @ matrix.T + shift)
        return CapsuleBody(self.vertices @ matrix.T + shift, faces, tree, self.branch)


def capsule_body(branches: Branches) -> CapsuleBody:
    """Make a body; a branch begins at the end of its parent, at a share of it, or at the hips."""
    places, parents, owners = [], [], []
    vertices, faces = [], []
    nodes: dict[str, list[int]] = {}
    count = 0
    for name, (parent, corners, radius) in branches.items():
        chain = []
        if parent:
            of, _, share = parent.partition(":")
            if of == "hips":
                chain = [0]
            else:
                along = nodes[of]
                chain = [along[round(float(share or 1.0) * (len(along) - 1))]]
        path = [places[chain[0]], *corners] if chain else corners
        for place in _evenly(np.array(path, dtype=np.float64))[len(chain) :]:
            parents.append(chain[-1] if chain else -1)
            chain.append(len(places))
            places.append(tuple(place))
            owners.append(name)
        nodes[name] = chain
        points, triangles = _tube(np.array([places[node] for node in chain]), radius)
        vertices.append(points)
        faces.append(triangles + count)
        count += len(points)
    tree = Tree(np.array(parents), np.array(places))
    return CapsuleBody(np.concatenate(vertices), np.concatenate(faces), tree, tuple(owners))


def character_of(body: CapsuleBody) -> Character:
    """The body as a character without a plan."""
    count = len(body.vertices)
    names = tuple(f"node{index}" for index in range(len(body.tree)))
    return Character(
        name="capsules",
        vertices=body.vertices,
        faces=body.faces,
        skeleton=Skeleton(names, body.tree.parents, body.tree.positions),
        weights=None,
        surface=Surface(
            vertex=np.arange(count),
            faces=body.faces.astype(np.int32),
            colors=np.ones((count, 4), np.float32),
            uvs=None,
            materials=(Material(np.ones(4, np.float32)),),
            face_material=np.zeros(len(body.faces), dtype=np.int64),
        ),
        file_to_stage=np.eye(4),
    )


def plan_of(body: CapsuleBody) -> BodyPlan | None:
    """The plan of the body, found by its shape."""
    planes = mirror_planes(surface_points(body.vertices, body.faces), 4)
    return plan_by_shape(body.vertices, body.faces, body.tree, planes)


def planned(body: CapsuleBody) -> Character:
    """The body as a character with its plan."""
    return replace(character_of(body), plan=plan_of(body))


def _evenly(corners: Array) -> Array:
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    at = np.linspace(0.0, along[-1], max(4, round(along[-1] / BONE) + 1))
    return np.stack([np.interp(at, along, corners[:, axis]) for axis in range(3)], axis=1)


def _tube(path: Array, radius: float) -> tuple[Array, NDArray[np.int64]]:
    """A tube around a path, closed by a point at either end."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent, np.eye(3)[np.abs(tangent).mean(axis=0).argmin()])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    across = np.cross(tangent, side)
    angle = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)[:, None, None]
    rings = path + radius * (np.cos(angle) * side + np.sin(angle) * across)  # (SIDES, n, 3)
    rings = rings.transpose(1, 0, 2)
    count = len(path)
    points = np.concatenate(
        [rings.reshape(-1, 3), path[:1] - radius * tangent[:1], path[-1:] + radius * tangent[-1:]]
    )
    index = np.arange(count * SIDES).reshape(count, SIDES)
    nearer, farther = index[:-1], index[1:]
    quads = np.stack(
        [nearer, np.roll(nearer, -1, 1), np.roll(farther, -1, 1), farther], axis=-1
    ).reshape(-1, 4)
    ends = [
        np.stack([np.roll(ring, -turn), np.roll(ring, turn - 1), np.full(SIDES, tip)], axis=-1)
        for ring, tip, turn in ((index[0], count * SIDES, 0), (index[-1], count * SIDES + 1, 1))
    ]
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], *ends])
