"""Read Wavefront OBJ files: all objects and groups, with their materials' diffuse colours."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.text_file import without_mark
from runtime.characters.character import Material
from runtime.characters.formats.beside import beside
from runtime.characters.formats.mesh_data import (
    FileMesh,
    MeshError,
    check_counts,
    plain_material,
)
from runtime.characters.formats.mtl import Textures, read_mtl
from runtime.characters.formats.obj_lines import ObjContent, parse_obj
from runtime.characters.formats.polygons import cut_polygons
from runtime.characters.palette import linear_from_srgb

_LIBRARY = re.compile(r"\S.*?\.mtl(?=\s|$)", re.IGNORECASE)


def read_obj(content: bytes, folder: Path) -> FileMesh:
    """Read an OBJ file: its `v` lines in their order, then the copies that uv seams need.

    Polygons are cut into triangles; faces of fewer than three corners are left out and noted.
    Uvs are kept only where a texture uses them, so that without one the vertices are the `v` lines
    one by one. Colours behind the position are taken as sRGB.

    Args:
        content: the bytes of the file.
        folder: the folder of its material libraries and their textures.

    Raises:
        MeshError: a line is damaged, or there are no faces, or too many.
    """
    read = parse_obj(without_mark(content))
    check_counts(len(read.positions), len(read.sizes))
    materials, notes = _materials(read, folder)
    if read.short_faces:
        notes.append(f"left out {read.short_faces} faces of fewer than three corners")
    cut, doubts = cut_polygons(read.positions, read.corners[:, 0], read.sizes)
    corners = read.corners[cut.corners]  # (F, 3, 2)
    positions, faces, uvs = read.positions, corners[:, :, 0], None
    colors = None if read.colors is None else _colors(read.colors)
    textured = any(material.texture is not None for material in materials)
    if textured and read.uvs is None:
        raise MeshError("a vt line does not have 2 numbers; it is damaged")
    if textured and read.uvs is not None and len(read.uvs):
        source, faces, uvs = _split(corners, len(positions), read.uvs)
        positions = positions[source]
        colors = None if colors is None else colors[source]
    face_material = read.polygon_material[cut.polygon]
    return FileMesh(positions, faces, colors, uvs, materials, face_material, (*notes, *doubts))


def _colors(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Linear colours (V, 4) of sRGB ones (V, 3), whole numbers to 255 or fractions to 1."""
    finite = values[np.isfinite(values)]
    return linear_from_srgb(values / (255.0 if finite.size and finite.max() > 1.0 else 1.0))


def _materials(read: ObjContent, folder: Path) -> tuple[tuple[Material, ...], list[str]]:
    """The materials in the order of `usemtl`; a missing one is plain.

    Some programs write `#` inside names, others comments behind them: the whole line is tried
    first.
    """
    library: dict[str, Material] = {}
    notes: list[str] = []
    textures = Textures()
    for path in _library_files(read.libraries, folder):
        found, said = read_mtl(path, textures)
        library |= found
        notes += said
    uncommented = {_uncommented(name): material for name, material in library.items()}
    chosen = [
        library.get(name) or uncommented.get(_uncommented(name)) or plain_material()
        for name in read.materials
    ]
    return tuple(chosen), notes


def _library_files(lines: tuple[str, ...], folder: Path) -> list[Path]:
    """The material libraries that `mtllib` lines name: one, with blanks in its name, or several."""
    files: list[Path] = []
    for line in lines:
        several = _LIBRARY.findall(line) or [line]
        for name in [line] if _beside(folder, line) else several:
            files.append(_beside(folder, name) or folder / Path(name.replace("\\", "/")).name)
    return list(dict.fromkeys(files))


def _beside(folder: Path, name: str) -> Path | None:
    try:
        return beside(folder, name)
    except (OSError, ValueError):  # a name that no file can have
        return None


def _uncommented(name: str) -> str:
    return name.partition("#")[0].strip()


def _split(
    corners: NDArray[np.int64], count: int, uvs: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Split vertices at uv seams: sources (M,), faces (F, 3) and uvs (M, 2), v downwards."""
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
