"""Assigns finger tips to fingers in Leap protocols 1 to 5, which name neither fingers nor hands.

The tips of a spread hand, sorted across the palm, are its fingers in order. The outer tip that
reaches less far forward is the thumb, which also distinguishes the left hand from the right. The
device tracks a tip by an id that comes and goes. Each id gets one finger for the whole recording:
the one with the nearest usual position, averaged over the id's life, among the fingers that are not
shown at the same time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from devices.leap.joints import FINGERS, PALM

Array = NDArray[np.float64]

# Tips of a spread adult right hand from its palm [mm]: towards the little finger, forward, up.
_SPREAD = np.array(
    [
        [-75.0, 35.0, -15.0],
        [-35.0, 90.0, 0.0],
        [-5.0, 100.0, 5.0],
        [25.0, 92.0, 5.0],
        [60.0, 70.0, 0.0],
    ]
)
_MOVE_OVER = 1e4  # [mm] more than any distance


@dataclass(slots=True)
class Tip:
    """A finger tip in one message: the id by which the device tracks it, its place (3,) [mm]."""

    id: int
    place: Array


class TippedHand(Protocol):
    """A hand whose tips need names."""

    side: str | None
    joints: dict[str, Array]
    direction: Array
    normal: Array
    tips: list[Tip]


def name_tips(tracks: Mapping[str, Sequence[TippedHand | None]]) -> list[str]:
    """Name the tips in every track: each hand gets joints "thumb_tip" and so on, and its side.

    Returns:
        The assumptions, one note per track.
    """
    notes = []
    for side, track in tracks.items():
        hands = [hand for hand in track if hand is not None and hand.tips]
        if not hands:
            continue
        left = side == "left" if side else _is_left(hands)
        for hand in hands:
            hand.side = "left" if left else "right"
        _name_fingers(hands, _usual_places(hands, left))
        which = f"the {side} hand" if side else f"a {'left' if left else 'right'} hand"
        notes.append(f"this protocol names no fingers; taken for {which} from its finger tips")
    return notes


def tips_from_palm(hand: TippedHand) -> Array:
    """Return tips (n, 3) [mm] from the palm: to the right seen from its back, forward, up."""
    forward, up = _unit(hand.direction, [0, 0, -1]), -_unit(hand.normal, [0, -1, 0])
    axes = np.stack([np.cross(forward, up), forward, up])
    return (np.array([tip.place for tip in hand.tips]) - hand.joints[PALM]) @ axes.T


def _unit(vector: Array, otherwise: Sequence[float]) -> Array:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-6 else np.array(otherwise, dtype=np.float64)


def _widest(hands: Sequence[TippedHand]) -> list[Array]:
    """The tips of the hands with the most tips, each sorted across the palm."""
    most = min(max(len(hand.tips) for hand in hands), len(FINGERS))
    found = [tips_from_palm(hand) for hand in hands if len(hand.tips) == most]
    return [tips[np.argsort(tips[:, 0])] for tips in found]


def _is_left(hands: Sequence[TippedHand]) -> bool:
    """Whether the thumb, the outer tip that reaches less far forward, is on the hand's right."""
    spreads = _widest(hands)
    return float(np.median([tips[-1, 1] - tips[0, 1] for tips in spreads])) < 0


def _usual_places(hands: Sequence[TippedHand], left: bool) -> Array:
    """Usual positions (5, 3) [mm] of this hand's fingers, from the thumb on."""
    spreads = _widest(hands)
    usual = _SPREAD * [-1.0, 1.0, 1.0] if left else _SPREAD
    if spreads[0].shape == usual.shape:
        middle: Array = np.median(np.stack(spreads), axis=0)
        return middle[::-1] if left else middle
    return usual


def _name_fingers(hands: Sequence[TippedHand], usual: Array) -> None:
    costs = _costs(hands, usual)
    fingers: dict[int, int] = {}
    for hand in sorted(hands, key=lambda hand: -len(hand.tips)):  # the most complete view first
        new = [tip.id for tip in hand.tips if tip.id not in fingers]
        taken = {fingers[tip.id] for tip in hand.tips if tip.id in fingers}
        free = [finger for finger in range(len(FINGERS)) if finger not in taken]
        table = np.array([costs[one][free] for one in new]).reshape(len(new), len(free))
        for row, column in zip(*linear_sum_assignment(table), strict=True):
            fingers[new[row]] = free[column]
    for hand in hands:
        # If two ids of one finger appear together, one of them gets another finger meanwhile.
        moved = np.array([np.arange(5) != fingers.get(tip.id, -1) for tip in hand.tips])
        table = np.array([costs[tip.id] for tip in hand.tips]) + _MOVE_OVER * moved
        for row, finger in zip(*linear_sum_assignment(table), strict=True):
            hand.joints[f"{FINGERS[finger]}_tip"] = hand.tips[row].place


def _costs(hands: Sequence[TippedHand], usual: Array) -> dict[int, Array]:
    """For each id, the mean distance (5,) [mm] from the usual position of each finger."""
    distances: dict[int, list[Array]] = {}
    for hand in hands:
        for tip, place in zip(hand.tips, tips_from_palm(hand), strict=True):
            distances.setdefault(tip.id, []).append(np.linalg.norm(place - usual, axis=1))
    return {one: np.mean(found, axis=0) for one, found in distances.items()}
