"""BVH as other programs write it: glued and foreign minus signs, comments, codes, odd times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.replay.bvh.test_reader import FINGER, body, read, with_root_rotation

PLAIN = FINGER.replace("1 2 3", "1 -2.5 3", 1)


@pytest.mark.parametrize(
    ("before", "after", "note"),
    [
        ("1 -2.5 3", "1.0-2.5 3", "minus signs"),
        ("1 -2.5 3", "1. -2.5 3", ""),
        ("1 -2.5 3", "1 \u22122.5 3", ""),
        ("1 -2.5 3", "1 \u20132.5 3", ""),
        ("1 -2.5 3", "1 -25e-1 3", ""),
        ("50 60", "50 60 # the first frame", ""),
        ("HIERARCHY", "# by a program\n// of ours\nHIERARCHY # really", ""),
        ("MOTION", "MOTION\n# and the motion", ""),
        ("ROOT base", "ROOT base // the base", ""),
        ("OFFSET 0 1 0", "OFFSET 0.0 1 -0.0 # up", ""),
    ],
)
def test_numbers_and_comments(tmp_path: Path, before: str, after: str, note: str) -> None:
    assert before in PLAIN
    plain, found = (read(tmp_path, text) for text in (PLAIN, PLAIN.replace(before, after, 1)))
    np.testing.assert_allclose(found.positions, plain.positions, atol=1e-12)
    assert found.skeleton.names == plain.skeleton.names
    assert not note or any(note in told for told in found.notes)


def test_a_glued_minus_in_an_offset(tmp_path: Path) -> None:
    given, glued = (FINGER.replace("OFFSET 0 1 0", f"OFFSET {o}") for o in ("0.5 -1 0", "0.5-1 0"))
    np.testing.assert_allclose(
        read(tmp_path, glued).positions, read(tmp_path, given).positions, atol=1e-12
    )


def test_a_number_in_a_name_keeps_its_dash(tmp_path: Path) -> None:
    assert (
        "finger2-1" in read(tmp_path, FINGER.replace("ROOT base", "ROOT finger2-1")).skeleton.names
    )


@pytest.mark.parametrize("name", ["左ひじ", "ソード", "表示"])  # with \ and { among their bytes
def test_names_in_shift_jis(tmp_path: Path, name: str) -> None:
    text = FINGER.replace("ROOT base", f"ROOT {name}")
    assert read(tmp_path, text.encode("cp932")).skeleton.names[0] == name


def test_names_in_latin_1(tmp_path: Path) -> None:
    text = FINGER.replace("ROOT base", "ROOT Hüfte")
    assert read(tmp_path, text.encode("latin-1")).skeleton.names[0] == "Hüfte"


@pytest.mark.parametrize(
    ("written", "seconds"),
    [
        ("33.333333", 1 / 30),
        ("16.6667", 1 / 60),
        ("8,33333", 1 / 120),
        ("4.16667", 1 / 240),
        ("41.6667", 1 / 24),
        ("33333", 1 / 30),
        ("120", 1 / 120),
        ("0.5", 0.5),
    ],
)
def test_a_frame_time_that_no_sensor_has(tmp_path: Path, written: str, seconds: float) -> None:
    recording = read(tmp_path, FINGER.replace("Time: 0.02", f"Time: {written}"))
    assert recording.times[1] == pytest.approx(seconds, rel=1e-4)
    assert any("--fps-input" in note for note in recording.notes) == (seconds < 0.4)


@pytest.mark.parametrize("angles", [(90, 0, 0), (-90, 0, 0), (0, 0, 90), (180, 0, 0)])
def test_whoever_lies_or_stands_on_the_hands_stays_so(
    tmp_path: Path, angles: tuple[float, float, float]
) -> None:
    head, motion = body().split("MOTION")
    rows = motion.strip().splitlines()
    for index in (2, 3):
        rest = rows[index].split()[6:]
        rows[index] = " ".join(["0", "20", str(index), *map(str, angles), *rest])
    recording = read(tmp_path, head + "MOTION\n" + "\n".join(rows) + "\n")
    names = recording.skeleton.names
    spine = (
        recording.positions[:, names.index("LeftHand")] * 0.5
        + recording.positions[:, names.index("RightHand")] * 0.5
        - recording.positions[:, names.index("Hips")]
    )
    up = Rotation.from_euler("XYZ", angles, degrees=True).apply([0, 1, 0])[1]
    np.testing.assert_allclose(spine[:, 1] / np.linalg.norm(spine, axis=1), up, atol=1e-6)


def test_whoever_walks_along_another_axis_than_the_zero_pose_is_put_upright(tmp_path: Path) -> None:
    recording = read(tmp_path, with_root_rotation(body(), z_up=True, turned=20.0))
    assert recording.positions[0, recording.skeleton.index("Hips"), 1] > 0.8
    assert any("+Z is up (--up-input" in note for note in recording.notes)
