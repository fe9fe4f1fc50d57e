"""The joints of Leap Motion hands, and the conversion of device coordinates to ours.

A Leap lies on the desk and looks up: +X to the user's right, +Y up, +Z towards the user,
millimetres from the middle of the device. The fingers above it point away from the user, between
level and straight up. Our performer faces the camera at +Z with left at +X, so the hands are turned
by 180 degrees about Y. They are then turned by 45 degrees about X, so that both forward and up on
the device are up in the picture. Palm and fingers of a level hand and of an upright one both appear
at 0.7 of their length, and the usual pose between the two appears in full. Turned by 180 degrees
only, the fingers of a level hand would point into the camera, where their motion is invisible.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.skeleton import Skeleton

Array = NDArray[np.float64]

FINGERS = ("thumb", "index", "middle", "ring", "pinky")
PALM = "palm"
ROOT = "hands"
SIDES = ("left", "right")

_TILT = np.sqrt(0.5)
LEAP_TO_WORLD = 1e-3 * np.array([[-1.0, 0.0, 0.0], [0.0, _TILT, -_TILT], [0.0, -_TILT, -_TILT]])
LEAP_TO_WORLD.setflags(write=False)

# Root of two hands: 25 cm towards the user from the middle of the tracked space, about the place of
# the chest. It does not move, so a moving hand swings about it.
_CHEST_MM = (0.0, 200.0, 250.0)

_NO_BONE = ("thumb", "mcp")

# Parents of one hand. The near ends of the metacarpals (carpPosition; of the thumb, whose
# metacarpal has no length in the device's model, mcpPosition) are omitted: they lie behind the
# middle of the palm, and a chain through them would first run backwards.
HAND_PARENTS: Mapping[str, str | None] = {
    "elbow": None,
    "wrist": "elbow",
    PALM: "wrist",
    **{
        f"{finger}_{end}": f"{finger}_{start}" if start and (finger, start) != _NO_BONE else PALM
        for finger in FINGERS
        for start, end in ((None, "mcp"), ("mcp", "pip"), ("pip", "dip"), ("dip", "tip"))
        if (finger, end) != _NO_BONE
    },
}

# A flat right hand with its palm to the camera: degrees from straight up, towards the thumb.
_FAN = {"thumb": (60.0, 40.0), "index": (20.0, 8.0), "middle": (4.0, 1.0)}
_FAN |= {"ring": (-12.0, -6.0), "pinky": (-28.0, -14.0)}
_LENGTHS = {"mcp": 0.055, "pip": 0.042, "dip": 0.026, "tip": 0.022, "wrist": 0.25, PALM: 0.065}
_TIP_ONLY = 0.10


def leap_to_world(millimetres: ArrayLike) -> Array:
    """Convert Leap positions (..., 3) [mm, device axes] to our coordinates (..., 3) [m]."""
    return np.asarray(millimetres, dtype=np.float64) @ LEAP_TO_WORLD.T


def chest() -> Array:
    """Return the position (3,) [m] of the root of two hands."""
    return leap_to_world(_CHEST_MM)


def hand_skeleton(
    joints: Iterable[str],
    sides: tuple[str, ...] = (),
    lengths: Mapping[str, float] | None = None,
    *,
    left: bool = False,
) -> Skeleton:
    """Return the skeleton of one hand, or of two hands with a common root.

    Args:
        joints: the available joints of `HAND_PARENTS`; the palm is always included. The parent of a
            joint is its nearest ancestor among them.
        sides: empty for one hand, whose joints have bare names; else the sides that prefix the
            names, "left_palm" and so on, under the root "hands".
        lengths: [m] of the bone that ends at a joint, by its bare name; by default an adult's.
        left: whether a single hand is a left hand.

    The rest pose is a flat hand, fingers up, palm to the camera.
    """
    present = [name for name in HAND_PARENTS if name in {*joints, PALM}]
    parents = {name: _ancestor(name, present) for name in present}
    rest = _rest_hand(parents, lengths or {})
    if not sides:
        rest_positions = np.array([rest[name] - rest[PALM] for name in present])
        rest_positions[:, 0] *= -1.0 if left else 1.0
        return Skeleton(tuple(present), _indices(present, parents), rest_positions)
    names = [ROOT]
    tree: dict[str, str | None] = {ROOT: None}
    places = [chest()]
    for side in sides:
        mirror = np.array([-1.0 if side == "left" else 1.0, 1.0, 1.0])
        beside = chest() + np.array([0.12 if side == "left" else -0.12, 0.15, 0.0])
        for name in present:
            names.append(f"{side}_{name}")
            parent = parents[name]
            tree[names[-1]] = ROOT if parent is None else f"{side}_{parent}"
            places.append(beside + mirror * (rest[name] - rest[present[0]]))
    return Skeleton(tuple(names), _indices(names, tree), np.array(places))


def _ancestor(name: str, present: list[str]) -> str | None:
    parent = HAND_PARENTS[name]
    while parent is not None and parent not in present:
        parent = HAND_PARENTS[parent]
    return parent


def _indices(names: list[str], parents: Mapping[str, str | None]) -> NDArray[np.int64]:
    found = [-1 if (parent := parents[name]) is None else names.index(parent) for name in names]
    return np.array(found, dtype=np.int64)


def _rest_hand(parents: Mapping[str, str | None], lengths: Mapping[str, float]) -> dict[str, Array]:
    """The joints of a flat right hand; the first joint is at the origin."""
    places: dict[str, Array] = {}
    for name, parent in parents.items():
        if parent is None:
            places[name] = np.zeros(3)
            continue
        finger, _, end = name.rpartition("_")
        usual = _TIP_ONLY if (end, parent) == ("tip", PALM) else _LENGTHS[end]
        spread = _FAN[finger][0 if parent == PALM else 1] if finger else 0.0
        angle = np.radians(spread)
        direction = np.array([np.sin(angle), np.cos(angle), 0.0])
        places[name] = places[parent] + lengths.get(name, usual) * direction
    return places
