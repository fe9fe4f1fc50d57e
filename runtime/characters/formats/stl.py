"""Read STL files, binary and ASCII."""

from __future__ import annotations

import re
from array import array

import numpy as np
from numpy.typing import NDArray

from replay.text_file import without_mark
from runtime.characters.formats.mesh_data import MOST_FACES, FileMesh, MeshError, check_counts

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(content: bytes) -> FileMesh:
    """Read every solid of an STL file; equal corners become one vertex, in order of appearance.

    Raises:
        MeshError: the file is damaged or cut short, or has too many triangles.
    """
    content = without_mark(content)
    corners = _binary(content) if _looks_binary(content) else _ascii(content)
    positions, first, inverse = np.unique(
        corners.reshape(-1, 3) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    rank = np.argsort(np.argsort(first))
    check_counts(len(positions), len(corners))
    return FileMesh(positions[np.argsort(first)], rank[inverse.reshape(-1)].reshape(-1, 3))


def _looks_binary(content: bytes) -> bool:
    """Decide by the size, then by the text: binary files may begin with "solid" too."""
    if len(content) >= 84 and len(content) == 84 + 50 * int.from_bytes(content[80:84], "little"):
        return True
    return not (content.lstrip()[:5].lower() == b"solid" and b"\0" not in content[:1024])


def _binary(content: bytes) -> NDArray[np.float64]:
    if len(content) < 84:
        raise MeshError("it is no STL file: shorter than the header of one")
    count = int.from_bytes(content[80:84], "little")
    there = (len(content) - 84) // _FACET.itemsize
    if count > there:
        raise MeshError(f"it announces {count} triangles but holds {there}: no STL, or cut short")
    check_counts(3 * min(count, 1), count)
    facets = np.frombuffer(content, dtype=_FACET, count=count, offset=84)
    return np.asarray(facets["corners"], dtype=np.float64)


def _ascii(content: bytes) -> NDArray[np.float64]:
    content = content.replace(b",", b".")  # decimal commas
    if b"endsolid" not in content[-4096:].lower():
        raise MeshError("it has no endsolid: it is cut short; export it again")
    numbers = array("d")
    try:
        for found in _VERTEX.finditer(content):
            numbers.extend(map(float, found.groups()))
            if len(numbers) > 9 * MOST_FACES:
                raise MeshError(f"it has more than {MOST_FACES} faces; reduce it first")
    except ValueError:
        raise MeshError(f"a corner is no number ({_shown(found[0])}); it is damaged") from None
    if not numbers or len(numbers) % 9:
        raise MeshError(
            f"it holds {len(numbers) // 3} corners, which make no triangles; export it again"
        )
    return np.frombuffer(numbers).reshape(-1, 3, 3)


def _shown(text: bytes) -> str:
    """The beginning of a text of the file, in one line."""
    return ascii(" ".join(text[:80].decode("latin-1").split()))
