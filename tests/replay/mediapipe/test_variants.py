"""MediaPipe landmarks as people save them: counts from 1, names, bare lists, stamps, encodings."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS
from replay.formats import read_recording
from replay.recording import Recording
from replay.stated import Stated
from tests.replay.mediapipe.test_reader import hand, place, standing

FRAMES = 4
POSES = [standing(frame) for frame in range(FRAMES)]


def objects(points: np.ndarray, **more: object) -> list[dict[str, Any]]:
    return [
        {"x": x, "y": y, "z": z, "visibility": 0.9} | more for x, y, z in points.round(6).tolist()
    ]


def by_name(points: np.ndarray, spell: Callable[[str], str] = str) -> dict[str, Any]:
    return {spell(name): found for name, found in zip(POSE_LANDMARKS, objects(points), strict=True)}


def camel(name: str) -> str:
    first, *rest = name.split("_")
    return first + "".join(word.title() for word in rest)


def table(header: Sequence[str], rows: Sequence[Sequence[object]], between: str = ",") -> str:
    return "\n".join(between.join(map(str, row)) for row in [header, *rows]) + "\n"


def wide(names: Sequence[str], between: str = ",", comma: bool = False) -> str:
    rows = [[f"{v:.6f}" for v in pose.ravel()] for pose in POSES]
    if comma:
        rows = [[cell.replace(".", ",") for cell in row] for row in rows]
    return table(names, rows, between)


def long(column: str, first: int | None, **more: Sequence[object]) -> str:
    rows = [
        [frame, POSE_LANDMARKS[n] if first is None else n + first, *point.round(6)]
        for frame, pose in enumerate(POSES)
        for n, point in enumerate(pose)
    ]
    return table(["frame", column, "x", "y", "z"], rows)


COUNTED = [f"{axis}{n}" for n in range(1, 34) for axis in "xyz"]
SPELLED = [f"{name.upper()}_{axis.upper()}" for name in POSE_LANDMARKS for axis in "xyz"]
FACE = objects(np.full((478, 3), 0.5))

TEXTS: dict[str, str] = {
    "columns counted from 1": wide(COUNTED),
    "columns lm1_x": wide([f"lm{n}_{axis}" for n in range(1, 34) for axis in "xyz"]),
    "columns landmark_00_x": wide([f"landmark_{n:02}_{axis}" for n in range(33) for axis in "xyz"]),
    "columns by name": wide(SPELLED),
    "columns leftWrist.x": wide([f"{camel(n)}.{axis}" for n in POSE_LANDMARKS for axis in "xyz"]),
    "columns x_nose": wide([f"{axis}_{name}" for name in POSE_LANDMARKS for axis in "xyz"]),
    "columns PoseLandmark.NOSE_x": wide(
        [f"PoseLandmark.{name.upper()}_{axis}" for name in POSE_LANDMARKS for axis in "xyz"]
    ),
    "semicolons and decimal commas": wide(COUNTED, ";", comma=True),
    "tabs": wide(SPELLED, "\t"),
    "pose and face in one row": table(
        [f"{axis}{n}" for n in range(1, 502) for axis in "xyz"],
        [[*pose.ravel().round(6), *[0.5] * 3 * 468] for pose in POSES],
    ),
    "a row a landmark, id from 0": long("id", 0),
    "a row a landmark, id from 1": long("landmark_id", 1),
    "a row a landmark, index from 1": long("index", 1),
    "a row a landmark, by name": long("name", None),
    "names": json.dumps([by_name(pose) for pose in POSES]),
    "names in capitals": json.dumps([{"pose": by_name(pose, str.upper)} for pose in POSES]),
    "names in camels": json.dumps({"data": [{"landmarks": by_name(p, camel)} for p in POSES]}),
    "named points": json.dumps(
        [
            {"landmarks": [{"name": n, **o} for n, o in by_name(pose).items()][::-1]}
            for pose in POSES
        ]
    ),
    "points by id": json.dumps(
        [{"landmarks": [{"id": n, **o} for n, o in enumerate(objects(pose))]} for pose in POSES]
    ),
    "points by number from 1": json.dumps(
        [{"landmarks": {str(n + 1): o for n, o in enumerate(objects(p))}} for p in POSES]
    ),
    "bare lists": json.dumps([objects(pose) for pose in POSES]),
    "bare lists of numbers": json.dumps([pose.tolist() for pose in POSES]),
    "bare numbers": json.dumps([pose.ravel().tolist() for pose in POSES]),
    "frames by number": json.dumps({str(n): objects(pose) for n, pose in enumerate(POSES)}),
    "frames in an object": json.dumps({"frames": [objects(pose) for pose in POSES]}),
    "one list of landmarks": json.dumps({"landmarks": [objects(pose) for pose in POSES]}),
    "one line a frame": "\n".join(json.dumps(objects(pose)) for pose in POSES),
    "TensorFlow.js": json.dumps(
        [
            [{"score": 1, "keypoints": objects(500 + pose), "keypoints3D": objects(pose)}]
            for pose in POSES
        ]
    ),
    "TensorFlow.js, with poses": json.dumps(
        [
            {"poses": [{"keypoints3D": [{"name": n, **o} for n, o in by_name(p).items()]}]}
            for p in POSES
        ]
    ),
    "the face first": json.dumps(
        [{"face_landmarks": FACE, "pose_world_landmarks": objects(p)} for p in POSES], indent=1
    ),
    "metadata first": json.dumps(
        {
            "labels": list(range(2000)),
            "frames": [{"poseWorldLandmarks": objects(p)} for p in POSES],
        },
        indent=4,
    ),
    "Kaggle's 543 points": json.dumps(
        [FACE[:468] + objects(hand()) + objects(pose) + objects(hand()) for pose in POSES]
    ),
}


def read(tmp_path: Path, text: str | bytes, stated: Stated | None = None) -> Recording:
    path = tmp_path / "saved.txt"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_recording(path) if stated is None else read_recording(path, stated)


@pytest.mark.parametrize("kind", TEXTS)
def test_every_form_holds_the_same(kind: str, tmp_path: Path) -> None:
    recording = read(tmp_path, TEXTS[kind])
    np.testing.assert_allclose(recording.times, np.arange(FRAMES) / 30.0, atol=1e-9)
    np.testing.assert_allclose(place(recording, 3, "right_wrist"), [-0.35, 0.3, 0.05], atol=2e-5)
    np.testing.assert_allclose(place(recording, 0, "left_knee"), [0.1, -0.42, 0.02], atol=2e-5)
    np.testing.assert_allclose(place(recording, 0, "nose"), [0, 0.6, 0.1], atol=2e-5)
    assert any("--fps-input" in note for note in recording.notes)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])
@pytest.mark.parametrize("kind", ["columns by name", "tabs", "names", "metadata first"])
def test_encodings(kind: str, encoding: str, tmp_path: Path) -> None:
    recording = read(tmp_path, TEXTS[kind].encode(encoding))
    np.testing.assert_allclose(place(recording, 3, "right_wrist"), [-0.35, 0.3, 0.05], atol=2e-5)


@pytest.mark.parametrize(
    ("stamps", "seconds"),
    [
        ([0, 33, 67, 100], [0, 0.033, 0.067, 0.1]),
        ([1700000000000, 1700000000040, 1700000000080, 1700000000120], [0, 0.04, 0.08, 0.12]),
        ([0, 33333, 66667, 100000], [0, 0.033333, 0.066667, 0.1]),
        ([1e18, 1e18 + 4e7, 1e18 + 8e7, 1e18 + 12e7], [0, 0.04, 0.08, 0.12]),
        ([0.0, 0.04, 0.08, 0.12], [0, 0.04, 0.08, 0.12]),
        ([1700000000.0, 1700000000.04, 1700000000.08, 1700000000.12], [0, 0.04, 0.08, 0.12]),
        ([1, 2, 3, 4], [0, 1 / 30, 2 / 30, 3 / 30]),
        ([f"2024-05-01 10:59:59.{n}00" for n in (5, 6, 7, 9)], [0, 0.1, 0.2, 0.4]),
        (["0:59.9", "1:00.0", "1:00.1", "1:00.3"], [0, 0.1, 0.2, 0.4]),
    ],
)
@pytest.mark.parametrize("form", ["table", "json"])
def test_stamps_of_an_unknown_unit(
    form: str, stamps: list[Any], seconds: list[float], tmp_path: Path
) -> None:
    if form == "json":
        text = json.dumps(
            [{"timestamp": s, "landmarks": objects(p)} for s, p in zip(stamps, POSES, strict=True)]
        )
    else:
        rows = [[s, *p.ravel()] for s, p in zip(stamps, POSES, strict=True)]
        text = table(["timestamp", *COUNTED], rows)
    np.testing.assert_allclose(read(tmp_path, text).times, seconds, atol=2e-6)


@pytest.mark.parametrize(
    "around",
    [
        {"fps": 25},
        {"metadata": {"frame_rate": 25.0}},
        {"video": {"name": "a.mp4", "FPS": "25"}},
    ],
)
def test_a_rate_in_the_file_counts(around: dict[str, Any], tmp_path: Path) -> None:
    text = json.dumps(around | {"frames": [{"landmarks": objects(pose)} for pose in POSES]})
    recording = read(tmp_path, text)
    np.testing.assert_allclose(recording.times, np.arange(FRAMES) / 25.0)
    assert not any("--fps-input" in note for note in recording.notes)


def test_numbers_of_frames_keep_their_gaps(tmp_path: Path) -> None:
    frames = [
        {"frame": n, "landmarks": objects(p)} for n, p in zip((3, 4, 8, 9), POSES, strict=True)
    ]
    recording = read(tmp_path, json.dumps({"fps": 10, "frames": frames}))
    np.testing.assert_allclose(recording.times, [0, 0.1, 0.5, 0.6])


@pytest.mark.parametrize(
    "around",
    [
        {"width": 1080, "height": 1920},
        {"info": {"imageWidth": 1080, "imageHeight": 1920}},
        {"meta": {"resolution": [1080, 1920]}},
        {"resolution": "1080x1920"},
        {"shape": [1920, 1080, 3]},
        {"image_size": {"width": 1080, "height": 1920}},
    ],
)
def test_the_shape_of_the_picture_counts(around: dict[str, Any], tmp_path: Path) -> None:
    portrait = [0.5 + 0.3 * pose * (16 / 9, 1.0, 16 / 9) for pose in POSES]
    text = json.dumps(around | {"frames": [{"landmarks": objects(pose)} for pose in portrait]})
    recording = read(tmp_path, text)
    np.testing.assert_allclose(place(recording, 0, "left_ankle"), [0.1, -0.84, 0], atol=1e-4)
    assert not any("16:9" in note for note in recording.notes)


def test_the_shape_of_the_picture_stands_in_columns(tmp_path: Path) -> None:
    rows = [[1080, 1920, *(0.5 + 0.3 * p * (16 / 9, 1, 16 / 9)).ravel()] for p in POSES]
    recording = read(tmp_path, table(["image_width", "image_height", *COUNTED], rows))
    np.testing.assert_allclose(place(recording, 0, "left_ankle"), [0.1, -0.84, 0], atol=1e-4)


def hand_rows(names: Sequence[str], **front: object) -> str:
    points = hand().ravel().round(6)
    return table([*front, *names], [[*front.values(), *points] for _ in range(FRAMES)])


@pytest.mark.parametrize(
    ("text", "side"),
    [
        (hand_rows([f"{axis}{n}" for n in range(21) for axis in "xyz"]), "right"),
        (hand_rows([f"{axis}{n}" for n in range(1, 22) for axis in "xyz"]), "right"),
        (hand_rows([f"{n.upper()}_{axis}" for n in HAND_LANDMARKS for axis in "xyz"]), "right"),
        (
            hand_rows([f"left_hand_{n}_{axis}" for n in HAND_LANDMARKS for axis in "xyz"]),
            "left",
        ),
        (
            hand_rows([f"{n}_{axis}" for n in HAND_LANDMARKS for axis in "xyz"], handedness="Left"),
            "left",
        ),
        (
            table(
                ["frame", "landmark_id", "x", "y", "z"],
                [[f, n, *p] for f in range(FRAMES) for n, p in enumerate(hand())],
            ),
            "right",
        ),
        (json.dumps([objects(hand())] * FRAMES), "right"),
        (json.dumps([{"left_hand_landmarks": objects(hand())}] * FRAMES), "left"),
        (
            json.dumps(
                [
                    {
                        "handedness": [[{"categoryName": "Left", "score": 1}]],
                        "landmarks": [],
                        "hand_landmarks": [objects(hand())],
                    }
                ]
                * FRAMES
            ),
            "left",
        ),
    ],
)
def test_tables_of_a_hand(text: str, side: str, tmp_path: Path) -> None:
    recording = read(tmp_path, text)
    palm = place(recording, 0, f"{side}_middle_finger_mcp") - place(recording, 0, f"{side}_wrist")
    tip = place(recording, 0, f"{side}_middle_finger_tip") - place(recording, 0, f"{side}_wrist")
    assert np.linalg.norm(palm[:2]) == pytest.approx(0.09, abs=1e-6)
    assert tip[1] / palm[1] == pytest.approx(0.14 / 0.05, rel=1e-4)
    assert all(name.startswith((side, "middle")) for name in recording.skeleton.names)


IN_ROOM = [(pose * (1, -1, -1))[:, [0, 2, 1]] * (1, -1, 1) + (0.4, 2, 0.95) for pose in POSES]
MOVED = [1000.0 * pose for pose in IN_ROOM]  # [mm], z up, as FreeMoCap has them


@pytest.mark.parametrize("form", ["wide", "body", "tidy", "metres"])
def test_freemocap_stands_on_the_floor(form: str, tmp_path: Path) -> None:
    if form == "tidy":
        rows = [
            [f, 0.033 * f, "mediapipe.body", name, *point, 0.5]
            for f, pose in enumerate(MOVED)
            for name, point in zip(POSE_LANDMARKS, pose, strict=True)
        ]
        text = table(["frame", "timestamp", "model", "keypoint", "x", "y", "z", "error"], rows)
    else:
        poses = IN_ROOM if form == "metres" else MOVED
        prefix = "body_" if form == "body" else ""
        names = [f"{prefix}{name}_{axis}" for name in POSE_LANDMARKS for axis in "xyz"]
        text = table(names, [pose.ravel() for pose in poses])
    recording = read(tmp_path, text)
    shoulders = place(recording, 0, "left_shoulder") - place(recording, 0, "right_shoulder")
    np.testing.assert_allclose(shoulders, [0.36, 0, 0], atol=1e-6)
    assert place(recording, 0, "nose")[1] - place(recording, 0, "left_ankle")[1] == pytest.approx(
        1.44
    )
    assert place(recording, 0, "nose")[2] - place(recording, 0, "mid_hip")[2] == pytest.approx(0.1)
    assert np.nanmin(recording.positions[..., 1]) == pytest.approx(0.0)
    assert any("+Z (--up-input" in note for note in recording.notes)
    assert any("--unit-input" in note for note in recording.notes)


def test_axes_and_unit_can_be_stated(tmp_path: Path) -> None:
    names = [f"{name}_{axis}" for name in POSE_LANDMARKS for axis in "xyz"]
    text = table(names, [pose.ravel() for pose in MOVED])
    recording = read(tmp_path, text, Stated(up="z", unit="cm"))
    shoulders = place(recording, 0, "left_shoulder") - place(recording, 0, "right_shoulder")
    np.testing.assert_allclose(shoulders, [3.6, 0, 0], atol=1e-5)


@pytest.mark.parametrize("form", ["json", "table"])
def test_several_people_are_performers(form: str, tmp_path: Path) -> None:
    if form == "json":
        text = json.dumps([{"pose_world_landmarks": [objects(p), objects(0.5 * p)]} for p in POSES])
    else:
        rows = [
            [f, who, *(size * p).ravel()]
            for f, p in enumerate(POSES)
            for who, size in (("a", 1.0), ("b", 0.5))
        ]
        text = table(["frame", "person_id", *COUNTED], rows)
    recording = read(tmp_path, text)
    assert recording.performers.tolist() == [0, 1] * FRAMES
    np.testing.assert_allclose(place(recording, 0, "left_knee")[1], -0.42, atol=1e-6)
    np.testing.assert_allclose(place(recording, 1, "left_knee")[1], -0.21, atol=1e-6)


def test_pixels_without_depth_are_read(tmp_path: Path) -> None:
    rows = [
        [f, n, *(400.0 * p[:2] + 500.0).round(3)]
        for f, pose in enumerate(POSES)
        for n, p in enumerate(pose)
    ]
    recording = read(tmp_path, table(["frame", "id", "x", "y"], rows))
    np.testing.assert_allclose(place(recording, 0, "left_ankle"), [0.1, -0.84, 0], atol=1e-4)
