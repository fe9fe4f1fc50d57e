"""A triangle surface with seams, and how another one was made from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A triangle surface, whose vertices have a copy on each side of a seam.

    Attributes:
        vertices: (N, 3) any unit.
        vertex: (M,) the vertex that each copy is of.
        faces: (F, 3) into the copies, counter-clockwise seen from outside.
    """

    vertices: Array
    vertex: Indices
    faces: Indices

    @property
    def triangles(self) -> Indices:
        """(F, 3) the faces, into the vertices."""
        found: Indices = self.vertex[self.faces]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Derived:
    """A surface that was made from another, and what of that its parts are made of.

    Whatever vertices carry (skin weights, morph targets) goes on as `of_vertices @ carried`, what
    copies carry (colours, texture coordinates) as `of_copies @ carried`.

    Attributes:
        sheet: the new surface, of N' vertices, M' copies and F' faces.
        of_vertices: (N', N), rows sum to 1.
        of_copies: (M', M), rows sum to 1.
        of_faces: (F',) the face that each is a piece of; for a new one, one beside it.
        seam: (N',) whether a vertex is at the seam: on a cap, or remeshed.
    """

    sheet: Sheet
    of_vertices: csr_array
    of_copies: csr_array
    of_faces: Indices
    seam: Flags


def plain(vertices: Array, triangles: Indices) -> Sheet:
    """Return a surface without seams."""
    return Sheet(vertices, np.arange(len(vertices)), np.asarray(triangles, dtype=np.int64))
