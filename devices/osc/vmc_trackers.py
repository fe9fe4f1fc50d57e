"""The bones that VMC trackers are attached to, from their names or from the address option."""

from __future__ import annotations

from devices.bodies.joint_names import Kind, Side, part_of_name
from devices.osc.vmc_packets import BONES

_TRACKED = {
    Kind.HEAD: "Head",
    Kind.NECK: "Neck",
    Kind.CHEST: "Chest",
    Kind.SPINE: "Spine",
    Kind.HIPS: "Hips",
    Kind.UPPER_ARM: "UpperArm",
    Kind.LOWER_ARM: "LowerArm",
    Kind.HAND: "Hand",
    Kind.UPPER_LEG: "UpperLeg",
    Kind.LOWER_LEG: "LowerLeg",
    Kind.FOOT: "Foot",
    Kind.TOES: "Toes",
}


def bone_of_tracker(serial: str) -> int | None:
    """Return the bone that a tracker's name describes ("waist", "LeftFoot"), or None."""
    part = part_of_name(serial) if len(serial) <= 64 else None
    if part is None or part.kind not in _TRACKED:
        return None
    side = "" if part.side is Side.CENTRE else part.side.value.capitalize()
    return BONES.get(side + _TRACKED[part.kind])


def bones_of_trackers(text: str) -> dict[str, int]:
    """Parse ``SERIAL:BONE,SERIAL:BONE``."""
    trackers: dict[str, int] = {}
    for pair in text.split(","):
        serial, colon, bone = pair.rpartition(":")
        if not colon or bone not in BONES:
            raise ValueError("expected SERIAL:BONE,... with bones such as Hips or LeftFoot")
        trackers[serial] = BONES[bone]
    return trackers
