"""Finds the place of a body in front of a camera, from its shape in metres and its image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 4
NEAREST, FURTHEST = 0.2, 30.0  # [m]


def camera_position(shape: Array, picture: Array, weights: Array, focal: float) -> Array | None:
    """Return the translation t (3,) [m] at which a body of known shape projects to its image.

    A pinhole camera projects the point (X, Y, Z) + t to u = f (X + tx) / (Z + tz), and v alike.
    Multiplied out, this is linear in t with two equations per point; t is the least-squares
    solution. This is the linear resection of a camera with known rotation (Hartley and Zisserman,
    Multiple View Geometry, chapter 7).

    Args:
        shape: (N, 3) [m] points of the body, x to the right of the image, y down, z away.
        picture: (N, 2) [pixels] the same points, measured from the image centre.
        weights: (N,) weight of each point in [0, 1].
        focal: focal length f [pixels].

    Returns:
        The translation, or None if fewer than four points have weight or the solution does not lie
        before the camera.
    """
    counted = (weights > 0.0) & np.isfinite(shape).all(axis=1) & np.isfinite(picture).all(axis=1)
    if counted.sum() < FEWEST:
        return None
    shape, picture = shape[counted], picture[counted]
    root = np.sqrt(weights[counted])
    equations = np.zeros((2, len(shape), 3))
    equations[0, :, 0] = equations[1, :, 1] = focal
    equations[:, :, 2] = -picture.T
    right = (picture * shape[:, 2:] - focal * shape[:, :2]).T
    weighted = (equations * root[:, None]).reshape(-1, 3), (right * root).reshape(-1)
    place, _, rank, _ = np.linalg.lstsq(*weighted, rcond=None)
    if rank < 3 or not NEAREST < place[2] < FURTHEST:
        return None
    found: Array = place.astype(np.float64)
    return found
