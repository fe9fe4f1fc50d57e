"""Where a character stands: from its file's unit and axes to the stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

HEIGHT = 1.7
"""[m] of what stands upright on the stage."""

WIDTH = 2.2
"""[m] that a character may be wide or deep."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """The way from file to stage, and what was guessed for it.

    Attributes:
        matrix: (4, 4) takes file coordinates to stage coordinates: rotation, scale, translation.
        notes: one short line each.
    """

    matrix: FloatArray
    notes: tuple[str, ...]


def stage_from(rotation: FloatArray, points: FloatArray) -> FloatArray:
    """The placement (4, 4) that turns by `rotation` (3, 3), scales and sets down points (n, 3)."""
    turned = points @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    extent = high - low
    scale = min(
        limit / size for limit, size in zip((WIDTH, HEIGHT, WIDTH), extent, strict=True) if size > 0
    )
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation
    foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    matrix[:3, 3] = -scale * foot
    return matrix


def placed(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Points (n, 3) taken through a placement (4, 4)."""
    moved: FloatArray = points @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def place(vertices: FloatArray, faces: NDArray[np.int64]) -> Placement:
    """Guess how a surface (N, 3), (F, 3) stands and put it on the stage."""
    used = vertices[np.unique(faces)]
    return Placement(stage_from(np.eye(3), used), ())
