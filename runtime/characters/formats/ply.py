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

_ELEMENT = re.compile(rb"^element\s+(vertex|face|tristrips)\s+(\d{1,18})\s*$", re.MULTILINE)
_CORNERS = ("vertex_indices", "vertex_index")  # the names of a face's list of vertices
_CHANNELS = (
    "red green blue alpha",
    "r g b a",
    "diffuse_red diffuse_green diffuse_blue diffuse_alpha",
)

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
        vertices, corners, sizes, colors = _parsed(content)
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
    faces = counts.get(b"face", 0) or min(counts.get(b"tristrips", 0), 1)
    return counts.get(b"vertex", 0), faces


def _parsed(
    content: bytes,
) -> tuple[NDArray[np.float64], Indices, Indices, NDArray[np.float32] | None]:
    """Vertices (M, 3), the vertices of all corners (C,), corner counts (P,), colours (M, 4)."""
    from trimesh.exchange.ply import load_ply  # noqa: PLC0415  # slow to import

    parsed = load_ply(io.BytesIO(content), skip_materials=True, fix_texture=False)
    vertices = np.asarray(parsed.get("vertices", np.zeros((0, 3))), dtype=np.float64)
    corners, sizes = _polygons(parsed)
    inside = corners.size == 0 or bool(0 <= corners.min() <= corners.max() < len(vertices))
    return vertices, corners, sizes, _colors(parsed, corners, sizes) if inside else None


def _polygons(parsed: dict[str, Any]) -> tuple[Indices, Indices]:
    """The vertices of all corners (C,), and how many corners each face has (P,)."""
    elements = parsed["metadata"]["_ply_raw"]  # trimesh's own faces are cut as fans
    if "face" not in elements and "tristrips" in elements:
        return _strips(elements["tristrips"]["data"])
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


def _strips(data: Any) -> tuple[Indices, Indices]:
    """Triangles of strips, parted by -1 (Stanford's scans), as corners and corner counts."""
    names = tuple(data if isinstance(data, dict) else data.dtype.names or ())
    if not names:
        raise MeshError("its strips have no list of vertices; it is damaged")
    lists = data[names[0]] if isinstance(data, dict) else data[names[0]]["f1"]
    one = [np.append(np.asarray(strip, dtype=np.int64).reshape(-1), -1) for strip in lists]
    run = np.concatenate([np.array([-1]), *one])
    a, b, c = run[:-2], run[1:-1], run[2:]
    breaks = np.flatnonzero(run < 0)
    since = np.arange(len(a)) - breaks[np.searchsorted(breaks, np.arange(len(a)), side="right") - 1]
    turned = since % 2 == 0  # every second triangle of a strip is turned over
    triangles = np.column_stack([a, np.where(turned, c, b), np.where(turned, b, c)])
    real = (triangles >= 0).all(axis=1) & (a != b) & (b != c) & (c != a)
    return triangles[real].reshape(-1), np.full(int(real.sum()), 3, dtype=np.int64)


def _colors(parsed: dict[str, Any], corners: Indices, sizes: Indices) -> NDArray[np.float32] | None:
    """Linear colours (M, 4) of the vertices; where only faces have some, the mean of their faces'.

    Whole numbers are sRGB to 255, fractions to 1. Names are red, r, diffuse_red and their kind.
    """
    elements = parsed["metadata"]["_ply_raw"]
    count = len(parsed["vertices"])
    own = _channels(elements.get("vertex", {}).get("data", {}))
    if own is not None and len(own) == count:
        return linear_from_srgb(own)
    of_faces = _channels(elements.get("face", {}).get("data", {}))
    if of_faces is None or len(of_faces) != len(sizes):
        return None
    colors = np.full((count, of_faces.shape[1]), np.nan)
    touching = np.bincount(corners, minlength=count)
    spread = np.repeat(of_faces, sizes, axis=0)
    for channel in range(of_faces.shape[1]):
        total = np.bincount(corners, weights=spread[:, channel], minlength=count)
        colors[touching > 0, channel] = total[touching > 0] / touching[touching > 0]
    return linear_from_srgb(colors)


def _channels(data: Any) -> NDArray[np.float64] | None:
    """Red, green, blue and perhaps alpha (n, 3 or 4) in [0, 1] of an element, or None."""
    names = tuple(data if isinstance(data, dict) else data.dtype.names or ())
    for spelled in _CHANNELS:
        found = [name for channel in spelled.split() for name in names if name.lower() == channel]
        if len(found) < 3:
            continue
        columns = [np.asarray(data[name]) for name in found]
        values = np.column_stack([column.reshape(len(column)) for column in columns])
        whole = columns[0].dtype.kind in "iu"
        largest = np.iinfo(columns[0].dtype.str).max if whole and columns[0].itemsize <= 2 else 255
        fractions = not whole and not (values > 1.0).any()
        return values.astype(np.float64) / (1.0 if fractions else float(largest))
    return None
