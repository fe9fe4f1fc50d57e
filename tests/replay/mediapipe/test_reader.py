"""MediaPipe recordings: landmarks from every kind of file, and damaged files."""

from __future__ import annotations

import contextlib
import json
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.errors import InputError
from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS
from replay.formats import read_recording
from replay.mediapipe.reader import read_mediapipe, recognises_mediapipe
from replay.recording import Recording
from tests.thorough import examples

WIDTH, HEIGHT, FRAMES = 320, 240, 4


def standing(frame: int = 0) -> np.ndarray:
    """(33, 3) world landmarks [m, y down]: the right wrist goes up with the frames."""
    points = np.zeros((33, 3))
    places = {
        "nose": (0, -0.6, -0.1),
        "left_shoulder": (0.18, -0.48, 0),
        "left_elbow": (0.3, -0.25, 0),
        "left_wrist": (0.35, 0.0, -0.05),
        "left_hip": (0.1, 0, 0),
        "left_knee": (0.1, 0.42, -0.02),
        "left_ankle": (0.1, 0.84, 0),
    }
    for name, place in places.items():
        points[POSE_LANDMARKS.index(name)] = place
        if name.startswith("left"):
            right = POSE_LANDMARKS.index(name.replace("left", "right"))
            points[right] = np.multiply(place, (-1, 1, 1))
    points[POSE_LANDMARKS.index("right_wrist"), 1] -= 0.1 * frame
    return points


def hand() -> np.ndarray:
    """(21, 3) landmarks [m] of a hand, its wrist at the origin, fingers up in the image."""
    points = np.zeros((21, 3))
    for index in range(1, 21):
        finger, joint = divmod(index - 1, 4)
        points[index] = (0.02 * (finger - 2), -0.05 - 0.03 * joint, -0.01 * joint)
    return points


def text(value: str) -> bytes:
    return struct.pack("<H", len(value)) + value.encode()


def pose_bytes(
    components: Mapping[str, tuple[list[str], np.ndarray, np.ndarray]],
    *,
    version: float = 0.2,
    frames_written: int | None = None,
    layout: str = "XYZC",
) -> bytes:
    """A .pose file, written from the specification: components of points (T, people, N, 3)."""
    out = struct.pack("<fHHHH", version, WIDTH, HEIGHT, 0, len(components))
    for name, (names, _, _) in components.items():
        out += text(name) + text(layout) + struct.pack("<HHH", len(names), 1, 1)
        out += b"".join(map(text, names)) + struct.pack("<HHHHH", 0, 0, 255, 0, 0)
    points = np.concatenate([found for _, found, _ in components.values()], axis=2)
    confidence = np.concatenate([found for _, _, found in components.values()], axis=2)
    count = len(points) if frames_written is None else frames_written
    body = "<fIH" if version > 0.15 else "<HHH"
    out += struct.pack(body, 25, count, points.shape[1])
    points = points[..., : len(layout) - 1]
    return out + points.astype("<f4").tobytes() + confidence.astype("<f4").tobytes()


def in_image(metres: np.ndarray) -> np.ndarray:
    """Points as pose-format stores those of an image: x, y in pixels, z by the image's width."""
    return metres * (100.0, 100.0, 100.0 / WIDTH) + (160.0, 100.0, 0.0)


def full(people: int = 1) -> dict[str, tuple[list[str], np.ndarray, np.ndarray]]:
    world = np.stack([np.stack([standing(t)] * people) for t in range(FRAMES)])
    wrist = world[:, :, [POSE_LANDMARKS.index("left_wrist")]]
    names = [name.upper() for name in POSE_LANDMARKS]
    hand_names = [name.upper() for name in HAND_LANDMARKS]
    sure, hand_sure = np.full(world.shape[:3], 0.9), np.ones((FRAMES, people, 21))
    hand_sure[1] = 0.0
    return {
        "POSE_LANDMARKS": (names, in_image(world), sure),
        "LEFT_HAND_LANDMARKS": (hand_names, in_image(wrist + hand()), hand_sure),
        "POSE_WORLD_LANDMARKS": (names, world * (WIDTH, HEIGHT, 1.0), sure),
    }


def saved(path: Path, data: bytes | str) -> Path:
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


def place(recording: Recording, index: int, name: str) -> np.ndarray:
    return recording.positions[index, recording.skeleton.index(name)]


