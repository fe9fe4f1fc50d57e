"""A performer's trunk and head while standing upright: the zero from which turns are measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from runtime.driving.body.joint_turns import about_vertical
from solvers.retarget.trunk_turns import TrunkJoints, orientations
from solvers.skeleton.quaternions import conjugate, multiply, rotate

Array = NDArray[np.float64]

_STANDING = np.cos(np.radians(25.0))  # of the trunk of a rest pose that is upright
_LEANING = np.cos(np.radians(35.0))  # of the trunk of a pose that is measured
_LEVEL = np.cos(np.radians(50.0))  # of the trunk of an animal that stands
_UP = np.array([0.0, 1.0, 0.0])
PELVIS, CHEST, HEAD = 0, 1, 2


def upright_at_rest(
    upright: Array, facing: float, joints: TrunkJoints, feet: Sequence[int] = ()
) -> Array:
    """Return the orientations (3, 4) of pelvis, chest and head as the rest pose has them.

    A part that does not stand upright there is taken to be vertical, but for the trunk of an animal
    that stands. Only how far it leans forward is kept: a rest pose in mid-step twists the hips, and
    standing upright does not.

    Args:
        upright: (J, 3) [m] the performer's rest pose, turned as the character faces.
        facing: [rad] the heading of both.
        joints: what shows the turns of the trunk.
        feet: (F,) joints at the ends of the legs.
    """
    own = orientations(upright, joints)
    is_level = _is_level(upright, joints, feet)
    for part in (PELVIS, CHEST):
        own[part] = _nodding(own[part], facing)
        if rotate(own[part], _UP)[1] < _STANDING and not is_level:
            own[part] = about_vertical(facing)
    if joints.face[2] < 0 and joints.head >= 0 and own[HEAD, 1] < _STANDING and not is_level:
        own[HEAD] = np.append(_UP, 0.0)
    return own


def _is_level(upright: Array, joints: TrunkJoints, feet: Sequence[int]) -> bool:
    """Whether a body (J, 3) stands on its legs with a level trunk, as animals do."""
    if not len(feet) or joints.hips[0] < 0 or joints.shoulders[0] < 0:
        return False
    hips, shoulders = upright[joints.hips].mean(axis=0), upright[joints.shoulders].mean(axis=0)
    spine, leg = shoulders - hips, hips - upright[list(feet)].mean(axis=0)
    return bool(
        spine[1] < _LEVEL * np.linalg.norm(spine) and leg[1] > _LEANING * np.linalg.norm(leg)
    )


def upright_in_poses(at_rest: Array, joints: TrunkJoints, poses: Sequence[Array]) -> Array:
    """Return the orientations (3, 4) of the upright body, as a sensor shows it.

    Sensors put waist and head elsewhere than the skeleton's rest pose, by up to 40 degrees. So how
    pelvis, chest and head stand to the line from hips to neck is averaged over poses; where that
    line stands while upright is the rest pose's.

    Args:
        at_rest: (3, 4) as of `upright_at_rest`.
        joints: what shows the turns of the trunk.
        poses: (J, 3) [m] each, turned as the character faces.
    """
    line_of = joints._replace(waist=-1)
    found: list[Array] = []
    for pose in poses:
        line, own = orientations(pose, line_of)[CHEST], orientations(pose, joints)
        if line.any() and own[:HEAD].any(axis=1).all() and rotate(line, _UP)[1] > _LEANING:
            found.append(_against(line, own, joints))
    if not found:
        return at_rest
    out, line = at_rest.copy(), at_rest[CHEST] if joints.waist < 0 else _line_at_rest(at_rest)
    every = np.array(found)
    for part in (PELVIS, CHEST):
        own = Rotation.from_quat(every[:, part]).mean().as_quat()
        out[part] = multiply(line, _nodding(own, 0.0))
    if joints.head >= 0 and joints.face[2] < 0:
        rise = every[:, HEAD, :3].mean(axis=0)
        out[HEAD, :3] = rotate(line, rise / max(float(np.linalg.norm(rise)), 1e-9))
    elif every[:, HEAD].any(axis=1).all() and joints.face[2] >= 0:
        out[HEAD] = multiply(line, Rotation.from_quat(every[:, HEAD]).mean().as_quat())
    return out


def _nodding(orientation: Array, facing: float) -> Array:
    """The orientation (4,) that faces exactly so and leans as far forward as another."""
    up = rotate(multiply(about_vertical(-facing), orientation), _UP)
    half = 0.5 * np.arctan2(up[2], up[1])
    return multiply(about_vertical(facing), np.array([np.sin(half), 0.0, 0.0, np.cos(half)]))


def _against(line: Array, own: Array, joints: TrunkJoints) -> Array:
    """The orientations (3, 4) of the parts in the axes of the line from hips to neck."""
    out = multiply(conjugate(line), own)
    if joints.face[2] < 0:
        out[HEAD] = np.append(rotate(conjugate(line), own[HEAD, :3]), 0.0)
    return out


def _line_at_rest(at_rest: Array) -> Array:
    """The orientation of the line from hips to neck: between pelvis and chest."""
    middle: Array = Rotation.from_quat(at_rest[:HEAD]).mean().as_quat()
    return middle
