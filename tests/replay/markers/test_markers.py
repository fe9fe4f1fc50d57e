"""C3D and TRC: the joints of a body within its markers, units, axes, gaps, names, damage."""

from __future__ import annotations

import io
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest

from devices.bodies.plan_by_names import plan_by_names
from devices.errors import InputError
from replay.formats import read_recording, recognise
from replay.markers.c3d import c3d_markers
from replay.markers.joint_centres import completed_cluster
from replay.markers.marker_names import place_of, subjects
from replay.recording import Recording
from replay.stated import Stated
from tests.replay.markers.marked_bodies import UP_Z, c3d_bytes, marked, trc_text

JOINTS, MARKERS = marked()
Z_UP = {name: track @ UP_Z.T for name, track in MARKERS.items()}


def read(folder: Path, content: bytes | str, name: str = "walk.c3d", **said: str) -> Recording:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_recording(path, Stated(**said))


def assert_alike(recording: Recording, within: float = 2e-3, **other: np.ndarray) -> None:
    """The recording's joints are the body's, turned and moved together."""
    names = [name for name in JOINTS if name in recording.skeleton.names]
    assert len(names) >= 16
    truth = np.stack([(JOINTS | other)[name] for name in names], axis=1)
    got = np.stack([recording.positions[:, recording.skeleton.index(n)] for n in names], axis=1)
    assert got.shape == truth.shape
    # Turned about the vertical alone and moved: heights above the lowest joint stay.
    np.testing.assert_allclose(
        got[..., 1] - np.nanmin(got[..., 1]), truth[..., 1] - truth[..., 1].min(), atol=within
    )
    spread = np.linalg.norm(got[:, :, None] - got[:1, :1, None, :], axis=-1)
    expected = np.linalg.norm(truth[:, :, None] - truth[:1, :1, None, :], axis=-1)
    np.testing.assert_allclose(spread, expected, atol=within)
    across = got[0, names.index("LeftUpperLeg")] - got[0, names.index("RightUpperLeg")]
    assert across[0] > 0.9 * np.linalg.norm(across)


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize("scale", [-1.0, 0.1])
@pytest.mark.parametrize("analogue", [0, 3])
def test_the_joints_of_a_body_come_out_of_its_markers(
    processor: int, scale: float, analogue: int, tmp_path: Path
) -> None:
    data = c3d_bytes(Z_UP, processor=processor, scale=scale, analogue=analogue)
    recording = read(tmp_path, data)
    assert_alike(recording)
    assert recording.seconds == pytest.approx(59 / 120)
    assert recording.skeleton.names[recording.skeleton.root] == "Hips"
    assert (recording.confidence == 1.0).all()
    assert any("joints from" in note for note in recording.notes)
    plan = plan_by_names(recording.skeleton)
    assert plan is not None
    assert [recording.skeleton.names[k] for k in plan.trunk] == ["Hips", "UpperChest"]
    assert len(plan.arms) == len(plan.legs) == 2


@pytest.mark.parametrize("screen", ["+Z", "+Y"])
@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("cm", 100.0), ("", 1000.0)])
def test_units_and_axes(screen: str, unit: str, factor: float, tmp_path: Path) -> None:
    """A wrong Y_SCREEN is common; the body goes upright along another axis then."""
    data = c3d_bytes(Z_UP, unit=unit or " ", factor=factor, screen=("+X", screen))
    recording = read(tmp_path, data, **({} if unit else {"unit": "mm"}))
    assert_alike(recording)
    assert any("+Z, as the body stands" in note for note in recording.notes) == (screen == "+Y")


def test_a_body_without_inner_markers_is_near(tmp_path: Path) -> None:
    outer = {name: track for name, track in Z_UP.items() if not name.endswith("M")}
    assert_alike(read(tmp_path, c3d_bytes(outer)), within=0.05)


def test_lost_markers_are_filled_in_or_missing(tmp_path: Path) -> None:
    gaps = {name: track.copy() for name, track in Z_UP.items()}
    gaps["LASI"][10:20] = np.nan  # one of four of the pelvis
    gaps["RKNE"][30:40] = np.nan
    recording = read(tmp_path, c3d_bytes(gaps))
    assert recording.confidence[10:20].all()
    knee = recording.skeleton.index("RightLowerLeg")
    assert not recording.confidence[30:40, knee].any()
    assert np.isnan(recording.positions[30:40, knee]).all()
    whole = read(tmp_path, c3d_bytes(Z_UP))
    np.testing.assert_allclose(recording.positions[10:20], whole.positions[10:20], atol=2e-3)


