"""Place a character on the stage: from its file's unit and axes to metres, +Y up, facing +Z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.surface.upright import (
    X,
    Y,
    faces_away,
    flat_axis,
    stands_along_z,
    surface_samples,
)

FloatArray = NDArray[np.float64]

HEIGHT = 1.7
"""Greatest height [m] of a character on the stage."""

WIDTH = 2.2
"""Greatest width and depth [m]."""

UPRIGHT = np.eye(3)
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Takes +Z up, facing -Y, as in Blender and most scans, to +Y up, facing +Z."""

ABOUT_FACE = np.diag([-1.0, 1.0, -1.0])
SIDE_TO_FRONT = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
"""Takes +X to +Z."""


def guess_rotation(
    vertices: FloatArray, faces: NDArray[np.int64]
) -> tuple[FloatArray, tuple[str, ...]]:
    """Guess the rotation (3, 3) that makes a surface stand upright and face +Z; also return notes.

    A flat sheet is turned so that its face looks forward. A creature that looks along x is left as
    it is: its side shows most of it.

    Args:
        vertices: (N, 3) in the axes of a file that does not name them.
        faces: (F, 3) into `vertices`.
    """
    points = surface_samples(vertices, faces)
    thin = flat_axis(points)
    if thin is not None:
        rotation = {X: SIDE_TO_FRONT, Y: Z_UP}.get(thin, UPRIGHT)
        return rotation, (f"a flat sheet across {'xyz'[thin]}: put upright, facing the front",)
    rotation, notes = UPRIGHT, ["up axis guessed: +Y"]
    if stands_along_z(points):
        rotation, notes = Z_UP, ["up axis guessed: +Z, facing -Y"]
    if faces_away(points @ rotation.T):
        rotation = ABOUT_FACE @ rotation
        notes.append("feet point backwards: turned about to face the front")
    return rotation, tuple(notes)


def file_to_stage_matrix(rotation: FloatArray, points: FloatArray) -> FloatArray:
    """The matrix (4, 4) that turns, scales and moves points (n, 3) to the middle of the stage.

    The scale is uniform: the largest that keeps the height within `HEIGHT` and width and depth
    within `WIDTH`. The lowest point is at y = 0.

    Args:
        rotation: (3, 3) from the file's axes to the stage's.
        points: (n, 3) in the file's axes and unit, not all in one place.
    """
    turned = points @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    limits = np.array([WIDTH, HEIGHT, WIDTH])
    scale = 1.0 / ((high - low) / limits).max()
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation
    foot = np.array([(low[0] + high[0]) / 2.0, low[1], (low[2] + high[2]) / 2.0])
    matrix[:3, 3] = -scale * foot
    return matrix


def placed(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Points (n, 3) transformed by a matrix (4, 4)."""
    moved: FloatArray = points @ matrix[:3, :3].T + matrix[:3, 3]
    return moved