def readable(path: Path) -> Recording | None:
    """The recording, or None if there is one clear error instead; anything else fails the test."""
    with contextlib.suppress(InputError):
        recording = read_mediapipe(path)
        assert np.isfinite(recording.times).all()
        assert (np.diff(recording.times) >= 0).all()
        seen = np.isfinite(recording.positions).all(axis=2)
        np.testing.assert_array_equal(recording.confidence > 0, seen)
        return recording
    return None


@pytest.mark.parametrize("version", [0.1, 0.2])
def test_a_pose_file_gives_world_landmarks_facing_the_camera(
    tmp_path: Path, version: float
) -> None:
    path = saved(tmp_path / "a.pose", pose_bytes(full(), version=version))
    recording = read_recording(path)
    np.testing.assert_allclose(recording.times, 0.04 * np.arange(FRAMES))
    np.testing.assert_allclose(place(recording, 0, "left_elbow"), [0.3, 0.25, 0], atol=1e-6)
    np.testing.assert_allclose(place(recording, 2, "right_wrist"), [-0.35, 0.2, 0.05], atol=1e-6)
    np.testing.assert_allclose(place(recording, 0, "mid_shoulder"), [0, 0.48, 0], atol=1e-6)
    assert recording.confidence.max() == 1.0
    assert "left_eye_inner" not in recording.skeleton.names
    assert recording.skeleton.names[recording.skeleton.root] == "mid_hip"


def test_a_hand_of_the_image_is_moved_to_the_wrist_in_metres(tmp_path: Path) -> None:
    recording = read_mediapipe(saved(tmp_path / "a.pose", pose_bytes(full())))
    expected = place(recording, 0, "left_wrist") + hand()[8] * (1, -1, -1)
    found = place(recording, 0, "left_index_finger_tip")
    np.testing.assert_allclose(found[:2], expected[:2], atol=1e-5)
    assert np.isnan(place(recording, 1, "left_index_finger_tip")).all()
    assert "left_index" not in recording.skeleton.names  # the pose's own, coarser fingers
    assert "right_index" in recording.skeleton.names


def test_masked_points_are_unseen(tmp_path: Path) -> None:
    components = full()
    components["POSE_WORLD_LANDMARKS"][2][2, 0, POSE_LANDMARKS.index("left_hip")] = 0.0
    recording = read_mediapipe(saved(tmp_path / "a.pose", pose_bytes(components)))
    for name in ("left_hip", "mid_hip"):
        assert np.isnan(place(recording, 2, name)).all()
        assert recording.confidence[2, recording.skeleton.index(name)] == 0.0
    assert np.isfinite(place(recording, 1, "mid_hip")).all()


def test_a_signalling_nan_is_unseen_and_not_warned_of(tmp_path: Path) -> None:
    wrist = POSE_LANDMARKS.index("right_wrist")  # is somewhere else in each frame
    there = struct.pack("<3f", *full()["POSE_WORLD_LANDMARKS"][1][2, 0, wrist])
    assert POSE.count(there) == 1
    damaged = POSE.replace(there, bytes.fromhex("0000817f") + there[4:])
    recording = read_mediapipe(saved(tmp_path / "a.pose", damaged))
    assert np.isnan(place(recording, 2, "right_wrist")).all()
    assert np.isfinite(place(recording, 1, "right_wrist")).all()


def test_each_person_is_a_performer(tmp_path: Path) -> None:
    recording = read_mediapipe(saved(tmp_path / "a.pose", pose_bytes(full(people=2))))
    assert recording.performers.tolist() == [0, 1] * FRAMES
    assert (np.diff(recording.times) >= 0).all()


def test_without_world_landmarks_shoulders_give_the_size_and_bones_the_depth(
    tmp_path: Path,
) -> None:
    # The forearm swings in depth at one length; z is stored at twice its scale, and moved.
    angles = np.linspace(-1.2, 1.2, 30)
    points = np.repeat(standing()[None], 30, axis=0)
    elbow, wrist = (POSE_LANDMARKS.index(f"left_{joint}") for joint in ("elbow", "wrist"))
    swing = np.stack([np.zeros(30), np.cos(angles), np.sin(angles)], axis=1)
    points[:, wrist] = points[:, elbow] + 0.25 * swing
    pixels = in_image(points) * (1.0, 1.0, 2.0) + (0.0, 0.0, 625.0)
    names = [name.upper() for name in POSE_LANDMARKS]
    components = {"POSE_LANDMARKS": (names, pixels[:, None], np.ones((30, 1, 33)))}
    recording = read_mediapipe(saved(tmp_path / "a.pose", pose_bytes(components)))
    shoulders = place(recording, 0, "left_shoulder") - place(recording, 0, "right_shoulder")
    np.testing.assert_allclose(shoulders, [0.36, 0, 0], atol=1e-6)
    joints = [recording.skeleton.index(name) for name in ("left_elbow", "left_wrist")]
    forearm = recording.positions[:, joints[1]] - recording.positions[:, joints[0]]
    np.testing.assert_allclose(np.linalg.norm(forearm, axis=1), 0.25, rtol=1e-3)
    np.testing.assert_allclose(place(recording, 0, "mid_hip"), 0, atol=1e-6)
    assert "no world landmarks" in recording.notes[0]


