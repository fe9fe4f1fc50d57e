"""Read recordings of MediaPipe landmarks: .pose files, tables (CSV) and JSON.

World landmarks are preferred. Image landmarks are converted to metres by the width of the
shoulders; their depth, which has no defined scale, is scaled so that bones keep their length
(`replay.mediapipe.landmarks`). Hands, which are always in image coordinates, are moved to the
wrists of the body. Without world landmarks the origin is the first position of the root.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import hips_joint
from devices.errors import InputError
from devices.mediapipe.joints import (
    HAND_LANDMARKS,
    POSE_LANDMARKS,
    ROOT,
    SIDES,
    landmark_skeleton,
    landmarks_to_world,
)
from devices.skeleton import Skeleton
from replay.bounds import check_poses
from replay.mediapipe.landmarks import PersonLandmarks, Tracks, joints_in_metres, track
from replay.mediapipe.pose_binary import PoseFile, has_pose_header, parse_pose
from replay.mediapipe.text import has_landmark_text, parse_landmark_text
from replay.orientation import floor_and_start, yaw_to_front
from replay.recording import Recording
from replay.stated import UNSTATED, Stated
from replay.text_file import file_bytes

Array = NDArray[np.float64]

MAX_FILE = 512 << 20
WORLD_WIDEST = 3.0  # [m] width of shoulders beyond which the unit is not metres
USUAL_RATE = 25.0
_STRAY = 0.02  # share of the frames of a room whose lowest joint may be below the floor
_NOSE_TIP = ("1", "4")


def recognises_mediapipe(path: Path, head: bytes) -> bool:
    """Whether a file begins as a .pose file, or as text with MediaPipe's landmarks."""
    return has_pose_header(head) or has_landmark_text(head)


