"""Legs that bend at rest shorten by the share by which the performer's legs do."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from runtime.characters.character import Character
from tests.runtime.capsule_bodies import DOG, both, capsule_body, planned
from tests.runtime.driving.body.test_forelegs import HANGING, Played
from tests.runtime.stick_figures import BODY, pose

CROUCHING = {
    **DOG,
    **both("leg", "hips", [(0.12, 0.55, -0.4), (0.12, 0.3, -0.2), (0.12, 0.03, -0.45)], 0.04),
}

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def dog() -> Character:
    return planned(capsule_body(CROUCHING))


def bent_knees(angle: float) -> Array:
    """Standing with thighs that point forward and shins that point back by an angle [rad]."""
    turns = {**HANGING}
    for side in ("Left", "Right"):
        turns[f"Hip{side}"] = (-angle, 0.0, 0.0)
        turns[f"Knee{side}"] = (2.0 * angle, 0.0, 0.0)
    return pose(turns)


def reach(positions: Array) -> float:
    """How far [m] the left ankle is from its hip."""
    hip, ankle = (positions[BODY.index(name)] for name in ("HipLeft", "AnkleLeft"))
    return float(np.linalg.norm(ankle - hip))


@pytest.mark.parametrize("angle", [0.25, 0.5, 0.9])
def test_the_hips_sink_by_the_share_of_the_leg_that_the_performers_sink_by(dog, angle) -> None:
    assert dog.plan is not None
    shown = Played(dog, pose(HANGING), bent_knees(angle))
    ends = -shown.feet[:, 1, :, 1]  # below the hips
    share = reach(bent_knees(angle)) / reach(pose(HANGING))
    leg = dog.plan.legs[min(dog.plan.legs)]
    hip = dog.skeleton.rest_positions[leg.upper[0]]
    root = dog.skeleton.rest_positions[dog.plan.hips]
    below = ends - (root - hip)[1]
    assert below[1] / below[0] == pytest.approx(share, abs=0.04)
