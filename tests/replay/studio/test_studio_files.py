"""Motive's tables, ASF/AMC, MVNX and OpenPose: joints, units, axes, partners, damage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.bodies.plan_by_names import plan_by_names
from devices.errors import InputError
from devices.suits.xsens_segments import xsens_skeleton
from replay.formats import read_recording, recognise
from replay.recording import Recording
from replay.stated import Stated
from tests.replay.markers.marked_bodies import marked
from tests.replay.studio.studio_files import (
    AMC,
    ASF,
    amc_by_hand,
    motive_bones,
    motive_table,
    mvnx_text,
    openpose_json,
)

INCH = 0.0254


def read(folder: Path, content: bytes | str, name: str) -> Recording:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_recording(path)


def at(recording: Recording, name: str, frame: int = 0) -> np.ndarray:
    return recording.positions[frame, recording.skeleton.index(name)]


def assert_same_shape(got: np.ndarray, truth: np.ndarray, within: float) -> None:
    """Points (T, N, 3) are others, turned and moved together."""
    apart = np.linalg.norm(got[:, :, None] - got[:1, :1, None], axis=-1)
    expected = np.linalg.norm(truth[:, :, None] - truth[:1, :1, None], axis=-1)
    np.testing.assert_allclose(apart, expected, atol=within)


@pytest.mark.parametrize("unit", ["Meters", "Millimeters"])
@pytest.mark.parametrize("prefix", ["Anna:", "Skeleton 001:"])
def test_the_skeleton_of_a_table_of_motive(unit: str, prefix: str, tmp_path: Path) -> None:
    bones = motive_bones()
    bones["LFArm"] = bones["LFArm"].copy()
    bones["LFArm"][3:6] = np.nan
    recording = read(tmp_path, motive_table(bones, "Bone", prefix=prefix, unit=unit), "a.csv")
    assert recognise(tmp_path / "a.csv").name == "OptiTrack table (CSV)"
    names = list(recording.skeleton.names)
    assert set(names) == set(bones)
    truth = np.stack([bones[name] for name in names], axis=1)
    assert_same_shape(recording.positions, truth, 1e-4)
    assert recording.confidence[3:6, names.index("LFArm")].tolist() == [0, 0, 0]
    assert recording.rotations is not None
    assert recording.times[1] == pytest.approx(1 / 120, abs=1e-5)
    plan = plan_by_names(recording.skeleton)
    assert plan is not None
    assert len(plan.arms) == len(plan.legs) == 2
    assert [names[k] for k in plan.trunk] == ["Hip", "Chest"]


def test_the_markers_of_a_table_of_motive(tmp_path: Path) -> None:
    joints, markers = marked()
    recording = read(tmp_path, motive_table(markers, "Marker", unit="Millimeters"), "m.csv")
    got = recording.positions[:, recording.skeleton.index("LeftLowerLeg")]
    foot = recording.positions[:, recording.skeleton.index("LeftFoot")]
    np.testing.assert_allclose(
        np.linalg.norm(got - foot, axis=1),
        np.linalg.norm(joints["LeftLowerLeg"] - joints["LeftFoot"], axis=1),
        atol=1e-3,
    )


def test_an_acclaim_pair_is_posed_as_by_hand(tmp_path: Path) -> None:
    (tmp_path / "01.asf").write_text(ASF)
    recording = read(tmp_path, AMC, "01_05.amc")
    rows = {
        w[0]: [float(x) for x in w[1:]]
        for w in map(str.split, AMC.split("\n2\n")[1].split("\n"))
        if w
    }
    by_hand = amc_by_hand(rows)
    starts = {"ltibia": "lfemur", "lfoot": "ltibia", "rfoot": "rtibia", "head": "thorax"}
    names = ["root", *starts, "lfoot_end"]
    truth = np.array(
        [by_hand["root"], *(by_hand[end] for end in starts.values()), by_hand["lfoot"]]
    )
    got = np.array([at(recording, name, 1) for name in names])
    assert_same_shape(got[None], truth[None] * INCH / 0.45, 1e-6)
    heights = got[:, 1] - got[0, 1]
    np.testing.assert_allclose(heights, (truth[:, 1] - truth[0, 1]) * INCH / 0.45, atol=1e-6)
    assert any("120 frames a second" in note for note in recording.notes)
    assert any("01.asf" in note for note in recording.notes)


@pytest.mark.parametrize("name", ["01_05.asf", "01.ASF", "other.asf"])
def test_the_skeleton_lies_beside_its_motion(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(ASF)
    assert len(read(tmp_path, AMC, "01_05.amc")) == 2


def test_a_motion_without_its_skeleton(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"put its .asf file beside it, such as 01\.asf"):
        read(tmp_path, AMC, "01_05.amc")
    for name in ("a.asf", "b.asf"):
        (tmp_path / name).write_text(ASF)
    with pytest.raises(InputError, match="its skeleton is missing"):
        read(tmp_path, AMC.split("\n", 1)[1], "01_05.amc")
    with pytest.raises(InputError, match=r"name an \.amc file"):
        read_recording(tmp_path / "a.asf")


def test_a_suit_goes_where_its_file_says(tmp_path: Path) -> None:
    recording = read(tmp_path, mvnx_text(), "a.mvnx")
    rest = xsens_skeleton().rest_positions
    assert recording.skeleton.names == xsens_skeleton().names
    np.testing.assert_allclose(
        recording.positions[0], rest - [rest[0, 0], rest[:, 1].min(), rest[0, 2]], atol=1e-5
    )
    step = at(recording, "Pelvis", 4) - at(recording, "Pelvis")
    np.testing.assert_allclose(step, [0, 0, 0.4], atol=1e-5)
    np.testing.assert_allclose(recording.times, np.arange(5) / 240)
    assert recording.rotations is not None
    head = recording.rotations[:, recording.skeleton.index("Head")]
    turn = 2 * np.arccos(np.clip(np.abs((head * head[0]).sum(axis=1)), 0, 1))
    np.testing.assert_allclose(turn, 0.2 * np.arange(5), atol=1e-4)


def test_a_cut_off_suit_keeps_its_whole_frames(tmp_path: Path) -> None:
    text = mvnx_text(8)
    recording = read(tmp_path, text[: text.index('index="6"')], "a.mvnx")
    assert len(recording) == 6
    assert any("cut off" in note for note in recording.notes)


@pytest.mark.parametrize("coco", [False, True])
def test_people_of_openpose_are_flat_performers(coco: bool, tmp_path: Path) -> None:
    folder = tmp_path / "film"
    folder.mkdir()
    for frame in range(4):
        lifted = {"LWrist": (70.0, 140.0 + 10 * frame)}
        people = [(-100.0, {}), (100.0 + frame, lifted)]
        (folder / f"film_{frame:012}_keypoints.json").write_bytes(
            openpose_json(*(people if frame % 2 else people[::-1]), coco=coco)
        )
    recording = read_recording(folder)
    assert recognise(folder).name == "OpenPose key points"
    assert sorted(set(recording.performers.tolist())) == [0, 1]
    np.testing.assert_allclose(np.unique(recording.times), np.arange(4) / 30)
    np.testing.assert_allclose(np.ptp(recording.positions[..., 2]), 0.0, atol=1e-9)
    mover = recording.of(int(recording.performers[1 if not recording.performers[0] else 0]))
    moving = [
        np.ptp(recording.of(p).positions[:, recording.skeleton.index("LeftHand"), 1])
        for p in (0, 1)
    ]
    assert sorted(round(one, 2) for one in moving) == [0.0, pytest.approx(0.3, abs=0.02)]
    assert len(mover) == 4
    hips = at(recording, "LeftUpperLeg") - at(recording, "RightUpperLeg")
    assert hips[0] == pytest.approx(0.18, abs=0.01)
    assert recording.positions[..., 1].min() == pytest.approx(0.0)


def test_one_frame_of_openpose_and_its_rate(tmp_path: Path) -> None:
    recording = read(tmp_path, openpose_json((0.0, {})), "a.json")
    assert len(recording) == 1
    assert at(recording, "Head")[1] > at(recording, "Hips")[1] + 0.6
    folder = tmp_path / "film"
    folder.mkdir()
    for frame in range(3):
        (folder / f"a_{frame}_keypoints.json").write_bytes(openpose_json((0.0, {})))
    assert read_recording(folder, Stated(rate=10.0)).seconds == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("content", "name", "says"),
    [
        ("Format Version,1.23\n\n", "a.csv", "no header"),
        (motive_table({"a": np.zeros((2, 3))}, "Rigid Body"), "a.csv", "neither a skeleton nor"),
        (motive_table(motive_bones(), "Bone").replace("Global", "Local"), "a.csv", "are local"),
        (motive_table({k: v[:0] for k, v in motive_bones().items()}, "Bone"), "a.csv", "no frame"),
        ("<mvnx>", "a.mvnx", "no XML"),
        (mvnx_text().replace("UTF-8", "U-infF-8"), "a.mvnx", "unknown encoding"),
        (mvnx_text().replace("UTF-8", "Shift_JIS"), "a.mvnx", "no XML"),
        (mvnx_text(0), "a.mvnx", "no frames"),
        (mvnx_text(position=False), "a.mvnx", "position and orientation"),
        (
            '<!DOCTYPE a [<!ENTITY b "c">]>' + mvnx_text().split("\n", 1)[1],
            "a.mvnx",
            "declares a document type",
        ),
        ('{"people": []}', "a_keypoints.json", "nobody"),
        ('{"people": [{"pose_keypoints_2d": [1, 2, 3]}]}', "a.json", "neither BODY_25"),
        ('{"people": 7, "a": "pose_keypoints_2d"}', "a.json", "no people"),
    ],
)
def test_others_are_refused_in_one_line(content: str, name: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        read(tmp_path, content, name)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ((":hierarchy", ":other"), "no bones"),
        (("length 7", "length x"), "no numbers"),
        (("lfemur ltibia\n", "lfemur lfemur\n"), "its tree is damaged"),
        (("axis 0 0 20  XYZ", "axis 0 0 20 XXX"), "axis order"),
    ],
)
def test_damaged_skeletons_are_named(change: tuple[str, str], says: str, tmp_path: Path) -> None:
    (tmp_path / "01.asf").write_text(ASF.replace(*change))
    with pytest.raises(InputError, match=rf"01\.asf: .*{says}"):
        read(tmp_path, AMC, "01_05.amc")


@pytest.mark.parametrize(
    ("motion", "says"),
    [
        (AMC.replace("lfemur", "tail"), "no bone of its skeleton"),
        (AMC.replace("-30 10 5", "-30 ten 5"), "are no numbers"),
        (":FULLY-SPECIFIED\n", "no frame"),
    ],
)
def test_damaged_motions_are_named(motion: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "01.asf").write_text(ASF)
    with pytest.raises(InputError, match=says):
        read(tmp_path, motion, "01_05.amc")