def test_hips_and_feet_that_are_never_seen_together(tmp_path: Path) -> None:
    gaps = {name: track.copy() for name, track in Z_UP.items()}
    for name in ("LASI", "RASI", "LPSI", "RPSI"):
        gaps[name][::2] = np.nan
    for name in ("LANK", "LANKM", "RANK", "RANKM"):
        gaps[name][1::2] = np.nan
    recording = read(tmp_path, c3d_bytes(gaps, screen=("+X", "+Y")))
    foot, hip = (recording.skeleton.index(f"Left{bone}") for bone in ("Foot", "UpperLeg"))
    assert not (recording.confidence[:, foot] * recording.confidence[:, hip]).any()


def test_a_rigid_cluster_is_completed_by_its_shape() -> None:
    shape = np.array([[0.1, 0, 0.1], [-0.1, 0, 0.1], [0.05, 0, -0.1], [-0.05, 0.02, -0.1]])
    turns = np.linspace(0, 3, 20)
    c, s = np.cos(turns), np.sin(turns)
    matrices = np.stack([c, 0 * c, s, 0 * c, 0 * c + 1, 0 * c, -s, 0 * c, c], 1).reshape(-1, 3, 3)
    points = np.einsum("tij,nj->tni", matrices, shape) + turns[:, None, None]
    holes = points.copy()
    holes[5:12, 2] = np.nan
    holes[15, :2] = np.nan
    filled = completed_cluster(holes)
    np.testing.assert_allclose(filled[5:12], points[5:12], atol=1e-9)
    assert np.isnan(filled[15, :2]).all()


@pytest.mark.parametrize("prefix", ["Anna:", "Anna_", "take_1_Anna_"])
def test_prefixes_of_subjects_are_left_out(prefix: str, tmp_path: Path) -> None:
    named = {prefix + name: track for name, track in Z_UP.items()}
    recording = read(tmp_path, c3d_bytes(named | {"*1": Z_UP["LASI"]}))
    assert_alike(recording)


def test_of_two_subjects_the_whole_one_is_read(tmp_path: Path) -> None:
    named = {f"Ben:{name}": track for name, track in list(Z_UP.items())[:8]}
    named |= {f"Anna:{name}": track for name, track in Z_UP.items()}
    recording = read(tmp_path, c3d_bytes(named))
    assert_alike(recording)
    assert any("'Anna'" in note and "'Ben'" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("LASI", "left asis"),
        ("RBWT", "right psis"),
        ("WaistLFront", "left asis"),
        ("R.Knee.Lat", "right knee out"),
        ("r_mknee_study", "right knee in"),
        ("r_knee_study", "right knee out"),
        ("RKnee", "right knee"),
        ("L.Acromium", "left acromion"),
        ("RHJC_study", "right hip"),
        ("RHip", "right hip point"),
        ("V.Sacral", "sacrum"),
        ("R.Wrist.Med", "right wrist little"),
        ("LFEP", "left hip"),
        ("LBigToe", "left toe"),
        ("LTHI", None),
        ("LKneeAngles", None),
        ("X" * 1000, None),
    ],
)
def test_places_of_names(name: str, place: str | None) -> None:
    assert place_of(name) == place


def test_no_name_has_two_places_in_one_set() -> None:
    sets = "LFHD RFHD LBHD RBHD C7 T10 CLAV STRN RBAC LSHO LELB LWRA LWRB LFIN LASI LKNE LANK LTOE"
    found = subjects(sets.split())[0].markers
    assert len(found) == len(sets.split()) - 1  # RBAC tells no joint


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1000.0), ("m", 1.0)])
def test_trc_has_the_same_joints(unit: str, factor: float, tmp_path: Path) -> None:
    gaps = {name: track.copy() for name, track in MARKERS.items()}
    gaps["RKNE"][30:40] = np.nan
    recording = read(tmp_path, trc_text(gaps, unit=unit, factor=factor), "a.trc")
    assert recognise(tmp_path / "a.trc").name == "markers, TRC"
    knee = recording.skeleton.index("RightLowerLeg")
    assert np.isnan(recording.positions[30:40, knee]).all()
    assert_alike(read(tmp_path, trc_text(MARKERS, unit=unit, factor=factor), "b.trc"))
    assert recording.times[1] == pytest.approx(0.01)


def test_key_points_of_pose2sim_are_joints(tmp_path: Path) -> None:
    points = {"Hip": (JOINTS["LeftUpperLeg"] + JOINTS["RightUpperLeg"]) / 2}
    for name, bone in zip(
        "Hip Knee Ankle BigToe Shoulder Elbow Wrist".split(),
        "UpperLeg LowerLeg Foot Toes UpperArm LowerArm Hand".split(),
        strict=True,
    ):
        points |= {side[0] + name: JOINTS[side + bone] for side in ("Left", "Right")}
    points |= {"Neck": JOINTS["UpperChest"], "Head": JOINTS["Head"]}
    assert_alike(read(tmp_path, trc_text(points, unit="m", factor=1.0), "p.trc"), within=1e-4)


