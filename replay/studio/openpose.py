"""Reads OpenPose's key points: flat bodies (BODY_25 or COCO), from a file or a folder of files.

Source: OpenPose documentation, "Output Format".
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.bodies.performer_numbers import SAME_BODY, PerformerNumbers
from devices.bounded_json import parse_json
from devices.errors import ContentError, InputError
from replay.bounds import check_poses, check_recordable
from replay.markers.marker_body import MarkerMotion, body_of_markers
from replay.recording import Recording
from replay.stated import METRES, UNSTATED, Stated
from replay.text_file import file_bytes

Array = NDArray[np.float64]

_ENDING = "_keypoints.json"
_MOST_FILES = 200_000
_MOST_BYTES = 4 << 20  # of a frame
_MOST_PEOPLE = 32
_RATE = 30.0
_ARMS_AND_LEGS = (
    "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist {}RHip RKnee RAnkle LHip LKnee "
    "LAnkle REye LEye REar LEar"
)
_COCO = _ARMS_AND_LEGS.format("").split()
_BODY_25 = _ARMS_AND_LEGS.format("MidHip ").split()
_BODY_25 += "LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel".split()
_LAYOUTS = {len(names): names for names in (_COCO, _BODY_25)}
_POINTS = [name for name in _BODY_25 if name[1:] not in ("Eye", "Ear") and name != "Nose"]
_FACE = ("Nose", "REar", "LEar", "REye", "LEye")
_HEIGHT = 1.7  # [m]
_CHAIN = (("Neck", "MidHip"), ("{}Hip", "{}Knee"), ("{}Knee", "{}Ankle"))
_SHARES = (0.27, 0.24, 0.24)  # of a body's height: trunk, thigh, shin (Winter 2009)
_LONGEST = 90  # percentile: what points at the camera looks short


def recognises_openpose(path: Path, head: bytes) -> bool:
    """Whether a file holds people with key points, or a folder files of them."""
    if path.is_dir():
        return _first_file(path) is not None
    return b'"people"' in head and (b"pose_keypoints" in head or path.name.endswith(_ENDING))


def read_openpose(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the people of a frame, or of a folder with a file for each, as flat performers.

    The picture's right is the stage's; a folder has 30 frames a second unless that is stated.

    Raises:
        InputError: a file cannot be read.
        ContentError: nobody is seen, or the points are of no known layout.
    """
    notes = ["flat: OpenPose's points have no depth"]
    files = _files(path) if path.is_dir() else [path]
    if len(files) > 1:
        notes.append(f"{_RATE:.0f} frames a second (--fps-input N)")
    frames, points = [], []
    for number, file in enumerate(files):
        check_recordable(file)
        people = _people(file_bytes(file, _MOST_BYTES), file)
        frames += [number] * len(people)
        points += people
        check_poses(len(points), len(_BODY_25))
    if not points:
        raise ContentError("nobody is seen in it")
    bodies = np.array(points)
    scale = METRES[stated.unit] if stated.unit else _metres_a_pixel(bodies)
    recording = body_of_markers(
        MarkerMotion(
            names=[*_POINTS, "Head"],
            times=np.array(frames) / _RATE,
            columns=_stood(bodies),
            metres=scale,
            up=np.array([0.0, 1.0, 0.0]),
        ),
        stated,
        notes,
    )
    return replace(recording, performers=_numbered(np.array(frames), bodies, scale))


def _first_file(folder: Path) -> Path | None:
    try:
        return next(folder.glob(f"*{_ENDING}"), None)
    except OSError:
        return None


def _files(folder: Path) -> list[Path]:
    """The files of a folder, in the order of their names.

    Raises:
        InputError: there are too many.
    """
    found = []
    for file in folder.glob(f"*{_ENDING}"):
        found.append(file)
        if len(found) > _MOST_FILES:
            raise InputError(f"{folder} has more than {_MOST_FILES} frames; split it")
    return sorted(found)


