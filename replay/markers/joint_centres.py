"""Estimate the joints of a body from the markers on its skin.

Hips by Bell, Pedersen and Brand 1990 from the pelvis; shoulders 17 % of the acromions' distance
below them (Rab, Petuskey and Bagley 2002); knees, ankles and elbows between their two markers, or,
where there is only the outer one, half a joint's width inwards along the axis about which it bends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIDES = (("left", "Left", 1.0), ("right", "Right", -1.0))
_FORWARD, _DOWN, _OUT = -0.22, 0.30, 0.36  # of the distance of the front of the pelvis (Bell)
_SHOULDER = 0.17  # of the distance of the acromions (Rab)
# Half the width of a joint and of a marker, of the distance of the front of the pelvis (0.24 m).
_KNEE, _ANKLE, _ELBOW = 0.26, 0.19, 0.18
_PELVIS_OF_HIPS = 1.39  # distance of the front of the pelvis, of that of the hips (0.72 by Bell)
_NO_BONE = 0.04  # of the trunk's length
_BENT = 0.35  # sine of the bend beyond which the axis of a joint is seen


def joint_centres(markers: Mapping[str, Array]) -> dict[str, Array]:
    """Return the positions (T, 3) of the joints that the markers tell, by the humanoid's names.

    Args:
        markers: (T, 3) by place (see `replay.markers.marker_names`), of any unit and axes; NaN
            where not seen.
    """
    placed = _completed(dict(markers))
    joints: dict[str, Array] = {}
    across, width = _hips(placed, joints)
    _legs(placed, joints, across, width)
    _arms(placed, joints, width)
    _trunk(placed, joints)
    return {name: found for name, found in joints.items() if np.isfinite(found).all(axis=1).any()}


def completed_cluster(points: Array) -> Array:
    """Fill in the points (T, N, 3) of a rigid body where three others are seen, by a rigid fit.

    Source: Arun, Huang and Blostein 1987, on the shape of the median frame.
    """
    seen: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(points), axis=2)
    number_seen = np.count_nonzero(seen, axis=1)
    lost = (number_seen >= 3) & (number_seen < points.shape[1])
    whole = points[number_seen == points.shape[1]]
    if not lost.any() or not len(whole):
        return points
    shape = _middle_shape(whole)
    there = seen[lost][..., None]
    number = there.sum(axis=1, keepdims=True)
    given = np.where(there, points[lost], 0.0)
    middle, own = given.sum(axis=1, keepdims=True), np.where(there, shape, 0.0)
    middle, centre = middle / number, own.sum(axis=1, keepdims=True) / number
    covariance = np.einsum(
        "tni,tnj->tij", np.where(there, shape - centre, 0.0), np.where(there, given - middle, 0.0)
    )
    u, _, vt = np.linalg.svd(covariance)
    flip = np.ones((len(u), 3))
    flip[:, 2] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    turn = np.einsum("tji,tj,tkj->tik", vt, flip, u)
    fitted = np.einsum("tij,tnj->tni", turn, shape - centre) + middle
    filled = points.copy()
    filled[lost] = np.where(there, points[lost], fitted)
    return filled


def _middle_shape(whole: Array) -> Array:
    """The frame (N, 3) of whole ones (T, N, 3) whose distances are nearest to the medians."""
    apart = np.linalg.norm(whole - np.roll(whole, 1, axis=1), axis=2)
    off = np.abs(apart - np.median(apart, axis=0)).sum(axis=1)
    nearest: Array = whole[int(np.argmin(off))]
    return nearest


def _completed(placed: dict[str, Array]) -> dict[str, Array]:
    """The markers, with lost ones of pelvis and head filled in."""
    for names in (("asis", "psis"), ("head front", "head back")):
        cluster = [f"{side} {name}" for side, *_ in SIDES for name in names]
        if placed.keys() >= set(cluster):
            filled = completed_cluster(np.stack([placed[name] for name in cluster], axis=1))
            placed |= {name: filled[:, column] for column, name in enumerate(cluster)}
    return placed


def _hips(placed: Mapping[str, Array], joints: dict[str, Array]) -> tuple[Array | None, float]:
    """Add the hips; return the axis (T, 3) from right to left, and the width of the pelvis."""
    front = [placed.get(f"{side} asis") for side, *_ in SIDES]
    back = _mean(placed, "left psis", "right psis")
    back = _mean(placed, "sacrum") if back is None else back
    across, width = None, np.nan
    if front[0] is not None and front[1] is not None:
        across, width = _unit(front[0] - front[1]), _usual(front[0] - front[1])
        if back is not None:
            middle = (front[0] + front[1]) / 2
            forward = _unit(_across(middle - back, across))
            upward = np.cross(forward, across)
            for _, side, sign in SIDES:
                out = across * (sign * _OUT) + forward * _FORWARD - upward * _DOWN
                joints[f"{side}UpperLeg"] = middle + width * out
    names = ("hip",) if "LeftUpperLeg" in joints else ("hip", "hip point")
    left, right = (_first(placed, *(f"{side} {name}" for name in names)) for side, *_ in SIDES)
    if left is not None and right is not None:
        joints["LeftUpperLeg"], joints["RightUpperLeg"] = left, right
        across = _unit(left - right) if across is None else across
        width = _PELVIS_OF_HIPS * _usual(left - right) if np.isnan(width) else width
    if "LeftUpperLeg" in joints:
        joints["Hips"] = (joints["LeftUpperLeg"] + joints["RightUpperLeg"]) / 2
    elif "pelvis" in placed:
        joints["Hips"] = placed["pelvis"]
    return across, width


def _legs(
    placed: Mapping[str, Array], joints: dict[str, Array], across: Array | None, width: float
) -> None:
    for side, name, sign in SIDES:
        knee, ankle = (
            _first(placed, f"{side} {joint}", f"{side} {joint} out") for joint in ("knee", "ankle")
        )
        hip = joints.get(f"{name}UpperLeg")
        if knee is None or ankle is None:
            continue
        axis = None
        if across is not None and hip is not None:
            axis = _hinge(hip, knee, ankle, -sign * across)
        for joint, bone, half in (("knee", "LowerLeg", _KNEE), ("ankle", "Foot", _ANKLE)):
            joints[name + bone] = _between(placed, f"{side} {joint}", axis, half * width)
        toe = _first(placed, f"{side} toe")
        toe = _mean(placed, f"{side} toe in", f"{side} toe out") if toe is None else toe
        if toe is not None:
            joints[f"{name}Toes"] = toe


def _trunk(placed: Mapping[str, Array], joints: dict[str, Array]) -> None:
    if {"LeftUpperArm", "RightUpperArm"} <= joints.keys():
        joints["UpperChest"] = (joints["LeftUpperArm"] + joints["RightUpperArm"]) / 2
    chest, neck = _mean(placed, "t10", "sternum"), _mean(placed, "c7", "clavicle")
    neck = placed.get("neck") if neck is None else neck
    if chest is not None:
        joints["Chest"] = chest
    if neck is not None and not _coincide(neck, joints.get("UpperChest"), joints.get("Hips")):
        joints["Neck"] = neck
    corners = [f"{side} {place}" for side, *_ in SIDES for place in ("head front", "head back")]
    for names in (corners, ("left ear", "right ear"), ("head", "nose"), ("head",), ("nose",)):
        head = _mean(placed, *names)
        if head is not None:
            joints["Head"] = head
            break


def _arms(placed: Mapping[str, Array], joints: dict[str, Array], width: float) -> None:
    tops = [placed.get(f"{side} acromion") for side, *_ in SIDES]
    sunk = None
    if tops[0] is not None and tops[1] is not None and "Hips" in joints:
        middle = (tops[0] + tops[1]) / 2
        sunk = _unit(joints["Hips"] - middle) * (_SHOULDER * _usual(tops[0] - tops[1]))
    for (side, name, sign), top in zip(SIDES, tops, strict=True):
        shoulder = placed.get(f"{side} shoulder")
        if shoulder is None and top is not None:
            shoulder = top if sunk is None else top + sunk
        if shoulder is None:
            continue
        joints[f"{name}UpperArm"] = shoulder
        elbow = _first(placed, f"{side} elbow", f"{side} elbow out")
        wrist = _first(placed, f"{side} wrist")
        ends = (f"{side} wrist thumb", f"{side} wrist little")
        wrist = _mean(placed, *ends) if wrist is None else wrist
        wrist = _first(placed, *ends) if wrist is None else wrist
        if elbow is None or wrist is None:
            continue
        bend = np.cross(_unit(elbow - shoulder), _unit(wrist - elbow))
        axis = sign * bend * (1.0 / np.maximum(np.linalg.norm(bend, axis=1, keepdims=True), _BENT))
        joints[f"{name}LowerArm"] = _between(placed, f"{side} elbow", axis, _ELBOW * width)
        joints[f"{name}Hand"] = wrist
        if f"{side} knuckle" in placed:
            joints[f"{name}MiddleProximal"] = placed[f"{side} knuckle"]


def _between(placed: Mapping[str, Array], place: str, axis: Array | None, half: float) -> Array:
    """A joint (T, 3) as given, between its two markers, or inwards of the outer one."""
    both = _mean(placed, f"{place} out", f"{place} in")
    given = placed.get(place)
    if given is not None and both is None and f"{place} in" in placed:
        both = _mean(placed, place, f"{place} in")  # the plain name is the outer marker's
    if both is not None:
        return both if given is None or f"{place} out" not in placed else given
    if given is not None:
        return given
    outer = placed[f"{place} out"]
    return outer if axis is None or np.isnan(half) else outer + half * axis


def _hinge(hip: Array, knee: Array, ankle: Array, inward: Array) -> Array:
    """The axis (T, 3) of a knee, inwards: by its bend where it is bent, else by the pelvis."""
    thigh, shin = _unit(knee - hip), _unit(ankle - knee)
    bend = np.cross(thigh, shin)
    sine = np.linalg.norm(bend, axis=1, keepdims=True)
    bend = bend * np.where((bend * inward).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    level = _unit(_across(inward, thigh))
    share = np.clip(sine / _BENT - 1.0, 0.0, 1.0)
    return _unit((1.0 - share) * level + share * _unit(bend))


def _coincide(neck: Array, shoulders: Array | None, hips: Array | None) -> bool:
    """Whether a neck is a key point between the shoulders, which leaves no bone to it."""
    if shoulders is None or hips is None:
        return False
    return not _usual(neck - shoulders) > _NO_BONE * _usual(shoulders - hips)


def _first(placed: Mapping[str, Array], *names: str) -> Array | None:
    return next((placed[name] for name in names if name in placed), None)


def _mean(placed: Mapping[str, Array], *names: str) -> Array | None:
    """The mean of markers, or None where one of them is not in the file."""
    if not all(name in placed for name in names):
        return None
    mean: Array = np.mean([placed[name] for name in names], axis=0)
    return mean


def _usual(vectors: Array) -> float:
    """The median length of vectors (T, 3); NaN if none is known."""
    lengths = np.linalg.norm(vectors, axis=1)
    lengths = lengths[np.isfinite(lengths)]
    return float(np.median(lengths)) if lengths.size else float("nan")


def _across(vectors: Array, axis: Array) -> Array:
    """What is left of vectors (T, 3) perpendicular to unit axes (T, 3)."""
    rest: Array = vectors - (vectors * axis).sum(axis=1, keepdims=True) * axis
    return rest


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: Array = np.divide(vectors, length, out=np.full_like(vectors, np.nan), where=length > 0.0)
    return unit


def missing_parts(joints: Sequence[str]) -> str:
    """Which markers make a body of these joints, or "" if they are one: hips with legs or arms."""
    if "Hips" not in joints:
        return "a pelvis (LASI RASI LPSI RPSI)"
    if not has_limbs(joints, "LowerLeg", "Foot") and not has_limbs(joints, "LowerArm", "Hand"):
        return "both legs (LKNE RKNE LANK RANK) or both arms (LSHO RSHO LELB RELB LWRA LWRB ...)"
    return ""


def has_limbs(joints: Sequence[str], *bones: str) -> bool:
    """Whether the joints are there on both sides."""
    return all(f"{side}{bone}" in joints for _, side, _ in SIDES for bone in bones)
