"""Turns a broken surface into a solid of voxels, and the solid into a closed surface.

Triangle soups, shells with holes and overlapping pieces have no clear inside. Here a voxel belongs
to the solid if the surface passes through it, or if there is a wall in at least five of the six
directions along the axes. So a hole on one side, as under a car, does not open the inside.

Source: the vote over axis-parallel rays of Nooruddin and Turk 2003, "Simplification and Repair of
Polygonal Models Using Volumetric Techniques", IEEE TVCG 9(2), section 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, gaussian_filter

FINEST = 80
"""The most voxels along the longest side; large or tangled surfaces get fewer."""

_MOST_SAMPLES = 400_000
_WALLS = 5  # the least directions, of six, with a wall around an inner voxel
_MARGIN = 3  # voxels of air around the solid
_BLUR = 0.7  # standard deviation [voxel] that smooths the steps of the surface
_LEVEL = 0.15  # of the blurred solid: keeps walls (0.57), wires (0.33) and dots (0.18) of one voxel

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class VoxelSolid:
    """Voxels (nx, ny, nz) that belong to a solid; voxel i is centred at `origin` + i `size`."""

    voxels: NDArray[np.bool_]
    origin: FloatArray
    size: float

    @property
    def outermost(self) -> FloatArray:
        """Centres (S, 3) of the solid's voxels that touch the air outside."""
        skin = self.voxels & ~binary_erosion(self.voxels)
        return self.origin + self.size * np.argwhere(skin)

    def closed_surface(self) -> tuple[FloatArray, IntArray]:
        """Return a closed surface around the solid, vertices (n, 3) and faces (m, 3).

        Raises:
            ImportError: PyGEL3D is not installed.
        """
        try:
            from pygel3d import hmesh  # noqa: PLC0415  # an optional extra
        except ImportError as error:
            raise ImportError("curve skeletons need: pip install 'bunraku[characters]'") from error
        field = gaussian_filter(self.voxels.astype(np.float32), _BLUR)
        last = np.array(field.shape) - 1.0  # vertices in voxels, from centre to centre
        manifold = hmesh.volumetric_isocontour(field, bbox_max=last, tau=_LEVEL)
        vertices = np.array(manifold.positions(), dtype=np.float64)
        faces = np.array([manifold.circulate_face(f, mode="v") for f in manifold.faces()])
        return self.origin + self.size * vertices, faces.astype(np.int64).reshape(-1, 3)


def voxel_solid(points: FloatArray, triangles: IntArray) -> VoxelSolid:
    """Return the solid bounded by a surface, whatever its holes, pieces and inner walls.

    Args:
        points: (N, 3) finite, any unit; the longest side of their box is not 0.
        triangles: (F, 3) into `points`, in any arrangement.
    """
    size = float(np.ptp(points, axis=0).max()) / FINEST
    low = points.min(axis=0)
    cells = ((surface_samples(points, triangles, 0.7 * size) - low) / size).astype(np.int64)
    shell = np.zeros(cells.max(axis=0) + 1 + 2 * _MARGIN, dtype=bool)
    shell[tuple((cells + _MARGIN).T)] = True
    return VoxelSolid(_filled(shell), low + (0.5 - _MARGIN) * size, size)


def surface_samples(points: FloatArray, triangles: IntArray, spacing: float) -> FloatArray:
    """Return points (S, 3) on triangles (F, 3) of points (N, 3), nowhere `spacing` apart.

    The spacing [the unit of `points`] grows if it would give more than about 10^6 samples.
    """
    corners = points[triangles]
    longest = _sides(corners).max(axis=1)
    # A triangle is halved until it is small: one that is n times as long becomes up to n^2 of them.
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    spacing = max(spacing, longest.sum() / _MOST_SAMPLES, np.sqrt(area.sum() / _MOST_SAMPLES))
    found = []
    while len(corners):
        sides = _sides(corners)
        small = sides.max(axis=1) <= spacing
        found.append(corners[small].mean(axis=1))
        found.append(corners[small].reshape(-1, 3))
        corners = _halved(corners[~small], sides[~small])
    return np.concatenate(found)


def _sides(corners: FloatArray) -> FloatArray:
    """Lengths (F, 3) of the side from each corner to the next."""
    lengths: FloatArray = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return lengths


def _halved(corners: FloatArray, sides: FloatArray) -> FloatArray:
    """Triangles (2 F, 3, 3): each cut in the middle of its longest side."""
    first = np.argmax(sides, axis=1)
    a, b, c = (corners[np.arange(len(corners)), (first + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _filled(shell: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The shell and all voxels inside it."""
    walls = np.zeros(shell.shape, dtype=np.int8)
    for axis in range(3):
        walls += np.logical_or.accumulate(shell, axis=axis)
        walls += np.flip(np.logical_or.accumulate(np.flip(shell, axis), axis=axis), axis)
    return shell | (walls >= _WALLS)
