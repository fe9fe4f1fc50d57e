"""Gestures that a performer makes on purpose: a pose that is held, a raised hand, three claps.

Lengths are in arms: from the shoulder by the elbow to the wrist, or from the palm to the middle
finger's tip where only hands are seen. Of two arms or hands only those are asked for that are seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import first_of, label_joints
from devices.bodies.joint_names import BodyPart, Kind, Side
from devices.skeleton import Skeleton
from runtime.driving.performer import Pose

HELD = 2.0  # [s] that a pose is held
RAISED = 1.5  # [s] that a hand is raised
STILL = 0.15  # of an arm that a hand may stray meanwhile
STRAIGHT = 0.9  # of an arm's length, from which it is stretched out
LEVEL = 0.35  # of a stretched arm that the hand may be higher or lower than the shoulder
TOGETHER, APART = 0.22, 0.5  # of an arm: hands that touch, and hands that may clap again
HANDS_TOGETHER, HANDS_APART = 0.5, 0.7  # likewise, where only hands are seen
CLAPS = 3
ELSEWHERE = 0.3  # of an arm, from which hands meet in another place than before
LOWEST, HIGHEST = -0.75, 0.3  # of an arm above the shoulder, where hands clap
SOONEST, LATEST = 0.15, 1.2  # [s] from one clap to the next

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm or a lone hand of a skeleton.

    Attributes:
        side: +1 for the left one, -1 for the right one.
        joints: from the shoulder to the wrist; palm and middle fingertip of a lone hand.
        length: [m] at rest.
        alone: whether only the hand is known.
    """

    side: float
    joints: tuple[int, ...]
    length: float
    alone: bool

    @property
    def hand(self) -> int:
        """The joint of the wrist or palm."""
        return self.joints[0] if self.alone else self.joints[-1]


def arms_of(skeleton: Skeleton) -> tuple[Arm, ...]:
    """Return the arms of a skeleton, the left one first; its hands where it has no arms."""
    parts = label_joints(skeleton)
    arms = []
    for side, sign in ((Side.LEFT, 1.0), (Side.RIGHT, -1.0)):
        hand = first_of(parts, skeleton, Kind.HAND, side)
        above = [first_of(parts, skeleton, kind, side) for kind in (Kind.UPPER_ARM, Kind.LOWER_ARM)]
        if hand is None:
            continue
        tip = _fingertip(skeleton, parts, side)
        whole = [joint for joint in (*above, hand) if joint is not None]
        joints = tuple(whole) if len(whole) == 3 else () if tip is None else (hand, tip)
        if not joints:
            continue
        rest = skeleton.rest_positions[list(joints)]
        length = float(np.linalg.norm(np.diff(rest, axis=0), axis=1).sum())
        arms.append(Arm(sign, joints, max(length, 1e-3), len(joints) == 2))
    return tuple(arms)


def _fingertip(skeleton: Skeleton, parts: Sequence[BodyPart | None], side: Side) -> int | None:
    """The last joint of the middle finger."""
    own = [
        joint
        for joint in skeleton.order
        if (part := parts[joint]) is not None and part.kind is Kind.MIDDLE and part.side is side
    ]
    return own[-1] if own else None


