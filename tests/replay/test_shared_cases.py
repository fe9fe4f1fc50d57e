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
