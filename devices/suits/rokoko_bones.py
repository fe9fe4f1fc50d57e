"""The bones of a Rokoko actor: names as streamed, parents, and a T-pose.

Source: Rokoko Studio's custom streaming format and the names that its Blender plug-in reads. The
format has no hierarchy and no lengths; the rest pose takes them from the built-in body.
"""

from __future__ import annotations

from devices.bodies.skeleton_on_humanoid import JointOnHumanoid, at, skeleton_on_humanoid

_TRUNK: dict[str, JointOnHumanoid] = {
    "hip": at("", "Hips"),
    "spine": at("hip", "Spine"),
    "chest": ("spine", "Chest", "UpperChest", 0.5),
    "neck": at("chest", "Neck"),
    "head": at("neck", "Head"),
}
_ARM = {
    "Shoulder": "Shoulder",
    "UpperArm": "UpperArm",
    "LowerArm": "LowerArm",
    "Hand": "Hand",
}
_LEG = {"UpLeg": "UpperLeg", "Leg": "LowerLeg", "Foot": "Foot", "Toe": "Toes"}
_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Little")
_SEGMENTS = {"Proximal": "Proximal", "Medial": "Intermediate", "Distal": "Distal"}
_BEYOND = 1.8  # of a finger's middle segment: distance of the tip from the segment's start
_TOE_END = 1.3  # of the distance from ankle to toes


def _side(side: str) -> dict[str, JointOnHumanoid]:
    """The limbs and fingers of "left" or "right"."""
    human = side.capitalize()
    points: dict[str, JointOnHumanoid] = {}
    for hung_on, limb in (("chest", _ARM), ("hip", _LEG)):
        parent = hung_on
        for name, bone in limb.items():
            points[side + name] = at(parent, human + bone)
            parent = side + name
    points[f"{side}ToeEnd"] = (f"{side}Toe", f"{human}Foot", f"{human}Toes", _TOE_END)
    for finger in _FINGERS:
        parent = f"{side}Hand"
        for name, segment in _SEGMENTS.items():
            points[side + finger + name] = at(parent, human + finger + segment)
            parent = side + finger + name
        middle, last = f"{human}{finger}Intermediate", f"{human}{finger}Distal"
        points[f"{side}{finger}Tip"] = (parent, middle, last, _BEYOND)
    return points


SKELETON = skeleton_on_humanoid(_TRUNK | _side("left") | _side("right"))
"""Body and both hands with finger tips, 63 joints."""
