"""What the surface of a character carries goes on to a surface that was made from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from runtime.characters.character import Character, Surface
from runtime.characters.morphs import Morphs
from solvers.deform.morph_targets import MorphTargets
from solvers.editing.surface.sheet import Derived, Sheet


def sheet_of(character: Character) -> Sheet:
    """Return a character's surface at rest, with its seams [m]."""
    surface = character.surface
    return Sheet(character.vertices, surface.vertex, surface.faces.astype(np.int64))


def with_surface(character: Character, derived: Derived) -> Character:
    """Return a character with a surface that was made from its own.

    Colours, texture coordinates, materials, skin weights and morph targets go on. Its nodes stay.

    Args:
        character: the character.
        derived: made from `sheet_of(character)`.
    """
    sheet = derived.sheet
    old = character.surface
    surface = Surface(
        vertex=sheet.vertex,
        faces=sheet.faces.astype(np.int32),
        colors=np.clip(derived.of_copies @ old.colors, 0.0, 1.0).astype(np.float32),
        uvs=None if old.uvs is None else (derived.of_copies @ old.uvs).astype(np.float32),
        materials=old.materials,
        face_material=old.face_material[derived.of_faces],
    )
    return replace(
        character,
        vertices=sheet.vertices,
        faces=sheet.triangles,
        weights=carried_weights(character.weights, derived),
        surface=surface,
        morphs=_morphs(character.morphs, derived, len(character.vertices)),
    )


def carried_weights(weights: csr_array | None, derived: Derived) -> csr_array | None:
    """Return the skin weights (N', K) of the new surface, rows sum to 1, from (N, K)."""
    if weights is None:
        return None
    return csr_array(derived.of_vertices @ weights)


def _morphs(morphs: Morphs | None, derived: Derived, count: int) -> Morphs | None:
    if morphs is None:
        return None
    targets = morphs.targets
    moves = []
    for start, end in zip(targets.starts[:-1], targets.starts[1:], strict=True):
        deltas = np.zeros((count, 3))
        deltas[targets.vertices[start:end]] = targets.deltas[start:end]
        carried: NDArray[np.float64] = np.asarray(derived.of_vertices @ deltas)
        moved = np.flatnonzero(carried.any(axis=1))
        moves.append((moved, carried[moved]))
    return replace(morphs, targets=MorphTargets.of(moves))


def with_nodes(
    weights: csr_array | None, of_node: NDArray[np.int64], count: int
) -> csr_array | None:
    """Return skin weights (N, count) that follow other nodes, from those of K nodes.

    Args:
        weights: (N, K).
        of_node: (K,) the new node that stands for each old one.
        count: of the new nodes.
    """
    if weights is None:
        return None
    ones = np.ones(len(of_node))
    change = coo_array((ones, (np.arange(len(of_node)), of_node)), shape=(len(of_node), count))
    return csr_array(weights @ csr_array(change))
