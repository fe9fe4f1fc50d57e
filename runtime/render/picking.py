"""Finds what lies at a point of the picture: rays from the camera, polylines on the screen."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from runtime.render.camera import Camera

Array = NDArray[np.float64]


def ray_through(
    camera: Camera, size: tuple[int, int], at: tuple[float, float]
) -> tuple[Array, Array]:
    """Return the ray that is seen at a place of the picture: origin (3,) [m], direction (3,).

    Args:
        camera: sees the picture.
        size: width and height of the picture [px].
        at: x and y [px] from its upper left corner.
    """
    width, height = size
    slope = math.tan(camera.fov / 2.0)
    right = (2.0 * at[0] / width - 1.0 - camera.shift[0]) * slope * width / height
    up = (1.0 - 2.0 * at[1] / height - camera.shift[1]) * slope
    direction: Array = np.array([right, up, -1.0]) @ camera.view_rotation
    return np.array(camera.eye, dtype=np.float64), direction


def on_screen(camera: Camera, size: tuple[int, int], points: ArrayLike) -> Array:
    """Return where points (n, 3) [m] are in the picture: (n, 2) [px] from its upper left corner.

    Points behind the camera are NaN.
    """
    width, height = size
    places = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    to_clip = camera.projection(width / height) @ camera.view
    clip = np.pad(places, ((0, 0), (0, 1)), constant_values=1.0) @ to_clip.T
    depth = np.where(clip[:, 3] >= camera.near, clip[:, 3], np.nan)[:, None]
    flipped: Array = clip[:, :2] / depth * (0.5, -0.5) + 0.5
    return flipped * (width, height)


def nearest_polyline(
    at: tuple[float, float], polylines: Sequence[Array], reach: float
) -> int | None:
    """Return which polyline runs nearest to a place; None if none runs within `reach` of it.

    Args:
        at: x and y [px].
        polylines: each (n, 2) [px]; a bone with an end that is NaN is not there.
        reach: [px].
    """
    best, nearest = reach, None
    for number, polyline in enumerate(polylines):
        gap = _distance(np.array(at), polyline)
        if gap <= best:
            best, nearest = gap, number
    return nearest


def _distance(at: Array, polyline: Array) -> float:
    starts, bones = polyline[:-1], np.diff(polyline, axis=0)
    there = np.isfinite(bones).all(axis=1)
    if not there.any():
        return math.inf
    starts, bones = starts[there], bones[there]
    squared = np.maximum(np.einsum("ij,ij->i", bones, bones), 1e-12)
    share = np.clip(np.einsum("ij,ij->i", at - starts, bones) / squared, 0.0, 1.0)
    return float(np.linalg.norm(starts + share[:, None] * bones - at, axis=1).min())
