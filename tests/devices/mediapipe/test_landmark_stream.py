"""MediaPipe streams: landmarks from packets, and damaged ones."""

from __future__ import annotations

import json
import re
import socket
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from devices.bodies.camera_position import camera_position
from devices.errors import InputError
from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS, SIDES
from devices.mediapipe.landmark_messages import LandmarkDecoder
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from replay.formats import read_recording
from tests.waiting import PATIENCE

SIZE = [640, 480]
FOCAL = 320.0 / np.tan(np.radians(30.0))  # [pixels] of a camera that sees 60 degrees


def person(seed: int = 1) -> np.ndarray:
    """(33, 3) [m] a body's landmarks in MediaPipe's axes, from the middle of its hips."""
    points = np.random.default_rng(seed).uniform(-0.5, 0.5, size=(33, 3)) * (0.6, 1.6, 0.4)
    hips = [POSE_LANDMARKS.index(f"{side}_hip") for side in SIDES]
    return points - points[hips].mean(axis=0)


def seen_at(points: np.ndarray, place: np.ndarray) -> np.ndarray:
    """(33, 3) image landmarks of a body at `place` before a pinhole camera."""
    camera = points + place
    pixels = FOCAL * camera[:, :2] / camera[:, 2:]
    return np.concatenate([pixels / SIZE + 0.5, points[:, 2:]], axis=1)


def rows(points: np.ndarray, visibility: float = 0.9) -> list[list[float]]:
    return [[*map(float, point), visibility] for point in points]


def message(people: list[Any], **more: Any) -> bytes:
    return json.dumps({"timestamp_ms": 1000.0, "pose_world_landmarks": people, **more}).encode()


def place(decoder: LandmarkDecoder, frame: SkeletonFrame, name: str) -> np.ndarray:
    return frame.positions[decoder.skeleton.index(name)]


# -- where the body is ----------------------------------------------------------------------------


@pytest.mark.parametrize("where", [(0.0, 0.0, 2.0), (0.8, -0.3, 3.5), (-1.0, 0.4, 1.5)])
def test_the_place_of_a_body_follows_from_its_picture(where: tuple[float, float, float]) -> None:
    points, at = person(), np.array(where)
    picture = (seen_at(points, at)[:, :2] - 0.5) * SIZE
    found = camera_position(points, picture, np.ones(33), FOCAL)
    np.testing.assert_allclose(found, at, atol=1e-9)


def test_points_without_weight_or_number_do_not_count() -> None:
    points, at = person(), np.array([0.2, 0.1, 2.0])
    picture = (seen_at(points, at)[:, :2] - 0.5) * SIZE
    weights = np.ones(33)
    weights[:20] = 0.0
    picture[:20] += 1000.0
    picture[20] = np.nan
    np.testing.assert_allclose(camera_position(points, picture, weights, FOCAL), at, atol=1e-9)


def test_no_place_where_too_little_is_seen_or_it_is_behind_the_camera() -> None:
    points, at = person(), np.array([0.0, 0.0, 2.0])
    picture = (seen_at(points, at)[:, :2] - 0.5) * SIZE
    few = np.zeros(33)
    few[:3] = 1.0
    assert camera_position(points, picture, few, FOCAL) is None
    assert camera_position(points, -picture, np.ones(33), FOCAL) is None
    assert camera_position(np.zeros((33, 3)), np.zeros((33, 2)), np.ones(33), FOCAL) is None


# -- the decoder ----------------------------------------------------------------------------------


def test_landmarks_stand_in_the_world_facing_the_front() -> None:
    decoder, points = LandmarkDecoder(), person()
    (frame,) = decoder.feed(message([rows(points)]), 7.0)
    for name in ("nose", "left_wrist", "right_ankle", "left_thumb"):
        expected = points[POSE_LANDMARKS.index(name)] * (1, -1, -1)
        np.testing.assert_allclose(place(decoder, frame, name), expected)
    np.testing.assert_allclose(place(decoder, frame, "mid_hip"), 0.0, atol=1e-12)
    assert (frame.confidence == 0.9).all()
    assert (frame.time, frame.arrival, frame.performer) == (7.0, 7.0, 0)
    assert frame.rotations is None


def test_landmarks_may_be_lists_or_objects_and_one_person_may_come_alone() -> None:
    points = person()
    expected = LandmarkDecoder().feed(message([rows(points)]), 0.0)[0].positions
    objects = [dict(zip("xyz", map(float, p), strict=True)) | {"visibility": 0.9} for p in points]
    without = [[*map(float, point)] for point in points]
    longer = [[*row, 0.7] for row in rows(points)]
    for people in ([objects], objects, rows(points), [without], [longer]):
        (frame,) = LandmarkDecoder().feed(message(people), 0.0)
        np.testing.assert_array_equal(frame.positions, expected)


