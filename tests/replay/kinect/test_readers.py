"""Recorded Kinect files: axes, joint orders, clocks, gaps, real recordings, hostile input."""

from __future__ import annotations

import contextlib
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from devices.bodies.joint_labels import first_of, label_joints
from devices.bodies.joint_names import Kind, Side
from devices.errors import InputError
from devices.kinect.joints import (
    AZURE_TO_WORLD,
    KINECT_AZURE,
    KINECT_TO_WORLD,
    KINECT_V1,
    KINECT_V2,
)
from devices.skeleton import Skeleton
from replay.formats import HEAD_BYTES, formats, read_recording, recognise
from replay.recording import Recording
from tests.thorough import examples

MSR_ORDER = (  # as the data set's own drawings join them, counted from 1: 20-3, 1-8-10-12, ...
    *("ShoulderLeft", "ShoulderRight", "ShoulderCenter", "Spine", "HipLeft", "HipRight"),
    *("HipCenter", "ElbowLeft", "ElbowRight", "WristLeft", "WristRight", "HandLeft", "HandRight"),
    *("KneeLeft", "KneeRight", "AnkleLeft", "AnkleRight", "FootLeft", "FootRight", "Head"),
)
LIFT = 0.05  # [m] that the right hand rises in the second frame of what is written here


def seen_by(skeleton: Skeleton, camera_to_world: np.ndarray) -> np.ndarray:
    """Two frames (2, J, 3) of the rest pose as a level camera 2.5 m in front of it sees them."""
    poses = np.repeat(skeleton.rest_positions[None], 2, axis=0)
    poses[1, skeleton.index("HandRight"), 1] += LIFT
    return (poses - [0.1, 1.0, 2.5]) @ camera_to_world


def numbers(row: np.ndarray, between: str = " ") -> str:
    return between.join(f"{value:.7f}" for value in row)


def msr() -> str:
    poses = seen_by(KINECT_V1, KINECT_TO_WORLD)[:, [KINECT_V1.index(name) for name in MSR_ORDER]]
    return "".join(f"{numbers(place)} 1.000000\n" for pose in poses for place in pose)


def ut() -> str:
    first, second = seen_by(KINECT_V1, KINECT_TO_WORLD).reshape(2, -1)
    rows = [(190, first), (190, second), (190, second), (193, first), (220, second)]
    return "".join(f"{number}   {numbers(row, '  ')}\n" for number, row in rows)


def laban(states: tuple[int, int, int] = (2, 1, 0)) -> str:
    poses = seen_by(KINECT_V2, KINECT_TO_WORLD)
    text = ""
    for tick, pose in zip((89810293609, 89810630609), poses, strict=True):
        text += f"{tick},"
        for joint, place in enumerate(pose):
            state = states[0] if joint < 20 else states[1] if joint < 23 else states[2]
            text += f"{numbers(place, ',')},{state},"
        text += "\n"
    return text


def azure() -> str:
    poses = seen_by(KINECT_AZURE, AZURE_TO_WORLD)
    rows = [",".join(numbers(place) for place in pose) for pose in poses]
    return "\ufeff" + "\r\n".join([",".join(KINECT_AZURE.names), *rows, ""])


def ntu(identities: tuple[str, ...] = ("72057594037931101",)) -> str:
    text = "2\r\n"
    for pose in seen_by(KINECT_V2, KINECT_TO_WORLD):
        text += f"{len(identities)}\r\n"
        for number, identity in enumerate(identities):
            text += f"{identity} 0 1 1 1 1 0 0.02 0.05 2\r\n25\r\n"
            for joint, place in enumerate(pose + np.array([0.9 * number, 0, 0])):
                turn = "0 0 0 0" if joint == KINECT_V2.index("Head") else "0 0 2 0"
                text += f"{numbers(place)} 1 2 3 4 {turn} 2\r\n"
    return text