def test_hands_without_a_body_are_joined_between_them(tmp_path: Path) -> None:
    components = {}
    for side, x in (("LEFT", 0.3), ("RIGHT", -0.3)):
        points = in_image(np.stack([np.add(hand(), (x, 0, 0))[None]] * FRAMES))
        names = [name.upper() for name in HAND_LANDMARKS]
        components[f"{side}_HAND_LANDMARKS"] = (names, points, np.ones((FRAMES, 1, 21)))
    recording = read_mediapipe(saved(tmp_path / "a.pose", pose_bytes(components)))
    assert recording.skeleton.names[recording.skeleton.root] == "middle"
    np.testing.assert_allclose(place(recording, 0, "middle"), 0, atol=1e-9)
    assert place(recording, 0, "left_wrist")[0] > 0.2
    assert place(recording, 0, "left_middle_finger_tip")[1] > 0.05


def long_table() -> str:
    rows = ["frame,t_s,landmark,x_img_px,y_img_px,z_img,visibility,x_world_m,y_world_m,z_world_m"]
    for frame in range(FRAMES):
        for name, (x, y, z) in zip(POSE_LANDMARKS, standing(frame), strict=True):
            rows.append(f"{frame},{0.1 * frame},{name.upper()},1,2,3,0.5,{x},{y},{z}")
    return "\n".join(rows)


def numbered_table() -> str:
    rows = ["frame;timestamp_ms;landmark_id;x;y;z".replace(";", ",")]
    for frame in range(FRAMES):
        for number, (x, y, z) in enumerate(standing(frame)):
            rows.append(f"{frame},{100 * frame},{number},{x},{y},{z}")
    return "\n".join(rows)


def wide_table() -> str:
    header = ["time"] + [f"{name}_{axis}" for name in POSE_LANDMARKS for axis in "xyz"]
    rows = [",".join(header)]
    for frame in range(FRAMES):
        rows.append(",".join(map(str, [0.1 * frame, *standing(frame).ravel()])))
    return "\r\n".join(rows)


def counted_table() -> str:
    header = ["t"] + [f"{axis}{number}" for number in range(33) for axis in "xyzv"]
    rows = [",".join(header)]
    for frame in range(FRAMES):
        points = np.concatenate([standing(frame), np.ones((33, 1))], axis=1)
        rows.append(",".join(map(str, [0.1 * frame, *points.ravel()])))
    return "\n".join(rows)


def json_lines() -> str:
    rows = []
    for frame in range(FRAMES):
        keys = ("x", "y", "z")
        points = [dict(zip(keys, map(float, point), strict=True)) for point in standing(frame)]
        rows.append(json.dumps({"timestamp_ms": 100 * frame, "pose_world_landmarks": [points]}))
    return "\n".join(rows) + '\n{"timestamp_ms": 4'  # cut


def json_list() -> str:
    frames = [
        {"time": 0.1 * frame, "poseWorldLandmarks": standing(frame).tolist()}
        for frame in range(FRAMES)
    ]
    return json.dumps(frames)


@pytest.mark.parametrize(
    "make", [long_table, numbered_table, wide_table, counted_table, json_lines, json_list]
)
def test_text_in_many_forms_holds_the_same(tmp_path: Path, make: object) -> None:
    assert callable(make)
    path = saved(tmp_path / "a.txt", make())
    assert recognises_mediapipe(path, path.read_bytes()[:4096])
    recording = read_mediapipe(path)
    np.testing.assert_allclose(recording.times, 0.1 * np.arange(FRAMES), atol=1e-12)
    np.testing.assert_allclose(place(recording, 3, "right_wrist"), [-0.35, 0.3, 0.05], atol=1e-9)
    np.testing.assert_allclose(place(recording, 0, "left_knee"), [0.1, -0.42, 0.02], atol=1e-9)


