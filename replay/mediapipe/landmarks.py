"""Convert one performer's MediaPipe landmarks, world or image, to joints in metres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.mediapipe.joints import HAND_BONES, HAND_LANDMARKS, MIDDLES, PARENTS, SIDES

Array = NDArray[np.float64]
# A landmark's track is (T, 4): x, y, z in MediaPipe's axes, and its confidence; NaN, NaN, NaN, 0
# where it was not seen.
Tracks = Mapping[str, Array]

SHOULDERS = 0.36  # [m] of an adult
HAND = 0.09  # [m] from the wrist to the first joint of the middle finger
FARTHEST = 1e7  # in the unit of the landmarks

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
    """One performer's landmarks in T frames.

    Attributes:
        times: (T,) [s].
        performer: number of the performer.
        world: pose [m] from the middle of the hips, by joint name; empty if there is none.
        image: pose in the image [pixels; z as far as its scale is known].
        hands: for each side the hand's landmarks in the units of `image`.
        in_room: whether `world` moves through a room, and is not from the middle of the hips.
    """

    times: Array
    performer: int
    world: Tracks
    image: Tracks
    hands: Mapping[str, Tracks]
    in_room: bool = False


def track(points: Array, confidence: Array) -> Array:
    """Return the track (T, 4) of a landmark from its points (T, 3) and confidence (T,)."""
    found = np.concatenate([points, np.clip(np.nan_to_num(confidence), 0.0, 1.0)[:, None]], axis=1)
    near: NDArray[np.bool_] = np.abs(points) <= FARTHEST  # False for NaN
    found[~np.logical_and.reduce(near, axis=1) | (found[:, 3] <= 0)] = (np.nan,) * 3 + (0.0,)
    return found


def seen(tracks: Tracks) -> dict[str, Array]:
    """Return the landmarks that are seen in any frame."""
    return {name: found for name, found in tracks.items() if (found[:, 3] > 0).any()}


def joints_in_metres(person: PersonLandmarks) -> dict[str, Array]:
    """Return the tracks [m, MediaPipe's axes] of the seen joints of `devices.mediapipe.joints`."""
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
    """Return the track halfway between two landmarks, with the lower of their confidences."""
    return track(0.5 * (left[:, :3] + right[:, :3]), np.minimum(left[:, 3], right[:, 3]))


def _scaled(found: Array, factor: float) -> Array:
    return track(found[:, :3] * factor, found[:, 3])


def _with_depth(tracks: Tracks, bones: Iterable[tuple[str, str]]) -> dict[str, Array]:
    """Scale the depth of the landmarks so that bone lengths vary least.

    For each bone l^2 = (dx^2 + dy^2) + a dz^2 should be constant over the frames: `a` is the
    least-squares solution over all bones, limited to [0, 1].
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
    """Metres per pixel: from a pose that is in both, else from shoulders or a hand."""
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
                return metres / widest  # turned away they appear shorter, never longer
    return 1.0


def _spread(tracks: Sequence[Array]) -> Array:
    """Root mean square distance (T,) of landmarks from their mean, in the image plane."""
    points = np.stack([found[:, :2] for found in tracks])
    deviations = points - points.mean(axis=0)
    spread: Array = np.sqrt((deviations**2).sum(axis=2).mean(axis=0))
    return spread