class Gestures:
    """Recognises one kind of gesture of one performer, from frame to frame.

    Args:
        skeleton: the performer's.
        kind: "pose", "raise" or "clap".

    Attributes:
        progress: how much of it is done, in [0, 1].
        wanted: what the performer is asked to do, in words; empty while nothing can be asked for.
    """

    def __init__(self, skeleton: Skeleton, kind: str) -> None:
        self._arms, self._kind = arms_of(skeleton), kind
        self._head = first_of(label_joints(skeleton), skeleton, Kind.HEAD)
        self.progress, self.wanted = 0.0, ""
        self._since = math.nan
        self._kept: Array | None = None
        self._released = True
        self._apart, self._clapped, self._claps = False, -math.inf, 0
        self._met = np.zeros(3)

    def follow(self, pose: Pose) -> bool:
        """Go on to a pose; return whether the gesture has just been completed."""
        arms = [arm for arm in self._arms if not pose.filled[list(arm.joints)].any()]
        places = pose.facing(0.0)
        self.wanted = self._words(arms)
        if not arms:
            self._forget()
            return False
        if self._kind == "clap" and len(arms) == 2:
            return self._clap(arms, places, pose.time)
        raises = self._kind != "pose" and not arms[0].alone
        holds = self._is_raised if raises else _is_stretched
        return self._hold(arms, places, pose.time, holds, RAISED if raises else HELD)

    def _words(self, arms: Sequence[Arm]) -> str:
        if not arms:
            return ""
        one = "left" if arms[0].side > 0.0 else "right"
        if self._kind == "clap" and len(arms) == 2:
            return "Clap three times"
        if arms[0].alone:
            which = "both hands" if len(arms) == 2 else f"your {one} hand"
            return f"Keep {which} open and still for {HELD:g} s"
        if self._kind == "pose":
            which = "both arms" if len(arms) == 2 else f"your {one} arm"
            return f"Stretch {which} out to the side for {HELD:g} s"
        which = "one hand" if len(arms) == 2 else f"your {one} hand"
        return f"Raise {which} above your head for {RAISED:g} s"

    def _hold(
        self,
        arms: Sequence[Arm],
        places: Array,
        time: float,
        holds: Callable[[Sequence[Arm], Array], bool],
        seconds: float,
    ) -> bool:
        """Whether a pose has been held for so long; it counts once until it is let go."""
        if not holds(arms, places):
            self._forget()
            return False
        if not self._released:
            return False
        hands = places[[arm.hand for arm in arms]]
        kept = self._kept
        strays = kept is None or len(kept) != len(hands)
        if kept is not None and not strays:
            far = np.linalg.norm(hands - kept, axis=1)
            strays = bool((far > STILL * arms[0].length).any())
        if strays or not time >= self._since:
            self._kept, self._since = hands, time
        self.progress = min((time - self._since) / seconds, 1.0)
        if self.progress < 1.0:
            return False
        self._released, self.progress = False, 0.0
        return True

    def _forget(self) -> None:
        self.progress, self._kept, self._since, self._released = 0.0, None, math.nan, True

    def _is_raised(self, arms: Sequence[Arm], places: Array) -> bool:
        """Whether one hand is above the head, and the other one, if it is seen, below the chin."""
        up = [self._is_above(arm, places) for arm in arms]
        return sum(up) == 1 and all(
            above or places[arm.hand, 1] < places[arm.joints[0], 1]
            for arm, above in zip(arms, up, strict=True)
        )

    def _is_above(self, arm: Arm, places: Array) -> bool:
        head = None if self._head is None else float(places[self._head, 1])
        shoulder = float(places[arm.joints[0], 1])
        least = shoulder + 0.5 * arm.length if head is None else max(head, shoulder)
        return bool(places[arm.hand, 1] > least + 0.15 * arm.length)

    def _clap(self, arms: Sequence[Arm], places: Array, time: float) -> bool:
        """Whether hands before the chest have met often enough in a short while."""
        left, right = (places[arm.hand] for arm in arms)
        alone, arm = arms[0].alone, arms[0].length
        near, far = (HANDS_TOGETHER, HANDS_APART) if alone else (TOGETHER, APART)
        distance = float(np.linalg.norm(left - right)) / arm
        above = 0.0 if alone else float(left[1] - places[arms[0].joints[0], 1]) / arm
        if not LOWEST < above < HIGHEST or not self._clapped <= time <= self._clapped + LATEST:
            self._claps, self._clapped = 0, -math.inf
        self._apart = self._apart or distance > far
        met = self._apart and distance < near and LOWEST < above < HIGHEST
        if met and time - self._clapped >= SOONEST:
            middle = 0.5 * (left + right)
            strays = float(np.linalg.norm(middle - self._met)) > ELSEWHERE * arm and not alone
            self._apart, self._clapped, self._met = False, time, middle
            self._claps = 1 if strays else self._claps + 1
        self.progress = self._claps / CLAPS
        if self._claps < CLAPS:
            return False
        self._claps, self._clapped, self.progress = 0, -math.inf, 0.0
        return True


def _is_stretched(arms: Sequence[Arm], places: Array) -> bool:
    """Whether all arms point straight to their sides; whether lone hands are open."""
    for arm in arms:
        first, last = places[arm.joints[0]], places[arm.joints[-1]]
        way = last - first
        reach = float(np.linalg.norm(way))
        if reach < STRAIGHT * arm.length:
            return False
        if not arm.alone and (abs(way[1]) > LEVEL * reach or arm.side * way[0] < 0.8 * reach):
            return False
    return True
