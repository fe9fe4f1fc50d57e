"""Wavefront OBJ files: all objects and groups, with the diffuse colours of their materials."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from runtime.characters.character import Material
from runtime.characters.formats.mesh_data import (
    MOST_VERTICES,
    FileMesh,
    MeshError,
    check_counts,
    plain_material,
)
from runtime.characters.formats.mtl import read_mtl
from runtime.characters.palette import linear_from_srgb


@dataclass(slots=True)
class _Content:
    """What the lines say: corner indices count from 0, -1 where a corner has no uv."""

    positions: list[list[str]] = field(default_factory=list)
    uvs: list[list[str]] = field(default_factory=list)
    corners: list[tuple[tuple[int, int], tuple[int, int], tuple[int, int]]] = field(
        default_factory=list
    )
    face_material: list[int] = field(default_factory=list)
    materials: dict[str, int] = field(default_factory=lambda: {"": 0})
    libraries: list[str] = field(default_factory=list)
    short_faces: int = 0


def read_obj(content: bytes, folder: Path) -> FileMesh:
    """Read an OBJ file: its `v` lines in their order, then those again that a uv seam splits.

    Polygons are fanned into triangles; faces of fewer than three corners are left out and noted.
    Uvs are kept only where a texture uses them, so that without one the vertices are the `v` lines
    one by one. Colours after the position are taken as sRGB.

    Args:
        content: the file.
        folder: where its material library and their textures lie.

    Raises:
        MeshError: what is wrong with it, and in which line.
    """
    read = _parsed(content)
    check_counts(len(read.positions), len(read.corners))
    positions = _floats(read.positions, 3, "v")
    materials, notes = _materials(read, folder)
    if read.short_faces:
        notes.append(f"left out {read.short_faces} faces of fewer than three corners")
    corners = np.array(read.corners, dtype=np.int64)  # (F, 3, 2)
    colors = _colors(read.positions)
    uvs = None
    faces = corners[:, :, 0]
    if any(material.texture is not None for material in materials) and read.uvs:
        source, faces, uvs = _split(corners, len(positions), _floats(read.uvs, 2, "vt"))
        positions = positions[source]
        colors = None if colors is None else colors[source]
    face_material = np.array(read.face_material, dtype=np.int64)
    return FileMesh(positions, faces, colors, uvs, materials, face_material, tuple(notes))


def _parsed(content: bytes) -> _Content:
    read = _Content()
    material = 0
    text = content.decode("utf-8", errors="replace").replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        match words[0]:
            case "v":
                read.positions.append(words[1:])
            case "vt":
                read.uvs.append(words[1:])
            case "f":
                before = len(read.corners)
                _add_face(read, words[1:], number)
                read.face_material += [material] * (len(read.corners) - before)
            case "usemtl":
                name = " ".join(words[1:])
                material = read.materials.setdefault(name, len(read.materials))
            case "mtllib":
                read.libraries.append(line.partition("mtllib")[2].strip())
        if len(read.positions) > MOST_VERTICES:
            raise MeshError(f"it has more than {MOST_VERTICES} vertices; reduce it first")
    return read


def _add_face(read: _Content, words: list[str], number: int) -> None:
    if len(words) < 3:
        read.short_faces += 1
        return
    try:
        polygon = [_corner(word, len(read.positions), len(read.uvs)) for word in words]
    except ValueError:
        raise MeshError(f"line {number} has a face that is not made of whole numbers") from None
    read.corners += [(polygon[0], polygon[i], polygon[i + 1]) for i in range(1, len(polygon) - 1)]


def _corner(word: str, positions: int, uvs: int) -> tuple[int, int]:
    """A corner's position and uv, from 0; negative numbers count back from the newest."""
    position, _, rest = word.partition("/")
    uv = rest.partition("/")[0]
    v = int(position)
    t = int(uv) if uv else 0
    return (v - 1 if v > 0 else positions + v if v < 0 else -1), (
        t - 1 if t > 0 else uvs + t if t < 0 else -1
    )


def _floats(rows: list[list[str]], width: int, keyword: str) -> NDArray[np.float64]:
    try:
        return np.array([row[:width] for row in rows], dtype=np.float64).reshape(-1, width)
    except ValueError:
        raise MeshError(f"a {keyword} line does not have {width} numbers; it is damaged") from None


def _colors(rows: list[list[str]]) -> NDArray[np.float32] | None:
    """Colours behind the positions, when every vertex has one."""
    if min(len(row) for row in rows) < 6:
        return None
    values = _floats([row[3:6] for row in rows], 3, "v")
    finite = values[np.isfinite(values)]
    return linear_from_srgb(values / (255.0 if finite.size and finite.max() > 1.0 else 1.0))


def _materials(read: _Content, folder: Path) -> tuple[tuple[Material, ...], list[str]]:
    """The materials in the order of `usemtl`; a missing one is plain, and noted."""
    library: dict[str, Material] = {}
    notes: list[str] = []
    for name in dict.fromkeys(filter(None, read.libraries)):
        found, said = read_mtl(folder / name.replace("\\", "/"))
        library |= found
        notes += said
    return tuple(library.get(name, plain_material()) for name in read.materials), notes


def _split(
    corners: NDArray[np.int64], count: int, uvs: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Vertices with one uv each: what they copy (M,), faces (F, 3), uvs (M, 2), v downwards."""
    pairs, first, inverse = np.unique(
        corners.reshape(-1, 2), axis=0, return_index=True, return_inverse=True
    )
    if pairs.min() < -1 or pairs[:, 0].max() >= count or pairs[:, 1].max() >= len(uvs):
        raise MeshError("a face names a v or vt that is not there; it is cut short or damaged")
    by_use = np.argsort(first)
    _, leading = np.unique(pairs[by_use, 0], return_index=True)
    leads = np.zeros(len(pairs), dtype=bool)
    leads[by_use[leading]] = True
    vertex = pairs[:, 0].copy()
    extra = by_use[~leads[by_use]]
    vertex[extra] = count + np.arange(len(extra))
    source = np.concatenate([np.arange(count), pairs[extra, 0]])
    coordinates = np.zeros((len(source), 2))
    has_uv = pairs[:, 1] >= 0
    coordinates[vertex[has_uv]] = uvs[pairs[has_uv, 1]]
    coordinates[:, 1] = 1.0 - coordinates[:, 1]
    return source, vertex[inverse.reshape(-1)].reshape(-1, 3), coordinates.astype(np.float32)
