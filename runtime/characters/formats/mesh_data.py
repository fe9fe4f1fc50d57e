"""The content of a mesh file before it is welded and placed, and its limits."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from runtime.characters.character import Material

MOST_VERTICES = 2_000_000
MOST_FACES = 4_000_000
MOST_WORDS = 14_000_000
"""Words of a text that is split as a whole; each takes 60 bytes."""


def plain_material() -> Material:
    """A white material without a texture: colours are the vertices' own."""
    return Material(np.ones(4, dtype=np.float32))


class MeshError(ContentError):
    """A fault in the content of a mesh file; `read_mesh_file` adds the file's name."""


@dataclass(frozen=True, slots=True, eq=False)
class FileMesh:
    """A mesh in its file's own unit and axes.

    Attributes:
        vertices: (M, 3) in file order.
        faces: (F, 3) into `vertices`.
        colors: (M, 4) linear RGBA in [0, 1], NaN rows where unknown, or None.
        uvs: (M, 2) as glTF has them, v downwards, or None.
        materials: at least one.
        face_material: (F,) into `materials`, or None: all of them are the first.
        notes: omissions and repairs, one short line each.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    colors: NDArray[np.float32] | None = None
    uvs: NDArray[np.float32] | None = None
    materials: tuple[Material, ...] = field(default_factory=lambda: (plain_material(),))
    face_material: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()


def check_counts(vertices: int, faces: int) -> None:
    """Refuse counts of vertices and faces that are zero or too large.

    Raises:
        MeshError: there is nothing, or too much.
    """
    if vertices <= 0:
        raise MeshError("it holds no vertices; export the character's mesh again")
    if faces <= 0:
        raise MeshError("it holds points but no faces; export it with its faces")
    if vertices > MOST_VERTICES or faces > MOST_FACES:
        raise MeshError(
            f"it has {vertices} vertices and {faces} faces, more than {MOST_VERTICES} and "
            f"{MOST_FACES}; reduce it first"
        )


def check_words(content: bytes) -> None:
    """Refuse a text of more words than are read at once.

    Raises:
        MeshError: it has more than `MOST_WORDS`.
    """
    if sum(content.count(blank) for blank in (b" ", b"\n", b"\t", b"\r")) > MOST_WORDS:
        raise MeshError(f"it has more than {MOST_WORDS} words; reduce it first")


def check_indices(indices: NDArray[np.int64], vertices: int) -> None:
    """Refuse indices that are not among so many vertices.

    Raises:
        MeshError: one is not.
    """
    if indices.size and not 0 <= indices.min() <= indices.max() < vertices:
        raise MeshError(
            f"a face names a vertex that is not among the {vertices}; it is cut short or damaged"
        )
