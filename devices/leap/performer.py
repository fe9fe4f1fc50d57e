"""Combine the hands in Leap Motion messages to frames of one performer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.leap.hands import Hand
from devices.leap.joints import (
    HAND_PARENTS,
    LEAP_TO_WORLD,
    PALM,
    ROOT,
    SIDES,
    chest,
    hand_skeleton,
    leap_to_world,
)
from devices.leap.tips import name_tips
from devices.skeleton import SkeletonFrame

Array = NDArray[np.float64]

BOTH = "both"
SAME_HAND_MM = 150.0  # a hand that returns within this distance of its last place is the same hand
INFERRED = 0.5  # confidence factor of a joint with an assumed position, as for Kinects
_ARM_MM = (("wrist", 65.0), ("elbow", 250.0))  # from the palm to the wrist, and on to the elbow
_TURN = 1e3 * LEAP_TO_WORLD  # device axes to ours, without the unit


class HandSides:
    """Assigns the sides left and right to hands, from message to message.

    The device's own side has priority. Otherwise a hand keeps its side while it keeps its id. A
    hand with a new id takes the side of a hand that was lost nearby, else the free side, else the
    side of the device that it is on. Of two hands of one side, the one that was present before is
    taken, then the one nearest to the last place of that side, then the more confident one.
    """

    def __init__(self) -> None:
        self._ids: dict[str, int] = {}
        self._places: dict[str, Array] = {}

    def __call__(self, hands: Sequence[Hand]) -> dict[str, Hand]:
        """Return the hands of one message by side; at most one for each."""
        known = {number: side for side, number in self._ids.items()}
        found: dict[str, Hand] = {}
        for hand in sorted(hands, key=lambda hand: self._rank(hand, known)):
            found.setdefault(hand.side or self._side(hand, known, found), hand)
        self._ids = {side: hand.id for side, hand in found.items()}
        self._places.update({side: hand.joints[PALM] for side, hand in found.items()})
        return found

    def _rank(self, hand: Hand, known: dict[int, str]) -> tuple[bool, float, float]:
        sides = [hand.side] if hand.side else SIDES
        return hand.id not in known, min(self._far(hand, side) for side in sides), -hand.confidence

    def _far(self, hand: Hand, side: str) -> float:
        """Distance [mm] from the last place of a side; infinite where that gives no evidence."""
        if side not in self._places:
            return np.inf
        far = float(np.linalg.norm(hand.joints[PALM] - self._places[side]))
        return far if far < SAME_HAND_MM else np.inf

    def _side(self, hand: Hand, known: dict[int, str], found: dict[str, Hand]) -> str:
        if hand.id in known and known[hand.id] not in found:
            return known[hand.id]
        free = [side for side in SIDES if side not in found]
        middle = "left" if hand.joints[PALM][0] < 0 else "right"
        near = min(free, key=lambda side: self._far(hand, side), default=middle)
        if np.isfinite(self._far(hand, near)) or middle not in free:
            return near
        return middle


class LeapPerformer:
    """Frames of both hands, or of one, from the hands of each message.

    Args:
        hands: "both", "left" or "right"; the joints of a single hand have bare names.
    """

    def __init__(self, hands: str = BOTH) -> None:
        self._sides = SIDES if hands == BOTH else (hands,)
        one = hands != BOTH
        self.skeleton = hand_skeleton(
            HAND_PARENTS, () if one else SIDES, left=one and hands == "left"
        )
        self._columns = {
            side: {
                name: self.skeleton.index(name if one else f"{side}_{name}")
                for name in HAND_PARENTS
            }
            for side in self._sides
        }
        self._follow = HandSides()
        self._fingers: dict[str, dict[int, str]] = {}

    def frame(self, hands: Sequence[Hand], time: float, arrival: float) -> SkeletonFrame:
        """Return the frame of one message's hands; without hands, no joint in it is seen.

        Tips without a name are assigned to fingers by their positions. Older servers give no arm:
        wrist and elbow are then placed behind the palm, with half its confidence.

        Args:
            hands: of the message.
            time: of the frame [s].
            arrival: of the message [s].
        """
        joints = len(self.skeleton.names)
        positions, bases = np.full((joints, 3), np.nan), np.full((joints, 3, 3), np.nan)
        confidence = np.zeros(joints)
        for side, hand in self._follow(hands).items():
            if side not in self._columns:
                continue
            self._name_tips(side, hand)
            columns = self._columns[side]
            for name, place in _likely_arm(hand).items():
                positions[columns[name]] = place
                confidence[columns[name]] = INFERRED * hand.confidence
            for name, place in hand.joints.items():
                positions[columns[name]] = place
                confidence[columns[name]] = hand.confidence
            for name, basis in hand.bases.items():
                bases[columns[name]] = basis
        positions = leap_to_world(positions)
        if len(self._sides) > 1 and confidence.any():
            root = self.skeleton.index(ROOT)
            positions[root], confidence[root] = chest(), confidence.max()
        positions[confidence == 0] = np.nan
        return SkeletonFrame(
            time=time,
            positions=positions,
            rotations=_rotations(bases),
            confidence=confidence,
            arrival=arrival,
        )

    def _name_tips(self, side: str, hand: Hand) -> None:
        """Name unnamed tips; a tip keeps its finger until a new id appears."""
        if not hand.tips:
            return
        known = self._fingers.get(side, {})
        if all(tip.id in known for tip in hand.tips):
            hand.joints.update({known[tip.id]: tip.place for tip in hand.tips})
            return
        name_tips({side: [hand]})
        by_place = {id(place): name for name, place in hand.joints.items()}
        self._fingers[side] = {
            tip.id: by_place[id(tip.place)] for tip in hand.tips if id(tip.place) in by_place
        }


def _likely_arm(hand: Hand) -> dict[str, Array]:
    """Wrist and elbow [mm] of a hand without an arm: straight behind its palm."""
    length = float(np.linalg.norm(hand.direction))
    if "wrist" in hand.joints or "elbow" in hand.joints or not 0.5 < length < 2.0:
        return {}
    along, places, place = hand.direction / length, {}, hand.joints[PALM]
    for name, bone in _ARM_MM:
        place = place - bone * along
        places[name] = place
    return places


def _rotations(bases: Array) -> Array:
    """Joint to world (J, 4) from bases (J, 3, 3) in device axes; NaN where a basis is NaN."""
    known = np.isfinite(bases).all(axis=(1, 2))
    rotations = np.full((len(bases), 4), np.nan)
    if known.any():
        rotations[known] = Rotation.from_matrix(_TURN @ bases[known]).as_quat()
    return rotations
