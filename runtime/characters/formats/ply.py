"""PLY files, ASCII and binary, by way of trimesh."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np

from runtime.characters.formats.mesh_data import FileMesh, MeshError, check_counts
from runtime.characters.palette import linear_from_srgb

_ELEMENT = re.compile(rb"^element\s+(vertex|face)\s+(\d{1,18})\s*$", re.MULTILINE)


def read_ply(content: bytes) -> FileMesh:
    """Read a PLY file with its vertices in file order and their colours, taken as sRGB.

    Raises:
        MeshError: what is wrong with it.
    """
    import trimesh  # noqa: PLC0415  # half a second, and only some characters need it

    count, face_count = _declared(content)
    check_counts(count, face_count)
    try:
        loaded: Any = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    except Exception as error:  # the parser has no exceptions of its own: any of NumPy's and more
        raise MeshError(f"it is damaged or cut short ({type(error).__name__})") from None
    vertices = np.asarray(loaded.vertices, dtype=np.float64)
    faces = np.asarray(getattr(loaded, "faces", np.zeros((0, 3))), dtype=np.int64)
    if len(vertices) != count or len(faces) < face_count:
        raise MeshError(
            f"it announces {count} vertices and {face_count} faces but holds {len(vertices)} and "
            f"{len(faces)}; it is cut short or damaged"
        )
    colors = None
    if loaded.visual.kind == "vertex":
        colors = linear_from_srgb(np.asarray(loaded.visual.vertex_colors) / 255.0)
    return FileMesh(vertices, faces, colors)


def _declared(content: bytes) -> tuple[int, int]:
    """How many vertices and faces the header announces."""
    header, end, _ = content[: 1 << 16].partition(b"end_header")
    if not header.startswith(b"ply") or not end:
        raise MeshError("it does not begin with the header of a PLY file")
    counts = {kind: int(count) for kind, count in _ELEMENT.findall(header)}
    return counts.get(b"vertex", 0), counts.get(b"face", 0)