def test_a_landmark_that_is_not_visible_at_all_is_unseen() -> None:
    body = rows(person())
    body[POSE_LANDMARKS.index("left_wrist")][3] = 0.0
    body[POSE_LANDMARKS.index("left_hip")][3] = 0.0
    decoder = LandmarkDecoder()
    (frame,) = decoder.feed(message([body]), 0.0)
    for name in ("left_wrist", "left_hip", "mid_hip"):
        assert np.isnan(place(decoder, frame, name)).all()
        assert frame.confidence[decoder.skeleton.index(name)] == 0.0
    assert np.isfinite(place(decoder, frame, "right_hip")).all()


def test_with_the_image_a_body_walks_and_jumps() -> None:
    decoder, points = LandmarkDecoder(), person()
    path = np.array([[0.0, 0.0, 3.0], [0.5, 0.0, 3.0], [0.5, -0.4, 2.5]])
    for at in path:
        data = message([rows(points)], pose_landmarks=[rows(seen_at(points, at))], image_size=SIZE)
        (frame,) = decoder.feed(data, 0.0)
        expected = (at - path[0]) * (1, -1, -1)
        np.testing.assert_allclose(place(decoder, frame, "mid_hip"), expected, atol=1e-9)
    lost = message([rows(points)], pose_landmarks=[rows(points * 0)], image_size=SIZE)
    (frame,) = decoder.feed(lost, 0.0)
    np.testing.assert_allclose(place(decoder, frame, "mid_hip"), (0.5, 0.4, 0.5), atol=1e-9)


def test_people_keep_their_numbers_by_the_ids_that_are_sent() -> None:
    decoder = LandmarkDecoder()
    one, two = rows(person(1)), rows(person(2))
    first = decoder.feed(message([one, two], ids=[17, 4]), 0.0)
    again = decoder.feed(message([two, one], ids=[4, 17]), 0.0)
    assert [frame.performer for frame in first] == [0, 1]
    assert [frame.performer for frame in again] == [1, 0]
    np.testing.assert_array_equal(first[0].positions, again[1].positions)


def test_hands_are_put_on_at_the_wrists() -> None:
    decoder, points = LandmarkDecoder(hands=True), person()
    fingers = np.random.default_rng(5).normal(scale=0.05, size=(21, 3))
    hands: dict[str, Any] = {"left_hand_world_landmarks": [[[*map(float, p)] for p in fingers]]}
    (frame,) = decoder.feed(message([rows(points)], **hands), 0.0)
    wrist = points[POSE_LANDMARKS.index("left_wrist")]
    for row, name in enumerate(HAND_LANDMARKS[1:], 1):
        expected = (wrist + fingers[row] - fingers[0]) * (1, -1, -1)
        np.testing.assert_allclose(place(decoder, frame, f"left_{name}"), expected)
        assert np.isnan(place(decoder, frame, f"right_{name}")).all()
    assert "left_thumb" not in decoder.skeleton.names


HOSTILE: list[bytes] = [
    b"",
    b"\xff",
    b"[]",
    b"{}",
    b'{"pose_world_landmarks": 3}',
    b'{"pose_world_landmarks": [[[1,2,3]]]}',
    b'{"pose_world_landmarks": [3]}',
    b'{"pose_world_landmarks": [null, {}]}',
    b"[" * 60_000,
    b'{"pose_world_landmarks": ' + b"[" * 60_000,
    b" " * 70_000,
    message([rows(person())] * 100),
]