KINDS: dict[str, tuple[str, Callable[[], str], Skeleton]] = {
    "msr": ("a01_s01_e01_skeleton3D.txt", msr, KINECT_V1),
    "ut": ("joints_s01_e01.txt", ut, KINECT_V1),
    "laban": ("gesture.csv", lambda: laban((2, 2, 2)), KINECT_V2),
    "azure": ("curl.csv", azure, KINECT_AZURE),
    "ntu": ("S001.skeleton", ntu, KINECT_V2),
}


def read(tmp_path: Path, text: str, name: str) -> Recording:
    path = tmp_path / name
    path.write_bytes(text.encode())
    return read_recording(path)


@pytest.mark.parametrize("kind", KINDS)
def test_what_stood_before_the_camera_comes_back(tmp_path: Path, kind: str) -> None:
    name, written, skeleton = KINDS[kind]
    recording = read(tmp_path, written(), name)
    assert recording.skeleton.names == skeleton.names
    rest = skeleton.rest_positions - skeleton.rest_positions[skeleton.root]
    pose = recording.positions[0] - recording.positions[0, skeleton.root]
    # Levelling by how this body stands turns it a little: its head is not right above its feet.
    turn, _ = Rotation.align_vectors(pose, rest)
    assert turn.magnitude() < np.radians(3)
    np.testing.assert_allclose(pose, turn.apply(rest), atol=1e-5)
    raised = (recording.positions[1] - recording.positions[0])[:, 1]
    assert np.argmax(np.abs(raised)) == skeleton.index("HandRight")
    assert raised.max() == pytest.approx(LIFT, abs=1e-3)
    assert np.quantile(recording.positions[..., 1].min(axis=1), 0.02) == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(recording.positions[0, skeleton.root, [0, 2]], 0, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_turned_performer_and_a_tilted_camera_are_set_right(tmp_path: Path, kind: str) -> None:
    name, _, skeleton = KINDS[kind]
    expected = read(tmp_path, KINDS[kind][1](), name).positions[0]
    for angles in ((0, 40), (15, 0), (15, -40)):
        turn = Rotation.from_euler("xy", angles, degrees=True).as_matrix()
        plain = skeleton.rest_positions.copy()
        with pytest.MonkeyPatch.context() as patch:
            turned = Skeleton(skeleton.names, skeleton.parents, plain @ turn.T)
            for module_name in ("KINECT_V1", "KINECT_V2", "KINECT_AZURE"):
                if globals()[module_name] is skeleton:
                    patch.setitem(globals(), module_name, turned)
            text = KINDS[kind][1]()
        np.testing.assert_allclose(read(tmp_path, text, name).positions[0], expected, atol=0.02)


def test_clocks(tmp_path: Path) -> None:
    at = {kind: read(tmp_path, KINDS[kind][1](), KINDS[kind][0]) for kind in KINDS}
    np.testing.assert_allclose(at["msr"].times, [0, 1 / 15])
    np.testing.assert_allclose(at["azure"].times, [0, 1 / 30])
    np.testing.assert_allclose(at["ntu"].times, [0, 1 / 30])
    np.testing.assert_allclose(at["laban"].times, [0, 0.0337], atol=1e-9)
    # Two captures share number 190 and are spaced; the whole repetition is left out; the gap stays.
    np.testing.assert_allclose(at["ut"].times, [0, 1 / 60, 3 / 30, 1.0])
    assert any("share a frame number" in note for note in at["ut"].notes)
    assert any("repeat" in note for note in at["ut"].notes)


def test_a_clock_that_runs_back_is_held(tmp_path: Path) -> None:
    text = ut().replace("\n220 ", "\n100 ")
    recording = read(tmp_path, text, "joints.txt")
    assert (np.diff(recording.times) >= 0).all()
    assert any("runs back" in note for note in recording.notes)


def test_tracking_states_and_origins_become_confidence(tmp_path: Path) -> None:
    recording = read(tmp_path, laban((2, 1, 0)), "gesture.csv")
    assert recording.confidence[0].tolist() == [1.0] * 20 + [0.5] * 3 + [0.0] * 2
    assert np.isnan(recording.positions[:, 23:]).all()
    rows = msr().splitlines()
    rows[0], rows[1] = "0 0 0 0", rows[1].replace("1.000000", "0.000000")
    recording = read(tmp_path, "\n".join(rows), "a01.txt")
    assert recording.confidence[0, KINECT_V1.index("ShoulderLeft")] == 0
    assert np.isnan(recording.positions[0, KINECT_V1.index("ShoulderLeft")]).all()
    assert recording.confidence[0, KINECT_V1.index("ShoulderRight")] == 0.5


def test_bodies_of_ntu_become_performers_with_rotations(tmp_path: Path) -> None:
    recording = read(tmp_path, ntu(("72057594037931101", "72057594037931102")), "two.skeleton")
    assert recording.performers.tolist() == [0, 1, 0, 1]
    np.testing.assert_allclose(recording.times, [0, 0, 1 / 30, 1 / 30])
    assert recording.rotations is not None
    assert np.isnan(recording.rotations[:, KINECT_V2.index("Head")]).all()
    # Half a turn about the camera's Y is no turn at all in our axes, levelling aside.
    turns = Rotation.from_quat(recording.rotations[:, 0]).magnitude()
    assert (turns < np.radians(3)).all()


def test_a_cut_last_line_is_left_out(tmp_path: Path) -> None:
    for kind, (name, written, _) in KINDS.items():
        text = written()
        whole = read(tmp_path, text, name)
        cut = read(tmp_path, text[: len(text) - 30], name)
        assert len(cut) == len(whole) - 1, kind
        assert any("omitted" in note or "whole ones" in note for note in cut.notes)


@pytest.mark.parametrize(
    ("kind", "before", "after", "message"),
    [
        ("msr", "1.000000", "1.0 2.0", r"line 1: expected 4 numbers"),
        ("ut", "190 ", "190 7 ", r"line 1: expected 61 numbers"),
        ("laban", ",2,", ",9,", r"tracking state 9 is none of 0, 1, 2"),
        ("azure", ",Head", ",Kopf", r"line 1: no column is called 'Head'"),
        ("azure", "0.0000000", "nought", r"line 2: expected cells of three numbers"),
        ("ntu", "\n25\r", "\n24\r", r"expected"),
        ("ntu", "\n1\r", "\n1000\r", r"line 2: expected a count up to 6"),
    ],
)
def test_what_is_wrong_is_said_with_where(
    tmp_path: Path, kind: str, before: str, after: str, message: str
) -> None:
    name, written, _ = KINDS[kind]
    path = tmp_path / name
    path.write_text(written().replace(before, after, 1), encoding="utf-8")
    reader = next(f.read for f in formats() if f.recognises(path, written().encode()[:HEAD_BYTES]))
    with pytest.raises(InputError, match=message) as error:
        reader(path)
    assert name in str(error.value)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\n\n",
        b"\x00\xff\xfe\x80" * 600,
        b"s01_e01\nwalk: 252 390\nsitDown: 572 686\n",
        b"1 2 3\n4 5 6\n",
        b"x,y,z\n1,2,3\n",
        b"7\n",
        b"{}",
    ],
)
def test_what_is_no_recording_is_not_taken_for_one(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "actionLabel.txt"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"is not a recording that can be read|is empty"):
        recognise(path)


