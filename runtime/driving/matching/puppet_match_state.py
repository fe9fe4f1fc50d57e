"""The state of the match of one puppet between two frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.choices import OwnChoice
from runtime.driving.performer import Rest
from solvers.retarget.match_hysteresis import MatchHysteresisState

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PuppetMatchState:
    """The state of a `PuppetMatch` between two frames; the driver's belongs to the puppet.

    Attributes:
        rest: the performer's rest state.
        view: (3, 3) rotation from the stage to the camera when it was taken.
        hysteresis: of the match shown.
        matching: whether a match is looked for.
        own, drives: the user's choice for the next driver, and for the one that moves the puppet.
        proposal: the state of the driver that is proposed in place of the one that moves the
            puppet; None where none is.
    """

    rest: Rest | None
    view: Array
    hysteresis: MatchHysteresisState
    matching: bool
    own: OwnChoice
    drives: OwnChoice
    proposal: object | None
