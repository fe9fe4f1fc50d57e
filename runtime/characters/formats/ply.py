"""Read PLY files, ASCII and binary, with trimesh's parser."""

from __future__ import annotations

import io
import logging
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from runtime.characters.formats.mesh_data import FileMesh, MeshError, check_counts
from runtime.characters.formats.polygons import cut_polygons
from runtime.characters.palette import linear_from_srgb

_ELEMENT = re.compile(rb"^element\s+(vertex|face)\s+(\d{1,18})\s*$", re.MULTILINE)
_CORNERS = ("vertex_indices", "vertex_index")  # the names of a face's list of vertices

Indices = NDArray[np.int64]

logging.getLogger("trimesh").addHandler(logging.NullHandler())  # or it writes to the terminal


def read_ply(content: bytes) -> FileMesh:
    """Read a PLY file: vertices in file order, polygons cut into triangles, colours as sRGB.

    Texture coordinates are left out, and no file that the header names is opened.

    Raises:
        MeshError: the file is damaged, cut short, or has no faces, or too many.
    """
    count, face_count = _declared(content)
    check_counts(count, face_count)
    try:
        vertices, corners, sizes, colors = _parsed(content, count)
    except MeshError:
        raise
    except Exception as error:  # the parser has no exceptions of its own: any of NumPy's and more
        raise MeshError(f"it is damaged or cut short ({type(error).__name__})") from None
    if len(vertices) != count or len(sizes) < face_count:
        raise MeshError(
            f"it announces {count} vertices and {face_count} faces but holds {len(vertices)} and "
            f"{len(sizes)}; it is cut short or damaged"
        )
    cut, notes = cut_polygons(vertices, corners, sizes)
    return FileMesh(vertices, corners[cut.corners], colors, notes=notes)


def _declared(content: bytes) -> tuple[int, int]:
    """How many vertices and faces the header announces."""
    header, end, _ = content[: 1 << 16].partition(b"end_header")
    if not header.startswith(b"ply") or not end:
        raise MeshError("it does not begin with the header of a PLY file")
    counts = {kind: int(count) for kind, count in _ELEMENT.findall(header)}
    return counts.get(b"vertex", 0), counts.get(b"face", 0)


def _parsed(
    content: bytes, count: int
) -> tuple[NDArray[np.float64], Indices, Indices, NDArray[np.float32] | None]:
    """Vertices (M, 3), the vertices of all corners (C,), corner counts (P,), colours (M, 4)."""
    from trimesh.exchange.ply import load_ply  # noqa: PLC0415  # slow to import

    parsed = load_ply(io.BytesIO(content), skip_materials=True, fix_texture=False)
    vertices = np.asarray(parsed.get("vertices", np.zeros((0, 3))), dtype=np.float64)
    return vertices, *_polygons(parsed), _colors(parsed, count)


def _polygons(parsed: dict[str, Any]) -> tuple[Indices, Indices]:
    """The vertices of all corners (C,), and how many corners each face has (P,)."""
    elements = parsed["metadata"]["_ply_raw"]  # trimesh's own faces are cut as fans
    data = elements.get("face", {}).get("data", {})
    names = tuple(data if isinstance(data, dict) else data.dtype.names or ())
    name = next((name for name in (*_CORNERS, *names[:1]) if name in names), None)
    if name is None:
        raise MeshError("its faces have no list of vertices; it is damaged")
    faces = data[name] if isinstance(data, dict) else data[name]["f1"]
    if faces.dtype != object:  # equally many corners in all of them
        faces = faces.reshape(len(faces), -1)
        sizes = np.full(len(faces), faces.shape[1], dtype=np.int64)
        return faces.reshape(-1).astype(np.int64), sizes
    sizes = np.fromiter(map(len, faces), np.int64, len(faces))
    return np.concatenate(faces).astype(np.int64), sizes


def _colors(parsed: dict[str, Any], count: int) -> NDArray[np.float32] | None:
    """Linear colours (M, 4) of the vertices, if the file has one for each."""
    from trimesh.visual.color import to_rgba  # noqa: PLC0415  # slow to import

    colors = parsed.get("vertex_colors")
    if colors is None or len(colors) != count:
        return None
    return linear_from_srgb(np.asarray(to_rgba(colors)) / 255.0)
