"""The doubles that show ghosts on a stage, kept from picture to picture."""

from __future__ import annotations

from collections.abc import Sequence

from runtime.render.stage import Stage
from runtime.render.stage_character import GhostLayer, StageCharacter
from runtime.session.onion_skin import Ghost

BEFORE, AFTER = (0.36, 0.62, 0.95), (0.98, 0.62, 0.30)  # encoded sRGB
OPACITY = 0.6  # of the nearest; one further away has half of it

Colour = tuple[float, float, float]


class GhostDoubles:
    """Puts ghosts on a stage; each keeps its double, which takes new vertices where it has moved.

    Args:
        stage: draws them.
        originals: the characters on it that they are ghosts of.
    """

    def __init__(self, stage: Stage, originals: Sequence[StageCharacter]) -> None:
        self._stage, self._originals = stage, originals
        self._doubles: dict[tuple[int, int], StageCharacter] = {}
        self._shown: dict[tuple[int, int], Ghost] = {}

    def layers(self, ghosts: Sequence[Ghost]) -> list[GhostLayer]:
        """Return what the stage draws of these ghosts, the furthest moment first."""
        at: dict[int, list[StageCharacter]] = {}
        for ghost in sorted(ghosts, key=lambda each: -abs(each.steps)):
            at.setdefault(ghost.steps, []).append(self._double(ghost))
        return [
            GhostLayer(doubles, BEFORE if steps < 0 else AFTER, OPACITY * 0.5 ** (abs(steps) - 1))
            for steps, doubles in at.items()
        ]

    def _double(self, ghost: Ghost) -> StageCharacter:
        key = ghost.number, ghost.steps
        if key not in self._doubles:
            self._doubles[key] = self._stage.double(self._originals[ghost.number])
        if self._shown.get(key) is not ghost:
            self._doubles[key].update(ghost.vertices)
            self._shown[key] = ghost
        self._doubles[key].position = self._originals[ghost.number].position
        return self._doubles[key]