def test_landmarks_of_an_image_of_unknown_shape_are_stretched(tmp_path: Path) -> None:
    points = 0.5 + 0.5 * standing() * (9 / 16, 1.0, 9 / 16)
    path = saved(tmp_path / "a.json", json.dumps([{"pose_landmarks": points.tolist()}] * 2))
    recording = read_mediapipe(path)
    np.testing.assert_allclose(place(recording, 0, "left_shoulder")[:2], [0.18, 0.48], atol=1e-9)
    assert len(recording.notes) == 2


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"frame,landmark,x,y,z\n",
        b"frame,landmark,x,y,z\n0,elbow grease,1,2,3\n",
        b"frame,landmark,x,y,z\n0,NOSE,nan,inf,x\n",
        b'{"pose_landmarks": 3}',
        b'{"pose_landmarks": [[1, 2, 3]]}',
        b'[{"pose_landmarks": [' + b"[" * 50_000,
        b'{"frames": 7, "pose_landmarks": 1}',
        pose_bytes(full(), layout="XYC")[:300],
        pose_bytes(full(), frames_written=1_000_000_000),
        pose_bytes(full(), frames_written=0),
        pose_bytes({"POSE_LANDMARKS": (["A"], np.zeros((2, 1, 1, 3)), np.ones((2, 1, 1)))}),
        pose_bytes(full(), version=0.3),
        pose_bytes(full(), layout="ZYXC"),
    ],
)
def test_what_is_no_recording_is_one_clear_error(tmp_path: Path, data: bytes) -> None:
    path = saved(tmp_path / "bad.pose", data)
    with pytest.raises(InputError) as caught:
        read_mediapipe(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_other_tables_are_not_taken_for_landmarks() -> None:
    for head in (
        b"frame,name,x,y,z\n0,Hips,1,2,3",
        b"a,b,c\n",
        b'{"landmarksmanship": 1}',
        b"\xff",
    ):
        assert not recognises_mediapipe(Path("a.csv"), head)


@settings(max_examples=examples(150), deadline=None)
@given(st.data())
def test_mutated_files_never_surprise(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    whole = data.draw(st.sampled_from([POSE, POSE, json_lines().encode(), long_table().encode()]))
    damaged = bytearray(whole[: data.draw(st.integers(20, len(whole)))])
    for _ in range(data.draw(st.integers(0, 6))):
        at = data.draw(st.integers(0, min(len(damaged) - 1, 3000)))
        damaged[at] = data.draw(st.integers(0, 255))
    readable(saved(tmp_path_factory.getbasetemp() / "mutated", bytes(damaged)))


POSE = pose_bytes(full())


def test_real_recordings_stand_upright_with_left_on_the_right(shared: Path) -> None:
    for path in sorted((shared / "mediapipe").iterdir()):
        recording = read_recording(path)
        mean = {
            name: np.nanmean(recording.positions[:, recording.skeleton.index(name)], axis=0)
            for name in ("nose", "mid_shoulder", "mid_hip", "left_shoulder", "right_shoulder")
        }
        assert mean["nose"][1] > mean["mid_shoulder"][1] > mean["mid_hip"][1]
        apart = mean["left_shoulder"] - mean["right_shoulder"]
        assert 0.2 < apart[0] < 0.5
        assert 0.35 < mean["mid_shoulder"][1] - mean["mid_hip"][1] < 0.65
        hands = [n for n in recording.skeleton.names if n.endswith("middle_finger_mcp")]
        for name in hands:
            wrist = recording.skeleton.index(name.replace("middle_finger_mcp", "wrist"))
            palm = (
                recording.positions[:, recording.skeleton.index(name)]
                - recording.positions[:, wrist]
            )
            assert 0.06 < np.nanmedian(np.linalg.norm(palm, axis=1)) < 0.13


def test_real_world_landmarks_agree_between_the_table_and_the_pose_file(shared: Path) -> None:
    table, pose = (
        read_recording(shared / "mediapipe" / name)
        for name in ("derived_pose33_world.csv", "mediapipe_holistic_full_example.pose")
    )
    for name in ("left_elbow", "right_wrist", "nose"):
        joints = [r.positions[:, r.skeleton.index(name)] for r in (table, pose)]
        assert np.nanmax(np.abs(joints[0] - joints[1])) < 1e-3
