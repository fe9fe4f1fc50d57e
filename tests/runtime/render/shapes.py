"""Simple characters and a performer's inset: what the tests of the renderer draw."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from devices.skeleton import Skeleton
from runtime.characters.character import Character, Material, Surface
from runtime.render.camera import front_camera
from runtime.render.inset import SkeletonInset
from runtime.render.tubes import PAIR_COLOURS

SIZE = (320, 180)
CAMERA = front_camera().frame([[-0.6, 0.0, -0.4], [0.6, 1.6, 0.4]], 16 / 9)
WHITE, RED, BLUE, GREEN = (
    (1.0, 1.0, 1.0, 1.0),
    (0.6, 0.05, 0.03, 1.0),
    (0.04, 0.16, 0.55, 1.0),
    (0.05, 0.4, 0.1, 1.0),
)


def character_of(
    vertices: ArrayLike,
    faces: ArrayLike,
    colour: ArrayLike = RED,
    *,
    uvs: ArrayLike | None = None,
    material: Material | None = None,
) -> Character:
    """A character of one material; `colour` is one (4,) or one a vertex (N, 4), linear RGBA."""
    count = len(np.asarray(vertices))
    surface = Surface(
        vertex=np.arange(count),
        faces=np.asarray(faces, dtype=np.int32),
        colors=np.broadcast_to(np.asarray(colour, dtype=np.float32), (count, 4)).copy(),
        uvs=None if uvs is None else np.asarray(uvs, dtype=np.float32),
        materials=(material or Material(np.ones(4, dtype=np.float32)),),
        face_material=np.zeros(len(np.asarray(faces)), dtype=np.int64),
    )
    return Character(
        name="shape",
        vertices=np.asarray(vertices, dtype=np.float64),
        faces=np.asarray(faces, dtype=np.int64),
        skeleton=Skeleton(("root",), np.array([-1]), np.zeros((1, 3))),
        weights=None,
        surface=surface,
        file_to_stage=np.eye(4),
    )


def shape_of(mesh: trimesh.Trimesh, colour: ArrayLike = RED) -> Character:
    """A character with the surface of a mesh."""
    return character_of(mesh.vertices, mesh.faces, colour)


def ball(colour: ArrayLike = RED, height: float = 1.4, *, subdivisions: int = 3) -> Character:
    """A ball that touches the floor."""
    sphere = trimesh.creation.icosphere(subdivisions=subdivisions, radius=height / 2.0)
    return character_of(np.add(sphere.vertices, (0, height / 2.0, 0)), sphere.faces, colour)


def ring(colour: ArrayLike = GREEN) -> Character:
    """A torus that stands on the floor, its axis towards the camera."""
    torus = trimesh.creation.torus(0.45, 0.18)
    return character_of(np.add(torus.vertices, (0, 0.63, 0)), torus.faces, colour)


def box(low: ArrayLike, high: ArrayLike, colour: ArrayLike = RED) -> Character:
    """A box between its least and its greatest corner."""
    return shape_of(trimesh.creation.box(bounds=[low, high]), colour)


def sheet(colour: ArrayLike = RED, material: Material | None = None) -> Character:
    """A square that faces the camera, with the first row of its texture on top."""
    corners = [[-0.5, 0.3, 0], [0.5, 0.3, 0], [0.5, 1.3, 0], [-0.5, 1.3, 0]]
    uvs = [[0, 1], [1, 1], [1, 0], [0, 0]]
    return character_of(corners, [[0, 1, 2], [0, 2, 3]], colour, uvs=uvs, material=material)


def performer() -> SkeletonInset:
    """The inset of a performer with two driving joints and one that was filled in."""
    joints = np.array(
        [[0, 0.9, 0], [0, 1.4, 0], [0, 1.65, 0], [0.5, 1.6, 0.1], [-0.5, 1.1, 0], [0.15, 0, 0]]
    )
    colours = np.full((6, 3), np.nan)
    colours[3], colours[4] = PAIR_COLOURS[:2]
    inset = SkeletonInset([-1, 0, 1, 1, 1, 0])
    inset.update(joints, colours=colours, dimmed=np.arange(6) == 5)
    return inset
