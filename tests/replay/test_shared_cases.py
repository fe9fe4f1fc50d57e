"""Recordings after public bug reports, from the shared cases: what `expect.txt` says is right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.formats import read_recording
from replay.recording import Recording


@pytest.fixture
def cases(shared: Path) -> Path:
    return shared.parent / "cases"


def height(recording: Recording, name: str) -> np.ndarray:
    return recording.positions[:, recording.skeleton.index(name), 1]


def noted(recording: Recording, text: str) -> bool:
    return any(text in note for note in recording.notes)


def test_01_a_minus_sign_inside_a_number_begins_the_next(cases: Path) -> None:
    recording = read_recording(cases / "01-bvh-glued-minus" / "slime.bvh")
    assert len(recording) == 24
    assert height(recording, "Head")[0] == pytest.approx(1.48, abs=0.05)
    assert noted(recording, "minus signs")


def test_04_the_unit_is_told_from_the_posed_body(cases: Path) -> None:
    recording = read_recording(cases / "04-bvh-zero-offsets" / "zero.bvh")
    assert height(recording, "Head")[0] == pytest.approx(1.48, abs=0.05)
    assert noted(recording, "centimetres, 1.61 m tall")


@pytest.mark.parametrize("name", ["crawl", "lies_on_side"])
def test_05_a_body_that_lies_stays_level(name: str, cases: Path) -> None:
    recording = read_recording(cases / "05-bvh-lies-down" / f"{name}.bvh")
    above = height(recording, "Head") - height(recording, "Hips")
    assert (np.abs(above) < 0.3).all()
    assert noted(recording, "--up-input")


def test_06_a_handstand_stays_upside_down(cases: Path) -> None:
    recording = read_recording(cases / "06-bvh-handstand" / "handstand.bvh")
    for side in ("Left", "Right"):
        assert (height(recording, f"{side}Foot") > height(recording, "Hips") + 0.5).all()
    assert (height(recording, "Head") < height(recording, "Hips") - 0.3).all()


@pytest.mark.parametrize(("name", "rate"), [("ms8", 120), ("ms33", 30)])
def test_07_a_frame_time_in_milliseconds(name: str, rate: int, cases: Path) -> None:
    recording = read_recording(cases / "07-bvh-frame-time-ms" / f"{name}.bvh")
    np.testing.assert_allclose(recording.times, np.arange(24) / rate, rtol=1e-4)
    assert noted(recording, "--fps-input")


def nose_over_ankles(recording: Recording) -> np.ndarray:
    ankles = 0.5 * (height(recording, "left_ankle") + height(recording, "right_ankle"))
    return height(recording, "nose") - ankles


def across(recording: Recording, name: str) -> np.ndarray:
    joints = [recording.skeleton.index(f"{side}_{name}") for side in ("left", "right")]
    return recording.positions[:, joints[0], 0] - recording.positions[:, joints[1], 0]


@pytest.mark.parametrize(
    ("name", "frames", "seconds"),
    [
        ("09-mp-columns-from-one/coords.csv", 24, 23 / 30),
        ("12-mp-timestamp-ms/epoch.json", 12, 0.367),
        ("12-mp-timestamp-ms/tasks.json", 12, 0.367),
        ("14-mp-portrait/image_size.json", 8, 0.231),
        ("14-mp-portrait/wh.json", 8, 7 / 30),
        ("17-mp-bare-lists/by_frame.json", 6, 5 / 30),
        ("17-mp-bare-lists/lists.json", 6, 5 / 30),
        ("18-mp-tfjs-blazepose/tfjs.json", 4, 3 / 30),
        ("20-mp-indented-metadata/indent.json", 4, 3 / 30),
    ],
)
def test_09_to_20_landmarks_stand_at_their_size(
    name: str, frames: int, seconds: float, cases: Path
) -> None:
    recording = read_recording(cases / name)
    assert len(recording) == frames
    assert recording.seconds == pytest.approx(seconds, abs=2e-3)
    np.testing.assert_allclose(nose_over_ankles(recording)[0], 1.5, atol=0.12)
    assert across(recording, "shoulder")[0] > 0.3
    assert across(recording, "hip")[0] > 0.1


def test_09_columns_from_one_begin_with_the_nose(cases: Path) -> None:
    recording = read_recording(cases / "09-mp-columns-from-one" / "coords.csv")
    assert noted(recording, "counted from 1")
    assert height(recording, "nose")[0] > height(recording, "left_shoulder")[0] > 0.3


def test_18_keypoints_3d_are_in_metres(cases: Path) -> None:
    recording = read_recording(cases / "18-mp-tfjs-blazepose" / "tfjs.json")
    nose = recording.positions[2, recording.skeleton.index("nose")]
    assert nose[2] == pytest.approx(0.10996, abs=1e-6)


def test_24_azures_offline_processor(cases: Path) -> None:
    recording = read_recording(cases / "24-kinect-azure-offline-json" / "azure.json")
    assert recording.positions.shape == (6, 32, 3)
    np.testing.assert_allclose(recording.times, np.arange(6) / 30, atol=2e-6)
    assert height(recording, "Nose")[0] - height(recording, "FootRight")[0] == pytest.approx(
        1.62, abs=0.05
    )
    assert set(recording.performers) == {0}
