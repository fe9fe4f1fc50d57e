"""The segments of Xsens MVN's body: names and order of the protocol, parents, and its T-pose.

A joint is the origin of a segment, where it connects to its parent. Source: MVN real-time network
streaming protocol specification, tables 1 and 2 (segments, finger tracking segments). The protocol
gives no lengths in advance; the rest pose takes them from the built-in body.
"""

from __future__ import annotations

from functools import lru_cache

from devices.bodies.skeleton_on_humanoid import JointOnHumanoid, at, skeleton_on_humanoid
from devices.skeleton import Skeleton

BODY = 23
FINGERS_A_HAND = 20

_TRUNK: dict[str, JointOnHumanoid] = {
    "Pelvis": at("", "Hips"),
    "L5": at("Pelvis", "Spine"),
    "L3": ("L5", "Spine", "Chest", 0.5),
    "T12": ("L3", "Chest", "UpperChest", 0.3),
    "T8": at("T12", "UpperChest"),
    "Neck": at("T8", "Neck"),
    "Head": at("Neck", "Head"),
}
_ARM = {"Shoulder": "Shoulder", "UpperArm": "UpperArm", "ForeArm": "LowerArm", "Hand": "Hand"}
_LEG = {"UpperLeg": "UpperLeg", "LowerLeg": "LowerLeg", "Foot": "Foot", "Toe": "Toes"}
_CARPUS = 0.2  # of the distance from the wrist to the middle finger's knuckle
_METACARPAL = 0.35  # of the distance from the wrist to a finger's knuckle


@lru_cache(maxsize=2)
def xsens_skeleton(*, fingers: bool = False) -> Skeleton:
    """Return the 23 segments of the body in a T-pose; with `fingers` also the 20 of each hand.

    Joints are in MVN's order of segments, left fingers before right ones.
    """
    points = dict(_TRUNK)
    for hung_on, limb in (("T8", _ARM), ("Pelvis", _LEG)):
        for side in ("Right", "Left"):
            parent = hung_on
            for name, bone in limb.items():
                points[side + name] = at(parent, side + bone)
                parent = side + name
    for side in ("Left", "Right") if fingers else ():
        points |= _hand(side)
    return skeleton_on_humanoid(points)


def _hand(side: str) -> dict[str, JointOnHumanoid]:
    """The segments of one hand; a thumb has no middle phalanx, its first bone is a metacarpal."""
    wrist, carpus = f"{side}Hand", f"{side}Carpus"
    points = {
        carpus: (wrist, wrist, f"{side}MiddleProximal", _CARPUS),
        f"{side}ThumbMetacarpal": at(carpus, f"{side}ThumbProximal"),
        f"{side}ThumbProximal": at(f"{side}ThumbMetacarpal", f"{side}ThumbIntermediate"),
        f"{side}ThumbDistal": at(f"{side}ThumbProximal", f"{side}ThumbDistal"),
    }
    for finger in ("Index", "Middle", "Ring", "Little"):
        above = f"{side}{finger}Metacarpal"
        points[above] = (carpus, wrist, f"{side}{finger}Proximal", _METACARPAL)
        for segment in ("Proximal", "Intermediate", "Distal"):
            name = f"{side}{finger}{segment}"
            points[name] = at(above, name)
            above = name
    return points
