"""One performer's MediaPipe landmarks, of the world or of an image, made into joints in metres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.mediapipe.joints import HAND_BONES, HAND_LANDMARKS, MIDDLES, PARENTS, SIDES

Array = NDArray[np.float64]
# A landmark's track is (T, 4): x, y, z in MediaPipe's axes, and its confidence; where it was not
# seen NaN, NaN, NaN, 0.
Tracks = Mapping[str, Array]

SHOULDERS = 0.36  # [m] of a grown-up
HAND = 0.09  # [m] from the wrist to the first joint of the middle finger
FARTHEST = 1e7  # in whatever unit the landmarks come

_LIMBS = [
    (f"{side}_{start}", f"{side}_{end}")
    for side in SIDES
    for start, end in (
        ("shoulder", "elbow"),
        ("elbow", "wrist"),
        ("hip", "knee"),
        ("knee", "ankle"),
    )
]
_PALM = ("wrist", "middle_finger_mcp")


@dataclass(frozen=True, slots=True, eq=False)
class PersonLandmarks:
    """One performer's landmarks, T frames.

    Attributes:
        times: (T,) [s].
        performer: who it is.
        world: the pose [m], from the middle of the hips, by joint name; empty if there is none.
        image: the pose in the image [pixels, z too as far as its scale is known].
        hands: for each side the hand's landmarks in the same units as `image`.
    """

    times: Array
    performer: int
    world: Tracks
    image: Tracks
    hands: Mapping[str, Tracks]


def track(points: Array, confidence: Array) -> Array:
    """(T, 4) track of a landmark from its points (T, 3) and confidence (T,)."""
    found = np.concatenate([points, np.clip(np.nan_to_num(confidence), 0.0, 1.0)[:, None]], axis=1)
    near: NDArray[np.bool_] = np.abs(points) <= FARTHEST  # False for NaN
    found[~np.logical_and.reduce(near, axis=1) | (found[:, 3] <= 0)] = (np.nan,) * 3 + (0.0,)
    return found


def seen(tracks: Tracks) -> dict[str, Array]:
    """Those landmarks that are seen in any frame."""
    return {name: found for name, found in tracks.items() if (found[:, 3] > 0).any()}


def joints_in_metres(person: PersonLandmarks) -> dict[str, Array]:
    """Tracks [m, MediaPipe's axes] of the joints of `devices.mediapipe.joints` that were seen."""
    world, image = seen(person.world), _with_depth(seen(person.image), _LIMBS)
    hands = {
        side: _with_depth(seen(person.hands[side]), HAND_BONES.items()) for side in person.hands
    }
    metres = _metres_a_pixel(world, image, hands)
    body = world or {name: _scaled(found, metres) for name, found in image.items()}
    joints = {name: found for name, found in body.items() if name in PARENTS}
    for side, hand in hands.items():
        if "wrist" in hand and len(hand) > 1:
            for finger in ("thumb", "index", "pinky"):
                joints.pop(f"{side}_{finger}", None)
            wrist = joints.setdefault(f"{side}_wrist", _scaled(hand["wrist"], metres))
            for name in HAND_LANDMARKS[1:]:
                if name in hand:
                    offset = hand[name][:, :3] - hand["wrist"][:, :3]
                    joints[f"{side}_{name}"] = track(
                        wrist[:, :3] + metres * offset, hand[name][:, 3]
                    )
    for middle, (left, right) in MIDDLES.items():
        if left in joints and right in joints:
            joints[middle] = between(joints[left], joints[right])
    return seen(joints)


def between(left: Array, right: Array) -> Array:
    """The track of the point halfway between two landmarks; as sure as the less sure of them."""
    return track(0.5 * (left[:, :3] + right[:, :3]), np.minimum(left[:, 3], right[:, 3]))


def _scaled(found: Array, factor: float) -> Array:
    return track(found[:, :3] * factor, found[:, 3])


def _with_depth(tracks: Tracks, bones: Iterable[tuple[str, str]]) -> dict[str, Array]:
    """The landmarks with their depth multiplied so that the bones keep their length best.

    For each bone l^2 = (dx^2 + dy^2) + a dz^2 shall not change from frame to frame: the a of least
    squares over all bones, kept between flat and the scale that the landmarks come with.
    """
    product = square = 0.0
    for start, end in bones:
        if start in tracks and end in tracks:
            ends = tracks[end][:, :3] - tracks[start][:, :3]
            ends = ends[np.isfinite(ends[:, 0])]
            if len(ends) > 1:
                across = (ends[:, :2] ** 2).sum(axis=1)
                deep = ends[:, 2] ** 2
                deep -= deep.mean()
                product -= float(deep @ across)
                square += float(deep @ deep)
    factor = np.sqrt(min(max(product / square, 0.0), 1.0)) if square > 0 else 1.0
    return {name: found * [1.0, 1.0, factor, 1.0] for name, found in tracks.items()}


def _metres_a_pixel(world: Tracks, image: Tracks, hands: Mapping[str, Tracks]) -> float:
    """The scale of the image: from the same pose in both, else from shoulders or a hand."""
    both = [name for name in image if name in world]
    if len(both) > 1:
        sizes = [_spread([tracks[name] for name in both]) for tracks in (world, image)]
        ratios = sizes[0] / np.where(sizes[1] > 0, sizes[1], np.nan)
        if np.isfinite(ratios).any():
            return float(np.nanmedian(ratios))
    known = [(image, *MIDDLES["mid_shoulder"], SHOULDERS)]
    known += [(hand, *_PALM, HAND) for hand in hands.values()]
    for tracks, start, end, metres in known:
        if start in tracks and end in tracks:
            ends = tracks[end] - tracks[start]
            lengths = np.hypot(ends[:, 0], ends[:, 1])
            lengths = lengths[np.isfinite(lengths)]
            if len(lengths) and (widest := float(np.percentile(lengths, 90))) > 0:
                return metres / widest  # turned away they look shorter, never longer
    return 1.0


def _spread(tracks: Sequence[Array]) -> Array:
    """(T,) root mean square distance of landmarks from their mean, across the image."""
    points = np.stack([found[:, :2] for found in tracks])
    deviations = points - points.mean(axis=0)
    spread: Array = np.sqrt((deviations**2).sum(axis=2).mean(axis=0))
    return spread