def read_mediapipe(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the landmarks at `path`.

    Raises:
        InputError: the file cannot be read, is damaged, or holds no landmark of MediaPipe's.
    """
    data = file_bytes(path, MAX_FILE)
    try:
        if has_pose_header(data):
            people, notes = _people(parse_pose(data))
        else:
            people, notes = parse_landmark_text(data, stated)
        return _recording(people, notes)
    except InputError as error:
        raise InputError(f"{path} is not a readable recording of landmarks: {error}") from error


def _people(file: PoseFile) -> tuple[list[PersonLandmarks], list[str]]:
    notes = []
    rate = file.rate
    if rate <= 0:
        rate = USUAL_RATE
        notes.append(f"the frame rate is missing; {rate:.0f} frames a second are assumed")
    times = np.arange(len(file.points)) / rate
    people = [
        _person(times, person, _by_component(file, person))
        for person in range(file.points.shape[1])
    ]
    if not any(person.world for person in people):
        notes.append("no world landmarks; size and depth are estimated from the image")
    return people, notes


def _by_component(file: PoseFile, person: int) -> dict[str, dict[str, Array]]:
    """Tracks by component and point name; depth is converted to pixels of the width."""
    width = max(file.size[0], 1)
    found: dict[str, dict[str, Array]] = {}
    first = 0
    for name, points in file.components.items():
        found[name] = {
            point: track(
                file.points[:, person, first + index] * (1.0, 1.0, width),
                file.confidence[:, person, first + index],
            )
            for index, point in enumerate(points)
        }
        if name == "POSE_WORLD_LANDMARKS":
            found[name] = _world(found[name], file.size)
        first += len(points)
    return found


def _world(tracks: Mapping[str, Array], size: tuple[int, int]) -> dict[str, Array]:
    """World landmarks in metres. Known versions of pose-format multiply x and y by the image size,
    as for image landmarks; a file without that is detected by its size."""
    width, height = max(size[0], 1), max(size[1], 1)
    shoulders = [tracks[n] for n in ("LEFT_SHOULDER", "RIGHT_SHOULDER") if n in tracks]
    factors = np.array([1.0, 1.0, 1.0 / width, 1.0])
    if len(shoulders) == 2:
        apart = np.linalg.norm((shoulders[0] - shoulders[1])[:, :2], axis=1)
        apart = apart[np.isfinite(apart)]
        if 2 * np.count_nonzero(apart > WORLD_WIDEST) > len(apart):
            factors = np.array([1.0 / width, 1.0 / height, 1.0 / width, 1.0])
    return {name: found * factors for name, found in tracks.items()}


def _person(
    times: Array, person: int, components: Mapping[str, Mapping[str, Array]]
) -> PersonLandmarks:
    def lower(name: str) -> dict[str, Array]:
        return {point.lower(): found for point, found in components.get(name, {}).items()}

    image, face = lower("POSE_LANDMARKS"), components.get("FACE_LANDMARKS", {})
    if image and "nose" not in image and face:
        image["nose"] = _nose(face, image)
    return PersonLandmarks(
        times=times,
        performer=person,
        world=_known(lower("POSE_WORLD_LANDMARKS"), POSE_LANDMARKS),
        image=_known(image, POSE_LANDMARKS),
        hands={
            side: _known(lower(f"{side.upper()}_HAND_LANDMARKS"), HAND_LANDMARKS) for side in SIDES
        },
    )


def _known(tracks: Tracks, names: Sequence[str]) -> dict[str, Array]:
    return {name: found for name, found in tracks.items() if name in names}


def _nose(face: Mapping[str, Array], image: Mapping[str, Array]) -> Array:
    """The nose of a pose stored without one: the face's tip or middle, at the shoulders' depth."""
    points = [face[name] for name in _NOSE_TIP if name in face] or list(face.values())
    nose = points[0] if len(points) < 3 else np.mean(points, axis=0)
    shoulders = [image[name] for name in ("left_shoulder", "right_shoulder") if name in image]
    deep = np.mean([s[:, 2] for s in shoulders], axis=0) if shoulders else np.zeros(len(nose))
    return track(np.stack([nose[:, 0], nose[:, 1], deep], axis=1), nose[:, 3])


def _recording(people: Sequence[PersonLandmarks], notes: Sequence[str]) -> Recording:
    joints = [joints_in_metres(person) for person in people]
    if not any(joints):
        raise InputError("no body and no hand is seen in any frame")
    skeleton = landmark_skeleton({name for found in joints for name in found})
    check_poses(sum(len(person.times) for person in people), len(skeleton.names))
    frames = [
        _frames(skeleton, person, found) for person, found in zip(people, joints, strict=True)
    ]
    times = np.concatenate([person.times for person in people])
    order = np.argsort(times, kind="stable")
    stacked = np.concatenate(frames)[order]
    times = times[order] - times[order[0]]
    positions = landmarks_to_world(stacked[..., :3])
    if any(person.in_room for person in people):
        yaw = yaw_to_front(skeleton, positions)
        positions = positions if yaw is None else positions @ yaw.T
        positions -= floor_and_start(positions, hips_joint(skeleton), stray=_STRAY)
    return Recording(
        skeleton=skeleton,
        times=times,
        positions=positions,
        rotations=None,
        confidence=stacked[..., 3],
        performers=np.concatenate([np.full(len(t.times), t.performer) for t in people])[order],
        arrivals=np.full(len(times), np.nan),
        notes=tuple(notes),
    )


def _frames(skeleton: Skeleton, person: PersonLandmarks, joints: Mapping[str, Array]) -> Array:
    """Positions and confidence (T, J, 4) of one performer."""
    frames = np.full((len(person.times), len(skeleton.names), 4), np.nan)
    frames[..., 3] = 0.0
    for name, found in joints.items():
        frames[:, skeleton.index(name)] = found
    root = frames[:, skeleton.root]
    if skeleton.names[skeleton.root] == ROOT:
        parts = frames[:, np.flatnonzero(skeleton.parents == skeleton.root)]
        seen = parts[..., 3] > 0
        total = np.where(seen[..., None], parts, 0.0).sum(axis=1)
        any_seen = seen.any(axis=1)
        root[any_seen] = total[any_seen] / seen.sum(axis=1)[any_seen, None]
    if not person.world and (root[:, 3] > 0).any():
        frames[..., :3] -= root[np.argmax(root[:, 3] > 0), :3].copy()
    return frames
