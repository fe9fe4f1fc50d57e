"""What is visible of a limb: how far its tip travels on the screen, and when it is up or aside.

A limb that points right may still hardly show: an arm that is a stub, or one that swings towards
the audience. So the tips of both bodies are looked at from where the audience sits, each against
the hips and in heights of its own body.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES
from runtime.benchmarks.resemblance.body_track import BodyTrack, across, common_axes

Array = NDArray[np.float64]

LEAST_SEEN = 0.02  # heights: a performer's tip that travels less shows nothing
_FEWEST = 5  # frames in which a tip is seen


@dataclass(frozen=True, slots=True)
class TipFigures:
    """How the tip of one limb moves on the screen beside the performer's.

    Attributes:
        performer: how far the performer's tip travels: root mean square distance from its mean
            place [heights].
        seen: how far the character's travels over that; NaN where the performer's is below
            `LEAST_SEEN`.
        up: correlation of the heights of both tips; NaN where one of them stays as high as it is.
        aside: correlation of their places across the screen; NaN where one of them stays there.
    """

    performer: float
    seen: float
    up: float
    aside: float


def tip_figures(
    performer: BodyTrack, character: BodyTrack, rest: BodyTrack, heights: tuple[float, float]
) -> dict[str, TipFigures]:
    """Return the figures of each arm and leg that both bodies have, by name: "left arm".

    Args:
        performer, character: the same frames of both.
        rest: the character at rest, one frame, as it stands before the audience.
        heights: [m] of the performer and of the character.
    """
    axes = common_axes(performer, character)
    pair = across(character.plan.legs) or across(character.plan.arms)
    if axes is None or pair is None:
        return {}
    aside = rest.axes(pair)[0, :, 0]  # the screen's right in the body's own left, up and front
    figures = {}
    for name, joint, node in _tips(performer, character):
        theirs, ours = (
            _on_screen(body, tip, own, aside) / height
            for body, tip, own, height in zip(
                (performer, character), (joint, node), axes, heights, strict=True
            )
        )
        is_seen = np.isfinite(theirs).all(axis=1) & np.isfinite(ours).all(axis=1)
        if np.count_nonzero(is_seen) >= _FEWEST:
            figures[name] = compared_tips(theirs[is_seen], ours[is_seen])
    return figures


def compared_tips(source: Array, target: Array) -> TipFigures:
    """Compare the ways (T, 2) [heights] of a tip, across the screen and up, with another's."""
    theirs, ours = (each - each.mean(axis=0) for each in (source, target))
    far, our_far = (float(np.sqrt(np.square(each).sum(axis=1).mean())) for each in (theirs, ours))
    aside, up = (_correlation(theirs[:, axis], ours[:, axis]) for axis in range(2))
    return TipFigures(far, our_far / far if far >= LEAST_SEEN else np.nan, up, aside)


def _tips(performer: BodyTrack, character: BodyTrack) -> Iterator[tuple[str, int, int]]:
    source, target = performer.plan, character.plan
    for limb, theirs, ours in (
        ("arm", source.arms, target.arms),
        ("leg", source.legs, target.legs),
    ):
        for side in SIDES:
            if side in theirs and side in ours:
                yield f"{side} {limb}", theirs[side].chain[-1], ours[side].chain[-1]


def _on_screen(body: BodyTrack, tip: int, axes: Array, aside: Array) -> Array:
    """Where a tip is on the screen (T, 2) [m], against the hips: across and up."""
    gap = np.einsum("tij,tj->ti", axes, body.positions[:, tip] - body.hips)
    return np.stack([gap @ aside, gap[:, 1]], axis=1)


def _correlation(a: Array, b: Array) -> float:
    """Of two series (T,) with mean zero; NaN where one of them stays in its place."""
    spread = np.sqrt(np.square(a).mean()), np.sqrt(np.square(b).mean())
    if spread[0] < LEAST_SEEN / 2.0 or spread[1] < 1e-6:
        return np.nan
    return float((a * b).mean() / (spread[0] * spread[1]))
