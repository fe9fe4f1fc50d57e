"""The onion skin: what the actors do some moments before and after the one that is paused at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.session.actor_layers import ActorLayers
from runtime.session.document import Session

STEP = 0.2  # [s] between two moments
STEPS = (-2, -1, 1, 2)

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Ghost:
    """A character at another moment.

    Attributes:
        number: of the character on the stage, from 0.
        steps: how many steps after the moment that is shown; negative for before.
        vertices: (N, 3) [m] on the stage.
    """

    number: int
    steps: int
    vertices: Array


class OnionSkin:
    """Finds the ghosts of a session's actors; again only where session or moment is another one.

    Args:
        layers: of the actors, in the order of the characters on the stage.
    """

    def __init__(self, layers: Sequence[ActorLayers]) -> None:
        self._layers = layers
        self._of: tuple[Session, float, tuple[bool, ...]] | None = None
        self._ghosts: Sequence[Ghost] = ()

    def ghosts(self, session: Session, time: float) -> Sequence[Ghost]:
        """Return the ghosts around a moment [s]: none of an actor that no clip moves there."""
        in_place = tuple(one.puppet.travel.in_place for one in self._layers)
        if self._of is None or self._of[0] is not session or self._of[1:] != (time, in_place):
            self._of = session, time, in_place
            self._ghosts = [
                Ghost(number, steps, vertices)
                for number, one in enumerate(self._layers)
                for steps in STEPS
                if (vertices := one.at(session, time + steps * STEP)) is not None
            ]
        return self._ghosts
