"""Cut the polygons of mesh files into triangles, and note polygons that cross themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from runtime.characters.formats.mesh_data import check_indices
from solvers.surface.polygons import Triangulation, triangulate


def cut_polygons(
    vertices: NDArray[np.float64], corners: NDArray[np.int64], sizes: NDArray[np.int64]
) -> tuple[Triangulation, tuple[str, ...]]:
    """The triangles of a file's polygons, as indices into `corners`, and notes.

    Args:
        vertices: (M, 3) in the file's unit.
        corners: (C,) the vertex of each corner, polygon after polygon.
        sizes: (P,) number of corners of each polygon.

    Raises:
        MeshError: a polygon names a vertex that does not exist.
    """
    check_indices(corners, len(vertices))
    cut = triangulate(vertices[corners], sizes)
    if not cut.doubtful:
        return cut, ()
    return cut, (f"{cut.doubtful} concave faces cross themselves or are too large: cut as fans",)
