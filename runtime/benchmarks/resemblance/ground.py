"""How a character moves over the ground beside its performer: travel, sliding, hovering, squats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES
from runtime.benchmarks.resemblance.body_track import BodyTrack, bends

Array = NDArray[np.float64]

PLANTED_SPEED = 0.15  # leg lengths a second; the ankle of a planted foot moves less
PLANTED_HEIGHT = 0.05  # leg lengths above the ankle's lowest place
STANDING = 0.02  # of the height: a performer whose lowest joint is no higher stands on the floor
HOVERING = 0.01  # of the height: a character whose lowest vertex is higher hovers
LEAST_SQUAT = 0.05  # leg lengths; hips that move less do not squat
_FEWEST = 5  # frames with a planted foot


@dataclass(frozen=True, slots=True)
class GroundFigures:
    """Figures on the ground; NaN where the performer does not show them.

    Attributes:
        travel: how far the character's hips travel, the diagonal of the area [leg lengths].
        performer_travel: the performer's.
        slide: how much faster planted feet slide than the performer's [leg lengths a second].
        hover: share of the frames in which the performer stands and the character hovers.
        squat: range of the height of the character's hips over the performer's, each in leg
            lengths.
        performer_squat: the performer's range.
    """

    travel: float
    performer_travel: float
    slide: float
    hover: float
    squat: float
    performer_squat: float


def ground_figures(
    performer: BodyTrack, character: BodyTrack, positions: Array, lowest: Array, height: float
) -> GroundFigures:
    """Measure a performance.

    Args:
        performer, character: the same frames of both.
        positions: (T, J, 3) [m] of all joints of the performer's body.
        lowest: (T,) [m] height of the character's lowest vertex.
        height: [m] of the character.
    """
    far, theirs = travel(character), travel(performer)
    deep, their_deep = _squat(character), _squat(performer)
    return GroundFigures(
        travel=far,
        performer_travel=theirs,
        slide=slide(performer, character),
        hover=hover(positions, lowest, height),
        squat=deep / their_deep if their_deep >= LEAST_SQUAT else np.nan,
        performer_squat=their_deep,
    )


def travel(body: BodyTrack) -> float:
    """The diagonal of the area that the hips travel over [leg lengths]."""
    place = body.hips[:, [0, 2]]
    place = place[np.isfinite(place).all(axis=1)]
    return float(np.linalg.norm(np.ptp(place, axis=0))) / body.leg if len(place) else np.nan


def slide(performer: BodyTrack, character: BodyTrack) -> float:
    """Median speed of the ankles while the performer's foot is planted, less the performer's."""
    slides = []
    for side in SIDES:
        if side not in performer.plan.legs or side not in character.plan.legs:
            continue
        theirs = bends(performer.plan.legs[side])[-1]
        ours = bends(character.plan.legs[side])[-1]
        speed, slid = (
            np.linalg.norm(body.velocity(joint)[:, [0, 2]], axis=1) / body.leg
            for body, joint in ((performer, theirs), (character, ours))
        )
        heights = performer.positions[:, theirs, 1]
        if not np.isfinite(heights).any():
            continue
        low = np.nanquantile(heights, 0.05) + PLANTED_HEIGHT * performer.leg
        is_planted = (speed < PLANTED_SPEED) & (heights[1:] < low)
        if np.count_nonzero(is_planted) > _FEWEST:
            slides.append(np.median(slid[is_planted]) - np.median(speed[is_planted]))
    return float(np.mean(slides)) if slides else np.nan


def hover(positions: Array, lowest: Array, height: float) -> float:
    """Share of the frames in which the performer stands and the character is above the floor.

    Args:
        positions: (T, J, 3) [m] of the performer.
        lowest: (T,) [m] height of the character's lowest vertex.
        height: [m] of the character.
    """
    is_seen = np.isfinite(positions[..., 1]).any(axis=1)
    if not is_seen.any():
        return np.nan
    low = np.nanmin(positions[is_seen, :, 1], axis=1)
    high = np.nanmax(positions[is_seen, :, 1], axis=1)
    stands = low < np.nanquantile(low, 0.02) + STANDING * np.nanmedian(high - low)
    return float((lowest[is_seen][stands] > HOVERING * height).mean()) if stands.any() else np.nan


def _squat(body: BodyTrack) -> float:
    """The range of the height of the hips [leg lengths], without the outermost hundredths."""
    heights = body.hips[:, 1]
    heights = heights[np.isfinite(heights)]
    if not len(heights):
        return np.nan
    low, high = np.quantile(heights, (0.01, 0.99))
    return float(high - low) / body.leg
