"""Facts of a skeleton that conditioning needs: left-right pairs, limbs, long bones, feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import label_joints, partners
from devices.bodies.joint_names import BodyPart, Kind
from devices.skeleton import Skeleton

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# A tracker exchanges whole arms or legs, or only the part beyond elbow or knee. So each kind of
# joint is judged by itself.
_GROUPS = {
    Kind.SHOULDER: 0,
    Kind.UPPER_ARM: 0,
    Kind.LOWER_ARM: 1,
    Kind.HAND: 2,
    Kind.UPPER_LEG: 3,
    Kind.LOWER_LEG: 4,
    Kind.FOOT: 5,
    Kind.TOES: 5,
}
_STEADY = (Kind.LOWER_ARM, Kind.HAND, Kind.LOWER_LEG, Kind.FOOT)
_HAND_GROUP = 2


@dataclass(frozen=True, slots=True, eq=False)
class BodyAnatomy:
    """Anatomy of a skeleton's joints.

    Attributes:
        partner: (J,) the same joint of the other side; a joint in the middle is its own.
        group: (J,) the number of the joints that are exchanged together, -1 for none.
        bones: (B,) the far ends of the limbs' long bones, which keep their length.
        near: (B,) their near ends.
        beyond: (B, J) bool, the far end of each bone and its descendants.
        feet: (F,) ankles and toes.
        feet_rest: (F,) [m] their heights above the floor in standing.
    """

    partner: Indices
    group: Indices
    bones: Indices
    near: Indices
    beyond: NDArray[np.bool_]
    feet: Indices
    feet_rest: Array


def body_anatomy(skeleton: Skeleton) -> BodyAnatomy:
    """Find the anatomy of a skeleton by its joint names, or by its shape."""
    parts = label_joints(skeleton)
    partner = partners(skeleton, parts)
    far = [joint for joint in range(len(parts)) if _is_long_bone(skeleton, parts, joint)]
    feet = [
        joint
        for joint, part in enumerate(parts)
        if part is not None and part.kind in (Kind.FOOT, Kind.TOES)
    ]
    height = skeleton.rest_positions[:, 1]
    sole = float(np.clip(height.min(), 0.0, 0.15))
    return BodyAnatomy(
        partner,
        _groups(parts, partner),
        np.array(far, dtype=np.int64),
        skeleton.parents[far].astype(np.int64) if far else np.zeros(0, dtype=np.int64),
        _beyond(skeleton, far),
        np.array(feet, dtype=np.int64),
        height[feet] - height.min() + sole if feet else np.zeros(0),
    )


def _groups(parts: Sequence[BodyPart | None], partner: Indices) -> Indices:
    """Return the `group` (J,) of a `BodyAnatomy`."""
    group = np.full(len(parts), -1)
    for joint in np.flatnonzero(partner != np.arange(len(parts))).tolist():
        part = parts[joint]
        assert part is not None
        finger = _HAND_GROUP if part.kind.value.endswith(("finger", "thumb")) else -1
        group[joint] = _GROUPS.get(part.kind, finger)
    return group


def _is_long_bone(skeleton: Skeleton, parts: Sequence[BodyPart | None], joint: int) -> bool:
    """Return whether a joint is the far end of a long bone of a limb."""
    part, parent = parts[joint], skeleton.parents[joint]
    if part is None or part.kind not in _STEADY or part.tip or parent < 0:
        return False
    above = parts[parent]
    return above is not None and above.side is part.side


def _beyond(skeleton: Skeleton, joints: list[int]) -> NDArray[np.bool_]:
    """Return for each of the joints (B, J) which joints are itself or its descendants."""
    out = np.zeros((len(joints), len(skeleton.names)), dtype=bool)
    out[np.arange(len(joints)), joints] = True
    for joint in skeleton.order[1:]:
        out[:, joint] |= out[:, skeleton.parents[joint]]
    return out
