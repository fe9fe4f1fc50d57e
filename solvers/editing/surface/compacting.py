"""Surfaces are freed of what no face uses."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from solvers.editing.surface.sheet import Derived, Sheet


def compact(whole: Derived) -> Derived:
    """Return a surface without the vertices and copies that no face uses."""
    copies, faces = np.unique(whole.sheet.faces, return_inverse=True)
    kept, vertex = np.unique(whole.sheet.vertex[copies], return_inverse=True)
    sheet = Sheet(
        whole.sheet.vertices[kept], vertex.reshape(-1), faces.reshape(-1, 3).astype(np.int64)
    )
    return Derived(
        sheet,
        csr_array(whole.of_vertices[kept]),
        csr_array(whole.of_copies[copies]),
        whole.of_faces,
        whole.seam[kept],
    )