def _people(data: bytes, file: Path) -> list[Array]:
    """The points (25, 3) of each person of a frame: x, y [pixels, y down], confidence.

    Raises:
        ContentError: it is no frame of OpenPose's.
    """
    try:
        frame = parse_json(data)
    except ValueError as error:
        raise ContentError(f"{file.name} is no JSON of OpenPose: {error}") from error
    people = frame.get("people") if isinstance(frame, dict) else None
    if not isinstance(people, list) or len(people) > _MOST_PEOPLE:
        raise ContentError(f"{file.name} holds no people as OpenPose writes them")
    found = []
    for person in people:
        numbers = person.get("pose_keypoints_2d", []) if isinstance(person, dict) else []
        numbers = numbers or (person.get("pose_keypoints", []) if isinstance(person, dict) else [])
        if numbers:
            found.append(_points(numbers, file))
    return [points for points in found if points[:, 2].any()]


def _points(numbers: Any, file: Path) -> Array:
    names = _LAYOUTS.get(len(numbers) // 3) if isinstance(numbers, list) else None
    if names is None or len(numbers) % 3:
        raise ContentError(
            f"{file.name}: its points are neither BODY_25 (75 numbers a person) nor COCO (54)"
        )
    values = [
        float(n) if isinstance(n, (int, float)) and abs(n) < 1e6 else float("nan") for n in numbers
    ]
    points = np.zeros((len(_BODY_25), 3))
    points[[_BODY_25.index(name) for name in names]] = np.reshape(values, (-1, 3))
    points[~(np.isfinite(points).all(axis=1) & (points[:, 2] > 0.0))] = 0.0
    if names is _COCO:
        hips = points[[_BODY_25.index("LHip"), _BODY_25.index("RHip")]]
        points[_BODY_25.index("MidHip")] = hips.mean(axis=0) if hips[:, 2].all() else 0.0
    return points


def _stood(bodies: Array) -> Array:
    """Positions (T, M, 3) in pixels, y up; NaN where not seen; the head among the face's points."""
    seen = bodies[..., 2] > 0.0
    flat = np.zeros_like(bodies)
    flat[..., 0], flat[..., 1] = bodies[..., 0], -bodies[..., 1]
    flat[~seen] = np.nan
    face = [_BODY_25.index(name) for name in _FACE]
    known = seen[:, face, None]
    number = known.sum(axis=1)
    total = np.where(known, flat[:, face], 0.0).sum(axis=1)
    head = np.divide(total, number, out=np.full(total.shape, np.nan), where=number > 0)
    columns = [_BODY_25.index(name) for name in _POINTS]
    return np.concatenate([flat[:, columns], head[:, None]], axis=1)


def _metres_a_pixel(bodies: Array) -> float:
    """The size of a pixel with which the people are 1.70 m tall, by their longest bones."""
    sizes = []
    for (start, end), share in zip(_CHAIN, _SHARES, strict=True):
        for side in "LR":
            ends = bodies[:, [_BODY_25.index(name.format(side)) for name in (start, end)]]
            ends = ends[(ends[..., 2] > 0.0).all(axis=1), :, :2]
            if len(ends):
                lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
                sizes.append(float(np.percentile(lengths, _LONGEST)) / (share * _HEIGHT))
    pixels = float(np.median(sizes)) if sizes else 0.0
    return 1.0 / pixels if pixels > 1e-9 else 1.0


def _numbered(frames: NDArray[np.int64], bodies: Array, scale: float) -> NDArray[np.int64]:
    """The performer of each body: the one who was nearest in the frame before."""
    numbers = PerformerNumbers()
    performers = np.zeros(len(frames), dtype=np.int64)
    last: dict[int, Array] = {}
    ids = 0
    for frame in np.unique(frames).tolist():
        rows = np.flatnonzero(frames == frame)
        own: dict[int, int] = {}
        here: dict[int, Array] = {}
        for row in rows.tolist():
            points = bodies[row, bodies[row, :, 2] > 0.0, :2]
            place = np.array([*(points.mean(axis=0) * scale), 0.0])
            free = {key: np.linalg.norm(at - place) for key, at in last.items() if key not in here}
            nearest = min(free, key=free.__getitem__, default=None)
            if nearest is None or free[nearest] > SAME_BODY:
                nearest, ids = ids, ids + 1
            own[row], here[nearest] = nearest, place
        given = numbers(here)
        last = here
        for row in rows.tolist():
            performers[row] = given[own[row]]
    return performers
