"""Morph targets of a performed character in a .glb: those that moved, and those that correct."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from runtime.characters.character import Character
from runtime.output.files.glb import ARRAY_BUFFER, GlbBuilder
from runtime.output.files.surface_correction import Correction
from runtime.output.output import PerformedFrame
from solvers.surface.skin_weights import PosedSamples, Skin

Array = NDArray[np.float64]


class MorphExport:
    """Collects the weights of a character's morph targets, and writes those that were not 0.

    Args:
        character: the performed character.
    """

    def __init__(self, character: Character) -> None:
        self._character = character
        self._rows: list[NDArray[np.float32]] = []

    def add(self, frame: PerformedFrame) -> None:
        """Store the weights of one frame."""
        self._rows.append(self._weights_of(frame).astype(np.float32))

    def targets(self, builder: GlbBuilder) -> list[dict[str, int]]:
        """Store the targets that moved; return the entry of each for every primitive."""
        character, entries = self._character, []
        for target in self._moved():
            weights = np.zeros(self._count)
            weights[target] = 1.0
            deltas = self._deltas(weights)[character.surface.vertex].astype(np.float32)
            entries.append(
                {"POSITION": builder.add_array(deltas, target=ARRAY_BUFFER, bounds=True)}
            )
        return entries

    @property
    def names(self) -> list[str]:
        """The names of these targets."""
        morphs = self._character.morphs
        return [] if morphs is None else [morphs.names[target] for target in self._moved()]

    @property
    def weights(self) -> NDArray[np.float32]:
        """The weights (frames, targets) of these targets."""
        rows = np.array(self._rows, dtype=np.float32).reshape(len(self._rows), self._count)
        return rows[:, self._moved()]

    def deltas_at(self, frame: int) -> Array | None:
        """What the targets add at rest (N, 3) in a frame that was stored; None for nothing."""
        weights = self._rows[frame].astype(np.float64)
        return self._deltas(weights) if weights.any() else None

    def undone(
        self, samples: PosedSamples, frames: Sequence[PerformedFrame], skin: Skin
    ) -> PosedSamples:
        """Return samples of these frames without their morphs, which a skin cannot follow.

        Deltas turn with the nodes of each vertex, as a player of the file turns them.
        """
        vertices = samples.vertices.copy()
        for sample, frame in enumerate(frames):
            weights = self._weights_of(frame)
            if weights.any():
                turns = Rotation.from_quat(samples.rotations[sample]).as_matrix()
                blended = np.einsum("nc,ncij->nij", skin.weights, turns[skin.nodes])
                vertices[sample] -= np.einsum("nij,nj->ni", blended, self._deltas(weights))
        return replace(samples, vertices=vertices)

    @property
    def _count(self) -> int:
        morphs = self._character.morphs
        return 0 if morphs is None else len(morphs.targets)

    def _weights_of(self, frame: PerformedFrame) -> Array:
        return np.zeros(self._count) if frame.weights is None else frame.weights

    def _moved(self) -> list[int]:
        if not self._rows or self._count == 0:
            return []
        return [int(t) for t in np.flatnonzero(np.any(self._rows, axis=0))]

    def _deltas(self, weights: Array) -> Array:
        """The sum (N, 3) of the deltas at rest."""
        sums = np.zeros_like(self._character.vertices)
        if self._character.morphs is not None:
            targets = self._character.morphs.targets
            for target in np.flatnonzero(weights):
                own = slice(targets.starts[target], targets.starts[target + 1])
                np.add.at(sums, targets.vertices[own], weights[target] * targets.deltas[own])
        return sums


class MovedShapes:
    """All morph targets of a file, stored in it, and their weights in every frame.

    Args:
        builder: of the file.
        character: the performed character.
        morphs: its own targets come first.
        correction: of its skin, whose targets come after them; None for none.

    Attributes:
        targets: the entry of each target for every primitive.
        names: of the targets.
        weights: (frames, targets).
    """

    def __init__(
        self,
        builder: GlbBuilder,
        character: Character,
        morphs: MorphExport,
        correction: Correction | None,
    ) -> None:
        self.targets, self.names, self.weights = (
            morphs.targets(builder),
            morphs.names,
            morphs.weights,
        )
        if correction is None:
            return
        self.targets = [*self.targets, *_corrective(builder, character, correction)]
        numbers = range(1, len(correction.targets) + 1)
        self.names = [*self.names, *(f"corrective {number}" for number in numbers)]
        self.weights = np.concatenate([self.weights, correction.weights], axis=1)


def _corrective(
    builder: GlbBuilder, character: Character, correction: Correction
) -> Iterator[dict[str, int]]:
    """Store corrective targets, without the vertices that none of them moves."""
    row = np.full(len(character.vertices), -1)
    row[correction.vertices] = np.arange(len(correction.vertices))
    rows = row[character.surface.vertex]  # of the file's vertices
    places = np.flatnonzero(rows >= 0)
    view = builder.add_places(places.astype(np.uint32)) if len(correction.targets) else -1
    for target in correction.targets:
        yield {"POSITION": builder.add_sparse(target[rows[places]], view, len(rows))}