@pytest.mark.parametrize("data", HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_no_message_is_refused_and_counted(data: bytes) -> None:
    decoder = LandmarkDecoder()
    assert decoder.feed(data, 0.0) == []
    assert decoder.refused >= 1


@pytest.mark.parametrize(
    "more",
    [
        {"timestamp_ms": "soon"},
        {"timestamp_ms": float("nan")},
        {"timestamp_ms": -1e300},
        {"image_size": [0, 0], "pose_landmarks": [rows(person())]},
        {"image_size": [640, "x"], "pose_landmarks": [rows(person())]},
        {"image_size": SIZE, "pose_landmarks": [[1, 2]]},
        {"image_size": SIZE, "pose_landmarks": [rows(person() * np.inf)]},
        {"ids": ["a"]},
        {"ids": [1e400]},
        {"left_hand_world_landmarks": {"x": 1}},
        {"ids": [[1]]},
    ],
    ids=range(11),
)
@pytest.mark.filterwarnings("error")
def test_odd_values_beside_a_good_body_do_no_harm(more: dict[str, Any]) -> None:
    (frame,) = LandmarkDecoder().feed(message([rows(person())], **more), 2.0)
    assert np.isfinite(frame.positions).all()
    assert frame.time == 2.0


@pytest.mark.parametrize("value", [None, "1", True, float("nan"), float("inf"), 1e9, [1.0]])
def test_a_landmark_that_is_no_point_is_unseen(value: Any) -> None:
    body: list[Any] = rows(person())
    nose = POSE_LANDMARKS.index("nose")
    body[nose] = [0.0, value, 0.0, 1.0]
    decoder = LandmarkDecoder()
    (frame,) = decoder.feed(message([body]), 0.0)
    assert np.isnan(place(decoder, frame, "nose")).all()
    assert frame.confidence[decoder.skeleton.index("nose")] == 0.0


def test_the_sender_s_clock_paces_frames_and_may_begin_anew() -> None:
    decoder, body = LandmarkDecoder(), [rows(person())]
    times = [
        decoder.feed(message(body, timestamp_ms=1000 + 40 * i), 5.0 + 0.04 * i)[0].time
        for i in range(20)
    ]
    np.testing.assert_allclose(np.diff(times), 0.04, atol=1e-9)
    assert decoder.feed(message(body, timestamp_ms=3), 6.0)[0].time == 6.0


def test_a_recorded_performance_arrives_with_bones_of_one_length(shared: Path) -> None:
    recording = read_recording(shared / "mediapipe" / "mediapipe_holistic_full_example.pose")
    decoder = LandmarkDecoder()
    arms = []
    for index in range(len(recording)):
        body = [[0.0, 0.0, 0.0, 0.0]] * len(POSE_LANDMARKS)
        for joint, name in enumerate(recording.skeleton.names):
            if name in POSE_LANDMARKS and recording.confidence[index, joint] > 0:
                point = recording.positions[index, joint] * (1, -1, -1)
                body[POSE_LANDMARKS.index(name)] = [*map(float, point), 0.9]
        (frame,) = decoder.feed(message([body], timestamp_ms=40.0 * index), 0.04 * index)
        arms.append(place(decoder, frame, "left_shoulder") - place(decoder, frame, "left_elbow"))
        source = recording.positions[index, recording.skeleton.index("nose")]
        np.testing.assert_allclose(place(decoder, frame, "nose"), source, atol=1e-9)
    lengths = np.linalg.norm(arms, axis=1)
    assert 0.15 < np.nanmedian(lengths) < 0.4


# -- whole way ------------------------------------------------------------------------------------


def test_datagrams_on_loopback_are_frames() -> None:
    with (
        open_stream("mediapipe://127.0.0.1:0") as stream,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        where = ("127.0.0.1", stream.transport.port)
        frames: list[SkeletonFrame] = []
        end, pause, sent = time.monotonic() + PATIENCE, threading.Event(), 0
        while len(frames) < 10 and time.monotonic() < end:
            sender.sendto(message([rows(person())], timestamp_ms=40.0 * sent), where)
            sender.sendto(b"noise", where)
            sent += 1
            pause.wait(0.002)
            frames += stream.poll()
    assert len(frames) >= 10
    np.testing.assert_array_equal(frames[0].positions, frames[-1].positions)


def point(*numbers: float) -> SimpleNamespace:
    return SimpleNamespace(**dict(zip(("x", "y", "z", "visibility"), numbers, strict=True)))


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("mediapipe://webcam?model=a.task", "a webcam is webcam://0"),
        ("mediapipe://127.0.0.1:7005?view=300", "from 10 to 170"),
        ("mediapipe://127.0.0.1:7005?hands=two", "on or off"),
        ("mediapipe://127.0.0.1:7005?model=x", "'model' is unknown"),
    ],
)
def test_an_address_that_cannot_be_opened_is_one_clear_line(url: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        open_stream(url)
    assert "\n" not in str(caught.value)


class _Camera:
    """A camera of OpenCV's that gives three pictures."""

    def __init__(self, _number: int) -> None:
        self._left = 3

    def read(self) -> tuple[bool, np.ndarray]:
        self._left -= 1
        return self._left >= 0, np.zeros((480, 640, 3), np.uint8)


class _Anything(SimpleNamespace):
    """Stands for whatever of MediaPipe is named, called or not, on the way to a landmarker."""

    def __getattr__(self, _name: str) -> Any:
        return _Anything()

    def __call__(self, *_: Any, **__: Any) -> Any:
        return _Anything()

    def detect_for_video(self, _image: Any, _milliseconds: int) -> SimpleNamespace:
        body = [point(*map(float, p), 0.8) for p in person()]
        return SimpleNamespace(pose_world_landmarks=[body], pose_landmarks=[body])


def test_the_documented_sender_sends_what_is_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parents[3] / "docs" / "devices-cameras.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    cv2 = SimpleNamespace(
        VideoCapture=_Camera, cvtColor=lambda picture, _: picture, COLOR_BGR2RGB=4
    )
    monkeypatch.setitem(sys.modules, "cv2", cv2)
    monkeypatch.setitem(sys.modules, "mediapipe", _Anything())
    with open_stream("mediapipe://127.0.0.1:0") as stream:
        assert script.count("7005") == 1
        port = stream.transport.port
        names: dict[str, Any] = {}
        exec(script.replace("7005", str(port)), names)
        names["sender"].close()
        frames: list[SkeletonFrame] = []
        end, pause = time.monotonic() + PATIENCE, threading.Event()
        while len(frames) < 3 and time.monotonic() < end:
            pause.wait(0.002)
            frames += stream.poll()
        assert len(frames) == 3
        assert stream.traffic.refused == 0
