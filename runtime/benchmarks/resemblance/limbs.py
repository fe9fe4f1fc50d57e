"""Whether each limb of a character points where the performer's points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, Chain, Limb
from runtime.benchmarks.resemblance.body_track import BodyTrack, angle, common_axes, unit

Array = NDArray[np.float64]

LEAST_RANGE = 2.0  # [degrees]; a limb that turns less has no range of motion to keep
CLEAR = 2.0  # [degrees] by which left and right must differ to be told apart
_MIRROR = np.array([-1.0, 1.0, 1.0])  # of left, up and front

ARM = ("upper arm", "forearm", "hand")
LEG = ("thigh", "shin", "foot")
FOUR = ("upper arm", "forearm", "thigh", "shin")
"""The segments whose direction counts; hands, feet, trunk and head are shaped more freely."""


@dataclass(frozen=True, slots=True)
class LimbFigures:
    """How one segment follows the performer's, in each body's own left, up and front.

    Attributes:
        error: median angle between the two directions [degrees].
        kept: range of motion over the performer's; the range is the root mean square angle from
            the mean direction, and the performer's counts as `LEAST_RANGE` at least.
        range: the performer's [degrees].
        gain: by how much the character turns for each degree that the performer turns, the same
            way: 1 is right, 0 unrelated, below 0 opposite.
    """

    error: float
    kept: float
    range: float
    gain: float


def limb_figures(performer: BodyTrack, character: BodyTrack) -> dict[str, LimbFigures]:
    """Return the figures of each segment that both bodies have, by name: "left forearm"."""
    found = common_axes(performer, character)
    if found is None:
        return {}
    figures = {}
    for name, theirs, ours in common_segments(performer, character):
        source = _turned(found[0], performer.span(theirs))
        target = _turned(found[1], character.span(ours))
        is_seen = np.isfinite(source).all(axis=1) & np.isfinite(target).all(axis=1)
        if is_seen.any():
            figures[name] = compared(source[is_seen], target[is_seen])
    return figures


def compared(source: Array, target: Array) -> LimbFigures:
    """Compare the directions of a segment, unit vectors (T, 3), with those of another."""
    means = unit(source.mean(axis=0)), unit(target.mean(axis=0))
    theirs, ours = (
        float(np.sqrt(np.square(angle(each, mean)).mean()))
        for each, mean in zip((source, target), means, strict=True)
    )
    from_mean = source - source.mean(axis=0)
    moved = float(np.square(from_mean).sum())
    gain = float((from_mean * (target - target.mean(axis=0))).sum()) / moved if moved > 0 else 0.0
    return LimbFigures(
        error=float(np.median(angle(source, target))),
        kept=ours / max(theirs, LEAST_RANGE),
        range=theirs,
        gain=gain if theirs >= LEAST_RANGE else np.nan,
    )


def sides(performer: BodyTrack, character: BodyTrack) -> dict[str, str]:
    """Say of arms and legs on which side they are driven.

    Returns:
        By "arms" and "legs": "right" if each follows its own side, "swapped" if it follows the
        other, "mirrored" if it follows the mirror image of the other, "alike" where the motion does
        not tell. Those that one body lacks are left out.
    """
    found = common_axes(performer, character)
    if found is None:
        return {}
    pairs: dict[str, list[tuple[Array, Array]]] = {}
    for name, theirs, ours in common_segments(performer, character):
        side, _, part = name.partition(" ")
        if side in SIDES and part in (*FOUR, "arm", "leg"):
            spans = (_turned(found[0], performer.span(theirs)),)
            pairs.setdefault(part, []).append((*spans, _turned(found[1], character.span(ours))))
    told: dict[str, list[Array]] = {}
    for part, both in pairs.items():
        if len(both) == len(SIDES):
            limbs = "arms" if part in (*ARM, "arm") else "legs"
            told.setdefault(limbs, []).append(_errors_by_side(both))
    return {limbs: _side(np.sum(errors, axis=0)) for limbs, errors in told.items()}


def common_segments(
    performer: BodyTrack, character: BodyTrack
) -> Iterator[tuple[str, Chain, Chain]]:
    """Yield each segment that both bodies have: its name, the joints and the nodes."""
    source, target = performer.plan, character.plan
    for whole, names, theirs, ours in (
        ("arm", ARM, source.arms, target.arms),
        ("leg", LEG, source.legs, target.legs),
    ):
        for side in SIDES:
            if side in theirs and side in ours:
                for name, joints, nodes in _segments(whole, names, theirs[side], ours[side]):
                    yield f"{side} {name}", joints, nodes
    for name, joints, nodes in (
        ("trunk", source.trunk, target.trunk),
        ("head", source.head, target.head),
    ):
        if len(joints) > 1 and len(nodes) > 1:
            yield name, joints, nodes


def _segments(
    whole: str, names: tuple[str, ...], theirs: Limb, ours: Limb
) -> Iterator[tuple[str, Chain, Chain]]:
    if theirs.lower and ours.lower:
        yield names[0], theirs.upper, ours.upper
        yield names[1], theirs.lower, ours.lower
    else:  # without elbow or knee only the whole limb has a direction in both bodies
        yield whole, theirs.upper + theirs.lower, ours.upper + ours.lower
    if theirs.end and ours.end:
        yield names[2], theirs.end, ours.end


def _turned(axes: Array, vectors: Array) -> Array:
    """Vectors (T, 3) in a body's own axes (T, 3, 3)."""
    own: Array = np.einsum("tij,tj->ti", axes, vectors)
    return own


def _errors_by_side(both: list[tuple[Array, Array]]) -> Array:
    """Mean errors (3,) [degrees] of a pair as it is, swapped and mirrored."""
    (left, ours_left), (right, ours_right) = both
    ways = (
        (left, right),
        (right, left),
        (right * _MIRROR, left * _MIRROR),
    )
    return np.array(
        [np.nanmean(np.concatenate([angle(a, ours_left), angle(b, ours_right)])) for a, b in ways]
    )


def _side(errors: Array) -> str:
    if not np.isfinite(errors).all():
        return "unseen"
    best = int(np.argmin(errors))
    if best != 0 and errors[0] - errors[best] < CLEAR:
        best = 0
    others = np.delete(errors, best)
    if others.min() - errors[best] < CLEAR:
        return "alike"
    return ("right", "swapped", "mirrored")[best]