def test_a_neck_above_the_shoulders_is_a_joint_and_lacking_legs_are_told(tmp_path: Path) -> None:
    points = {side[0] + "Hip": JOINTS[side + "UpperLeg"] for side in ("Left", "Right")}
    for name, bone in (("Shoulder", "UpperArm"), ("Elbow", "LowerArm"), ("Wrist", "Hand")):
        points |= {side[0] + name: JOINTS[side + bone] for side in ("Left", "Right")}
    points |= {"Neck": JOINTS["UpperChest"] + [0.0, 0.08, 0.0], "Head": JOINTS["Head"]}
    recording = read(tmp_path, trc_text(points, unit="m", factor=1.0), "p.trc")
    names = recording.skeleton.names
    assert recording.skeleton.parents[names.index("LeftUpperArm")] == names.index("UpperChest")
    assert recording.skeleton.parents[names.index("Head")] == names.index("Neck")
    assert any("legs that lack markers are left out" in note for note in recording.notes)


def test_trc_with_decimal_commas_and_names_for_each_axis(tmp_path: Path) -> None:
    text = trc_text(MARKERS, unit="m", factor=1.0)
    lines = text.split("\n")
    each = "\t".join(f"{name}_{axis}" for name in MARKERS for axis in "xyz")
    lines[3:6] = [f"Frame#\tTime\t{each}"]
    assert_alike(read(tmp_path, "\n".join(lines).replace(".", ","), "c.trc"), within=1e-4)


def test_the_peer_reads_the_same_numbers() -> None:
    """py-c3d, which the program does not use."""
    c3d = pytest.importorskip("c3d")
    gaps = {name: track.copy() for name, track in Z_UP.items()}
    gaps["LASI"][10:20] = np.nan
    for processor, scale, analogue in ((84, -1.0, 2), (85, -1.0, 2), (84, 0.05, 0)):
        data = c3d_bytes(gaps, processor=processor, scale=scale, analogue=analogue)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            peer = c3d.Reader(io.BytesIO(data))
            points = np.array([points for _, points, _ in peer.read_frames()])
        own = c3d_markers(data, [])
        assert own.names == [label.strip() for label in peer.point_labels]
        assert own.seen is not None
        np.testing.assert_array_equal(own.seen, points[..., 3] >= 0)
        np.testing.assert_allclose(own.columns, points[..., :3], rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize(
    ("content", "name", "says"),
    [
        (c3d_bytes({f"M{k:03}": Z_UP["LASI"] for k in range(20)}), "a.c3d", "20 markers (M000"),
        (c3d_bytes({"LASI": Z_UP["LASI"]}), "a.c3d", "lacks a pelvis"),
        (
            c3d_bytes({n: Z_UP[n] for n in ("LASI", "RASI", "LPSI", "RPSI")}),
            "a.c3d",
            "lacks both legs",
        ),
        (c3d_bytes(Z_UP)[:600], "a.c3d", "ends within its header"),
        (c3d_bytes(Z_UP)[:1500], "a.c3d", "ends before its first frame"),
        (c3d_bytes({k: np.full((3, 3), np.nan) for k in Z_UP}), "a.c3d", "lacks a pelvis"),
        (b"\2\x50\1\2\3", "a.c3d", "ends within its header"),
        ("PathFileType\t4\t(X/Y/Z)\n", "a.trc", "no row"),
        (trc_text({"LASI": MARKERS["LASI"]}), "a.trc", "lacks a pelvis"),
        ("PathFileType\nFrame#\tTime\tLASI\t\t\n", "a.trc", "no frame"),
    ],
)
def test_others_are_refused_in_one_line(
    content: bytes | str, name: str, says: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as refused:
        read(tmp_path, content, name)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_stated_number_of_frames_is_not_believed(tmp_path: Path) -> None:
    data = bytearray(c3d_bytes(Z_UP))
    struct.pack_into("<HH", data, 6, 1, 65535)
    recording = read(tmp_path, bytes(data))
    assert 60 <= len(recording) < 70
    assert any("of 65535 frames" in note for note in recording.notes)


def test_empty_columns_count_as_poses_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("replay.bounds.MOST_POSES", 1000)
    text = "Frame#\tTime" + "\t" * 600 + "LASI\n" + ("1\t2" + "\t" * 600 + "\n") * 20
    with pytest.raises(InputError, match="are too many"):
        read(tmp_path, text, "a.trc")