@settings(
    max_examples=examples(250),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.integers(0, 2**32))
def test_any_damage_gives_a_clear_error_or_a_sound_recording(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    name, written, _ = KINDS[chance.choice(sorted(KINDS))]
    data = written().encode()
    whole = tmp_path / name
    whole.write_bytes(data)
    reader = recognise(whole)
    words = (
        b"nan",
        b"-",
        b"inf",
        b"1e308",
        b"\xff",
        b",",
        b"\n",
        b" 0 0 0 ",
        b"999999999999999999",
    )
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(data) + 1)
        to = min(len(data), at + chance.choice((0, 0, 1, 9, 200)))
        data = data[:at] + chance.choice(words) + data[to:]
        if chance.random() < 0.3:
            data = data[: chance.randrange(len(data) + 1)]
    whole.write_bytes(data)
    with contextlib.suppress(InputError):
        recognise(whole)
    with contextlib.suppress(InputError):
        assert_sound(reader.read(whole))


def assert_sound(recording: Recording) -> None:
    assert recording.times[0] == 0
    assert (np.diff(recording.times) >= 0).all()
    unseen = np.isnan(recording.positions).any(axis=2)
    np.testing.assert_array_equal(unseen, recording.confidence == 0)
    assert not np.isinf(recording.positions).any()
    assert recording.confidence.max() <= 1


