"""Read MEDIT .mesh files in ASCII: the surface of a triangle or tetrahedral mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from runtime.characters.formats.mesh_data import FileMesh, MeshError, check_counts, check_words
from runtime.characters.formats.polygons import cut_polygons

_CORNERS = {"triangles": 3, "quadrilaterals": 4, "tetrahedra": 4}


def read_medit(content: bytes) -> FileMesh:
    """Read the vertices and the triangles and quadrilaterals of a MEDIT file.

    The surface of a file with tetrahedra only is their boundary; inner vertices stay, which keeps
    the file's order.

    Raises:
        MeshError: a list is damaged, or there are no faces, or too many.
    """
    check_words(content)
    lines = (line.split("#", 1)[0] for line in content.decode("latin-1").splitlines())
    words = " ".join(lines).split()
    if not words or words[0].lower() != "meshversionformatted":
        raise MeshError("it does not begin with MeshVersionFormatted: no MEDIT mesh")
    blocks = {name: _block(words, name, width) for name, width in _CORNERS.items()}
    vertices = _block(words, "vertices", 3)
    quads = blocks["quadrilaterals"].astype(np.int64).reshape(-1)
    cut, notes = cut_polygons(vertices, quads - 1, np.full(len(quads) // 4, 4))
    halves = quads[cut.corners].reshape(-1, 2, 3)
    faces = np.vstack([blocks["triangles"].astype(np.int64), halves[:, 0], halves[:, 1]])
    if len(faces) == 0:
        faces = _boundary(blocks["tetrahedra"].astype(np.int64))
    check_counts(len(vertices), len(faces))
    return FileMesh(vertices, faces - 1, notes=notes)


def _block(words: list[str], keyword: str, width: int) -> NDArray[np.float64]:
    """The rows (n, width) after a keyword, without the reference number that ends each."""
    start = next((i for i, word in enumerate(words) if word.lower() == keyword), None)
    if start is None:
        return np.zeros((0, width))
    try:
        count = int(words[start + 1])
        values = np.array(words[start + 2 : start + 2 + max(count, 0) * (width + 1)], dtype=float)
        return values.reshape(count, width + 1)[:, :width]
    except (IndexError, ValueError):
        raise MeshError(f"its list of {keyword} is damaged or cut short") from None


def _boundary(tetrahedra: NDArray[np.int64]) -> NDArray[np.int64]:
    """The triangles that belong to one tetrahedron only, facing outwards."""
    triangles = tetrahedra[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(triangles, axis=1), axis=0, return_index=True, return_counts=True
    )
    outside: NDArray[np.int64] = triangles[np.sort(first[count == 1])]
    return outside
