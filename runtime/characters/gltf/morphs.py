"""Read the morph targets of a glTF file: how far each target moves each vertex.

Only positions are read: normals follow from the surface. Names are in ``extras.targetNames``, as
all exporters write them.

Source: Khronos, "glTF 2.0 Specification", section 3.7.2.2 (morph targets).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from replay.gltf.checked_json import Entry
from replay.gltf.file import GltfFile
from runtime.characters.formats.mesh_data import MeshError

Array = NDArray[np.float64]

MOST_TARGETS = 1024  # of a file
MOST_READ = 100_000_000  # vertices of all targets together, moved or not
MOST_MOVED = 8_000_000  # moved vertices of all targets together
LONGEST_NAME = 64
STILL = 1e-6  # of the primitive's size: smaller deltas are rounding


@dataclass(frozen=True, slots=True, eq=False)
class PartMorph:
    """What one target moves in one primitive.

    Attributes:
        target: its number among the targets of the file.
        vertices: (e,) of the primitive.
        deltas: (e, 3) in scene coordinates.
    """

    target: int
    vertices: NDArray[np.int64]
    deltas: Array


class MorphReader:
    """Reads targets primitive by primitive and numbers them through the whole file.

    Attributes:
        names: of each target read so far.
        notes: what was left out, one short line each.
    """

    def __init__(self, file: GltfFile) -> None:
        self.names: list[str] = []
        self.notes: list[str] = []
        self._file = file
        self._numbers: dict[tuple[int, int], int] = {}
        self._read = self._moved = 0

    def number(self, mesh: int, index: int) -> int | None:
        """The number of a mesh's target; None if it was not read."""
        return self._numbers.get((mesh, index))

    def read(
        self, mesh: int, primitive: Entry, positions: Array, to_scene: Array
    ) -> tuple[PartMorph, ...]:
        """Read the targets of a primitive; none, and a note, where they are damaged or too many.

        Args:
            mesh: its mesh.
            primitive: of that mesh.
            positions: (m, 3) of its vertices.
            to_scene: (3, 3), or (m, 3, 3) for each vertex, takes directions to the scene.
        """
        try:
            return self._targets(mesh, primitive, positions, to_scene)
        except ContentError as error:
            self.notes.append(f"morph targets are left out: {error}")
            return ()

    def _targets(
        self, mesh: int, primitive: Entry, positions: Array, to_scene: Array
    ) -> tuple[PartMorph, ...]:
        targets = primitive.children("targets")
        if not targets:
            return ()
        names = _target_names(self._file.entry("meshes", mesh), primitive)
        still = STILL * float(np.ptp(positions, axis=0).max())
        found = []
        for index, target in enumerate(targets):
            self._read += len(positions)
            if self._read > MOST_READ or self._moved > MOST_MOVED:
                raise MeshError("they move too many vertices; reduce them first")
            name = names[index] if index < len(names) else f"morph {index}"
            number = self._numbered(mesh, index, name)
            if "POSITION" not in target:
                continue  # it changes normals only
            vertices, deltas = self._deltas(target, len(positions), still)
            turn = to_scene if to_scene.ndim == 2 else to_scene[vertices]
            deltas = np.einsum("...ij,...j->...i", turn, deltas)
            if not (np.abs(deltas) < 1e15).all():
                raise target.wrong("it moves vertices beyond all bounds")
            self._moved += len(vertices)
            found.append(PartMorph(number, vertices, deltas))
        return tuple(found)

    def _numbered(self, mesh: int, index: int, name: str) -> int:
        if (mesh, index) not in self._numbers:
            if len(self.names) >= MOST_TARGETS:
                raise MeshError(f"the file has more than {MOST_TARGETS} of them")
            self._numbers[mesh, index] = len(self.names)
            self.names.append(name)
        return self._numbers[mesh, index]

    def _deltas(self, target: Entry, count: int, still: float) -> tuple[NDArray[np.int64], Array]:
        accessor = target.whole("POSITION")
        if self._file.count(accessor) != count:
            raise target.wrong(f"it has {self._file.count(accessor)} deltas for {count} vertices")
        deltas = self._file.floats(accessor, "VEC3")
        size = np.abs(deltas).max(axis=1, initial=0.0)
        if not (size < 1e15).all():
            raise target.wrong("a delta is not a finite number")
        moved = np.flatnonzero(size > still)
        return moved, deltas[moved]


def shaped(
    file: GltfFile, owners: tuple[Entry, Entry], primitive: Entry, positions: Array
) -> Array:
    """Positions (m, 3) moved by the default weights of their morph targets.

    Args:
        file: of the primitive.
        owners: the node, whose weights come first, and its mesh.
        primitive: with the targets.
        positions: as the primitive has them.
    """
    try:
        weights = next((row for owner in owners if (row := owner.row("weights"))), [])
        targets = primitive.children("targets")[: len(weights)]
        for weight, target in zip(weights[:MOST_TARGETS], targets[:MOST_TARGETS], strict=False):
            if weight == 0.0 or "POSITION" not in target:
                continue
            deltas = file.floats(target.whole("POSITION"), "VEC3")
            if deltas.shape != positions.shape or not (np.abs(deltas) < 1e15).all():
                raise target.wrong("its deltas do not fit the vertices")
            positions = positions + weight * deltas
            file.notes["default weights of morph targets shape the surface at rest"] = None
    except ContentError as error:
        file.notes[f"default weights of morph targets are left out: {error}"] = None
    return positions


def _target_names(mesh: Entry, primitive: Entry) -> list[str]:
    """The names of a mesh's targets: in its extras, or in those of its primitive (VRM 0)."""
    for entry in (mesh, primitive):
        extras: Any = entry.fields.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if isinstance(names, list):
            return [_shown(name, index) for index, name in enumerate(names[:MOST_TARGETS])]
    return []


def _shown(name: Any, index: int) -> str:
    """A name as people may read it: printable and of a bounded length."""
    text = str(name)[:LONGEST_NAME] if isinstance(name, str) else ""
    text = "".join(letter for letter in text if letter.isprintable()).strip()
    return text or f"morph {index}"
