"""The plan of a body: its trunk, head, arms, legs and fingers as chains of joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from devices.bodies.joint_names import Kind, Side

SIDES = (Side.LEFT, Side.RIGHT)
SEGMENTS_IN_WORDS: Mapping[str, tuple[str, str, str]] = {
    "arm": ("upper arm", "forearm", "hand"),
    "leg": ("thigh", "shin", "foot"),
    "foreleg": ("upper foreleg", "lower foreleg", "forefoot"),
    "hind leg": ("thigh", "shin", "hind foot"),
    "front leg": ("upper front leg", "lower front leg", "front foot"),
    "wing": ("inner wing", "outer wing", "wing tip"),
    "fin": ("inner fin", "outer fin", "fin tip"),
}
"""What people call the segments of a limb, by what `BodyPlan` calls the limb."""

Chain = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Limb:
    """An arm or a leg: its segments from the trunk outward, each a chain of joints.

    Each segment begins where the one before it ends, and is straight: it bends at its ends only.

    Attributes:
        upper: from the shoulder to the elbow, or from the hip to the knee.
        lower: from the elbow to the wrist, or from the knee to the ankle; empty where the limb has
            no such joint.
        end: the hand to its tip, or the foot to its ball; empty where nothing is beyond.
    """

    upper: Chain
    lower: Chain = ()
    end: Chain = ()

    @property
    def segments(self) -> tuple[Chain, ...]:
        """The segments that are there, from the trunk outward."""
        return tuple(chain for chain in (self.upper, self.lower, self.end) if chain)

    @property
    def chain(self) -> Chain:
        """All joints of the limb, from the trunk outward."""
        return (*self.upper, *self.lower[1:], *self.end[1:])


@dataclass(frozen=True, slots=True)
class BodyPlan:
    """The parts of a body that other bodies have too; a part may be missing.

    The left is the body's own left. Joints that belong to no part ride on the joint that they hang
    on.

    Attributes:
        trunk: from the hips to the joint that carries neck and arms; the hips alone if the body
            has no spine.
        head: from the end of the trunk, or above it, along the neck to the top of the head; empty
            for none.
        skull: the joint about which the head turns; None where `head` is empty.
        arms, legs: by side. Wings, fins and forelegs are arms.
        more_legs: pairs of legs between arms and legs, from the front to the hind, each by side: of
            a spider two, of an insect one.
        fingers: by side and kind, each from its knuckle to its tip.
        tail: from the trunk to its tip; empty for none.
        arm_word, leg_word: what people call its arms and legs: a key of `SEGMENTS_IN_WORDS`.
    """

    trunk: Chain
    head: Chain = ()
    skull: int | None = None
    arms: Mapping[Side, Limb] = field(default_factory=dict)
    legs: Mapping[Side, Limb] = field(default_factory=dict)
    fingers: Mapping[tuple[Side, Kind], Chain] = field(default_factory=dict)
    tail: Chain = ()
    more_legs: tuple[Mapping[Side, Limb], ...] = ()
    arm_word: str = "arm"
    leg_word: str = "leg"

    @property
    def hips(self) -> int:
        """The joint that carries the body."""
        return self.trunk[0]

    @property
    def is_body(self) -> bool:
        """Whether the parts are enough to drive a body by: a pair of limbs on a trunk."""
        return len(self.arms) == len(SIDES) or len(self.legs) == len(SIDES)

    def in_words(self) -> dict[str, Chain]:
        """The parts by what people call them: "trunk", "head", "left arm", "right hind leg"."""
        limbs = ((self.arm_word, self.arms), (self.leg_word, self.legs))
        parts = {
            "trunk": self.trunk,
            "head": self.head,
            **{f"{side} {word}": pair[side].chain for word, pair in limbs for side in pair},
            **{f"{side} {kind}": chain for (side, kind), chain in self.fingers.items()},
            "tail": self.tail,
            **{
                f"{side} leg {number}": pair[side].chain
                for number, pair in enumerate(self.more_legs, 2)
                for side in pair
            },
        }
        return {words: chain for words, chain in parts.items() if chain}
