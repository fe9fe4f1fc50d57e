"""Finds where two legs become one body, from the surface itself.

An extracted skeleton forks where the gap between two thighs is wide enough to be seen. The surface
knows better: above the crotch its mirror plane cuts it, and between the legs it does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.mirror_plane import MirrorPlane

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_BINS = 100  # over the height of the body
_GAP = 2  # empty bins that end the trunk
_ACROSS = 0.6  # cosine between plane and normal: steeper triangles are the inner sides of thighs
_SLAB = 0.05  # of the height: the part of a thigh whose middle is taken
_STEPS = 16  # slabs over the height
_JOINT = 0.45  # of the width of a thigh: a hip is so far above the crotch


def crotch_height(vertices: Array, faces: Indices, plane: MirrorPlane, start: float) -> float:
    """Return the height [m] down to which the mirror plane cuts the surface without a gap.

    Args:
        vertices: (N, 3) [m], +Y up.
        faces: (F, 3) into `vertices`.
        plane: the mirror plane.
        start: [m] a height inside the trunk.
    """
    away = plane.distance(vertices)[faces]
    cut = (away.min(axis=1) <= 0.0) & (away.max(axis=1) >= 0.0)
    corners = vertices[faces[cut]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-30)
    corners = corners[np.abs(normals @ plane.normal) < _ACROSS * lengths]
    floor, height = float(vertices[:, 1].min()), float(np.ptp(vertices[:, 1]))
    low, high = (
        ((corners[..., 1].min(axis=1) - floor) / height * _BINS).astype(np.int64),
        ((corners[..., 1].max(axis=1) - floor) / height * _BINS).astype(np.int64),
    )
    filled = np.zeros(_BINS + 2, dtype=np.int64)
    np.add.at(filled, low, 1)
    np.add.at(filled, high + 1, -1)
    seen = np.cumsum(filled) > 0
    here = last = min(int((start - floor) / height * _BINS), _BINS)
    while here >= 0 and last - here <= _GAP:
        last = here if seen[here] else last
        here -= 1
    own = (corners[..., 1] - floor) / height * _BINS >= last
    return float(corners[..., 1][own].min(initial=start)) if own.any() else start


def thigh_line(
    points: Array, plane: MirrorPlane, side: float, crotch: float, knee: float
) -> tuple[Array, float]:
    """Return the middle (m, 3) [m] of a leg, from the hip on down, and the width [m] of its thigh.

    Without any surface there, the middle has no points.

    Args:
        points: (n, 3) [m] of the surface, without arms.
        plane: the mirror plane.
        side: 1 for the side of the plane's normal, -1 for the other.
        crotch: [m] height at which the thighs meet.
        knee: [m] height at which the line may end.
    """
    height = float(np.ptp(points[:, 1]))
    own = points[side * plane.distance(points) > 0.0]
    highest = crotch - _SLAB * height
    steps = max(int(_STEPS * (highest - knee) / height), 1)
    levels = np.linspace(highest, knee, steps + 1)
    middles: list[Array] = []
    width = 0.0
    for level in levels:
        slab = own[np.abs(own[:, 1] - level) < 0.5 * _SLAB * height]
        if not len(slab):
            continue
        middle = (slab.min(axis=0) + slab.max(axis=0)) / 2.0
        across = slab @ plane.normal
        if not middles:
            width = float(np.ptp(across))
        middle += plane.normal * ((across.min() + across.max()) / 2.0 - middle @ plane.normal)
        middle[1] = level
        middles.append(middle)
    if not middles:
        return np.empty((0, 3)), 0.0
    hip = middles[0].copy()
    hip[1] = crotch + _JOINT * width
    return np.array([hip, *middles]), width
