"""Unity's humanoid skeleton: the 55 bones that VMC names, in an average T-pose.

A joint lies at the start of the bone of the same name. The offsets are those of a person of 1.7 m;
they are used when a sender gives none.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from devices.skeleton import Skeleton

SIDES = ("Left", "Right")
FINGERS = ("Thumb", "Index", "Middle", "Ring", "Little")
SEGMENTS = ("Proximal", "Intermediate", "Distal")

# Parent and offset [m] from it; the left side is at +X.
_CENTRE: dict[str, tuple[str | None, tuple[float, float, float]]] = {
    "Hips": (None, (0.0, 0.95, 0.0)),
    "Spine": ("Hips", (0.0, 0.08, -0.01)),
    "Chest": ("Spine", (0.0, 0.12, -0.01)),
    "UpperChest": ("Chest", (0.0, 0.12, 0.0)),
    "Neck": ("UpperChest", (0.0, 0.17, 0.0)),
    "Head": ("Neck", (0.0, 0.10, 0.02)),
    "Jaw": ("Head", (0.0, 0.01, 0.03)),
}
_LEFT: dict[str, tuple[str, tuple[float, float, float]]] = {
    "UpperLeg": ("Hips", (0.09, -0.06, 0.0)),
    "LowerLeg": ("LeftUpperLeg", (0.0, -0.41, 0.01)),
    "Foot": ("LeftLowerLeg", (0.0, -0.40, -0.02)),
    "Toes": ("LeftFoot", (0.0, -0.06, 0.13)),
    "Shoulder": ("UpperChest", (0.03, 0.11, 0.0)),
    "UpperArm": ("LeftShoulder", (0.13, 0.0, 0.0)),
    "LowerArm": ("LeftUpperArm", (0.28, 0.0, 0.0)),
    "Hand": ("LeftLowerArm", (0.25, 0.0, 0.0)),
    "Eye": ("Head", (0.03, 0.07, 0.08)),
}
# Where each finger begins in the hand, and the lengths [m] of its first two segments.
_LEFT_FINGERS = {
    "Thumb": ((0.03, -0.015, 0.025), (0.04, 0.03), (0.75, -0.25, 0.61)),
    "Index": ((0.095, 0.0, 0.025), (0.04, 0.024), (1.0, 0.0, 0.0)),
    "Middle": ((0.095, 0.003, 0.005), (0.045, 0.027), (1.0, 0.0, 0.0)),
    "Ring": ((0.09, 0.0, -0.015), (0.041, 0.026), (1.0, 0.0, 0.0)),
    "Little": ((0.085, -0.005, -0.033), (0.032, 0.019), (1.0, 0.0, 0.0)),
}

OPTIONAL = frozenset(
    (
        *("Chest", "UpperChest", "Neck", "Jaw"),
        *(side + bone for side in SIDES for bone in ("Shoulder", "Toes", "Eye")),
        *(side + finger + end for side in SIDES for finger in FINGERS for end in SEGMENTS),
    )
)
"""Bones that a Unity humanoid may lack; their children then hang on the nearest ancestor."""

ONWARD = {
    "Chest": "UpperChest",
    "UpperChest": "Neck",
    "Neck": "Head",
    "LeftShoulder": "LeftUpperArm",
    "RightShoulder": "RightUpperArm",
}
"""The next bone of the trunk or limb after an optional bone."""


@lru_cache(maxsize=1)
def humanoid_skeleton() -> Skeleton:
    """Return the 55 bones at rest in a T-pose, feet on the floor, facing +Z."""
    parents: dict[str, str | None] = {}
    rest: dict[str, np.ndarray] = {}

    def add(name: str, parent: str | None, offset: tuple[float, ...]) -> None:
        parents[name] = parent
        rest[name] = np.array(offset) + (rest[parent] if parent is not None else 0.0)

    for name, (parent, offset) in _CENTRE.items():
        add(name, parent, offset)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        for bone, (above, (x, y, z)) in _LEFT.items():
            add(side + bone, above.replace("Left", side), (sign * x, y, z))
        for finger, (base, lengths, way) in _LEFT_FINGERS.items():
            steps = (np.array(base), *(length * np.array(way) for length in lengths))
            above = f"{side}Hand"
            for end, (x, y, z) in zip(SEGMENTS, steps, strict=True):
                add(side + finger + end, above, (sign * x, y, z))
                above = side + finger + end
    names = tuple(parents)
    number = {name: joint for joint, name in enumerate(names)}
    above_each = [-1 if above is None else number[above] for above in parents.values()]
    return Skeleton(names, np.array(above_each), np.array([rest[name] for name in names]))
