"""Read and check mesh files of every format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.characters.formats.medit import read_medit
from runtime.characters.formats.mesh_data import FileMesh, MeshError, check_counts, check_indices
from runtime.characters.formats.obj import read_obj
from runtime.characters.formats.off import read_off
from runtime.characters.formats.ply import read_ply
from runtime.characters.formats.stl import read_stl

MESH_SUFFIXES = (".obj", ".ply", ".stl", ".off", ".mesh")
MOST_BYTES = 1 << 30


@np.errstate(over="ignore", invalid="ignore")  # numbers of a damaged file
def read_mesh_file(path: Path) -> FileMesh:
    """Read a file of `MESH_SUFFIXES`; all its objects are one mesh.

    Raises:
        InputError: it cannot be read, is too large, or holds no usable surface.
    """
    content = file_content(path)
    try:
        return checked(_read(path, content))
    except MeshError as error:
        raise InputError(f"{path}: {error}") from None


def file_content(path: Path) -> bytes:
    """The bytes of a file of no more than `MOST_BYTES`.

    Raises:
        InputError: it is not there, not a file, empty, unreadable or larger.
    """
    try:
        if not path.is_file():
            what = "not a file" if path.exists() else "not there"
            raise InputError(f"{path}: {what}; name a mesh file")
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise InputError(f"{path}: larger than {MOST_BYTES >> 30} GiB; reduce the mesh first")
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    if not content.strip():
        raise InputError(f"{path}: it is empty; export the character's mesh again")
    return content


def _read(path: Path, content: bytes) -> FileMesh:
    match path.suffix.lower():
        case ".obj":
            return read_obj(content, path.parent)
        case ".off":
            return read_off(content)
        case ".ply":
            return read_ply(content)
        case ".stl":
            return read_stl(content)
        case _:
            return read_medit(content)


def checked(mesh: FileMesh) -> FileMesh:
    """Check a mesh, and replace colours that are not numbers.

    Raises:
        MeshError: it has no faces, too many or none with an extent, or names a missing vertex.
    """
    check_counts(len(mesh.vertices), len(mesh.faces))
    check_indices(mesh.faces, len(mesh.vertices))
    used = mesh.vertices[mesh.faces]
    if not np.isfinite(mesh.vertices).all():
        bad = int(np.flatnonzero(~np.isfinite(mesh.vertices).all(axis=1))[0])
        raise MeshError(f"vertex {bad} is not a finite number; export the mesh again")
    if np.abs(mesh.vertices).max() > 1e15 or not np.ptp(used.reshape(-1, 3), axis=0).max() > 0.0:
        raise MeshError("its faces have no extent or are beyond all bounds; export it again")
    colors, notes = _known_colors(mesh.colors)
    return replace(mesh, colors=colors, notes=mesh.notes + notes)


def _known_colors(
    colors: NDArray[np.float32] | None,
) -> tuple[NDArray[np.float32] | None, tuple[str, ...]]:
    if colors is None or np.isfinite(colors).all():
        return colors, ()
    known = np.isfinite(colors).all(axis=1)
    if not known.any():
        return None, ("no vertex colour is a number: default colour",)
    filled = colors.copy()
    filled[~known] = colors[known].mean(axis=0)
    return filled, (f"{np.count_nonzero(~known)} vertex colours are no numbers: mean colour",)
