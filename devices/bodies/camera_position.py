"""Where a body stands before a camera, from its shape in metres and its picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 4
NEAREST, FURTHEST = 0.2, 30.0  # [m]


def camera_position(shape: Array, picture: Array, weights: Array, focal: float) -> Array | None:
    """The place t (3,) [m] at which a body of known shape and attitude gives its picture.

    A pinhole sees the point (X, Y, Z) + t at u = f (X + tx) / (Z + tz), and v alike; multiplied
    out that is linear in t, two equations a point, and t is their least squares: the linear
    resection of a camera whose rotation is known (Hartley and Zisserman, Multiple View Geometry,
    chapter 7).

    Args:
        shape: (N, 3) [m] the body's points, x to the right of the image, y down, z away.
        picture: (N, 2) [pixels] the same points from the image's middle.
        weights: (N,) how much each point counts, in [0, 1].
        focal: [pixels] focal length f.

    Returns:
        None where fewer than four points count or the place is not before the camera.
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