def kinect_files(shared: Path) -> list[Path]:
    return sorted(p for p in (shared / "kinect").glob("*/*") if p.name != "actionLabel.txt")


def test_every_shared_recording_stands_upright_facing_the_front(shared: Path) -> None:
    for path in kinect_files(shared):
        recording = read_recording(path)
        assert_sound(recording)
        skeleton, parts = recording.skeleton, label_joints(recording.skeleton)
        # The subject of joints.csv sits at first; every other stands.
        pose = recording.positions[len(recording) // 2 if path.name == "joints.csv" else 0]

        def at(kind: Kind, side: Side = Side.CENTRE, pose: np.ndarray = pose) -> np.ndarray:
            joint = first_of(parts, skeleton, kind, side)  # noqa: B023  # called within the same turn of the loop
            assert joint is not None
            return pose[joint]

        feet = [at(Kind.FOOT, side) for side in (Side.LEFT, Side.RIGHT)]
        assert at(Kind.HEAD)[1] > at(Kind.HIPS)[1] > max(foot[1] for foot in feet), path.name
        across = at(Kind.UPPER_ARM, Side.LEFT) - at(Kind.UPPER_ARM, Side.RIGHT)
        assert across[0] > 0.8 * np.linalg.norm(across), path.name
        assert at(Kind.HAND, Side.LEFT)[0] > at(Kind.HAND, Side.RIGHT)[0], path.name
        assert 1.2 < at(Kind.HEAD)[1] - min(foot[1] for foot in feet) < 2.0, path.name


def test_feet_point_forward_so_that_left_and_right_are_not_swapped(shared: Path) -> None:
    for path in kinect_files(shared):
        recording = read_recording(path)
        at = {name: recording.positions[:, j] for j, name in enumerate(recording.skeleton.names)}
        across = at["ShoulderLeft"] - at["ShoulderRight"]
        forward = np.cross(across, [0.0, 1.0, 0.0])
        feet = at["FootLeft"] + at["FootRight"] - at["AnkleLeft"] - at["AnkleRight"]
        assert np.nanmedian((feet * forward).sum(axis=1)) > 0, path.name


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("azure_gymtrainer/26_07_15_56_53.csv", 309),
        ("v1_msraction3d/a01_s01_e01_skeleton3D.txt", 54),
        ("v1_utkinect/joints_s01_e01.txt", 560),
        ("v2_laban/joints.csv", 371),
        ("v2_ntu/S001C001P001R001A001.skeleton", 103),
    ],
)
def test_shared_recordings_keep_every_frame(shared: Path, name: str, frames: int) -> None:
    assert len(read_recording(shared / "kinect" / name)) == frames


def test_the_high_arm_wave_is_done_with_the_right_arm(shared: Path) -> None:
    recording = read_recording(shared / "kinect" / "v1_msraction3d" / "a01_s01_e01_skeleton3D.txt")
    moved = np.ptp(recording.positions, axis=0).max(axis=1)
    assert recording.skeleton.names[int(np.argmax(moved))] == "HandRight"


def test_labels_are_no_recording(shared: Path) -> None:
    with pytest.raises(InputError, match="is not a recording"):
        recognise(shared / "kinect" / "v1_utkinect" / "actionLabel.txt")
