"""Joints that a tracker only guesses are not performed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from replay.formats import read_recording
from runtime.conditioning.guesses import seen_only
from runtime.conditioning.switches import Conditioning, filled_only, for_recording
from tests.runtime.conditioning.conditioned_frames import STEP, conditioned, frame, frames_of
from tests.runtime.stick_figures import BODY, pose

LEG = [BODY.index(f"{part}Left") for part in ("Knee", "Ankle", "Foot")]
LIFTED = pose({"HipLeft": (-1.5, 0.0, 0.0), "KneeLeft": (1.5, 0.0, 0.0)})


@pytest.mark.parametrize(
    ("sure", "leg", "switches", "is_hidden"),
    [
        (1.0, 0.05, for_recording(), True),
        (1.0, 0.15, for_recording(), False),
        (0.4, 0.05, for_recording(), False),  # this sender's confidences say nothing
        (1.0, 0.05, filled_only(), False),
    ],
)
def test_a_guessed_leg_is_not_performed(
    sure: float, leg: float, switches: Conditioning, is_hidden: bool
) -> None:
    confidence = np.full(len(BODY.names), sure)
    confidence[LEG] = leg
    frames = [replace(frame(LIFTED, i * STEP), confidence=confidence) for i in range(90)]
    out = conditioned(frames, switches)[-1]
    assert out.filled[LEG].all() == is_hidden
    lifted = np.linalg.norm(out.positions - LIFTED, axis=1)
    assert (lifted[LEG[0]] > 0.2) == is_hidden


def test_confidences_of_no_joints_are_no_error() -> None:
    assert seen_only(np.zeros((0, 3)), np.zeros(0)).shape == (0, 3)


@pytest.mark.parametrize(
    "name", ["mediapipe_holistic_full_example.pose", "derived_pose33_world.csv"]
)
def test_who_is_seen_to_the_hips_stands_on_both_legs(shared: Path, name: str) -> None:
    """MediaPipe bends a knee that is not in the picture."""
    recording = read_recording(shared / "mediapipe" / name)
    out = conditioned(frames_of(recording), for_recording(), recording.skeleton)
    ankles = [recording.skeleton.index(f"{side}_ankle") for side in ("left", "right")]
    heights = np.array([each.positions[ankles, 1] for each in out])
    raw = recording.positions[:, ankles, 1]
    assert np.nanmax(np.abs(raw[:, 0] - raw[:, 1])) > 0.15
    assert np.abs(heights[:, 0] - heights[:, 1]).max() < 0.05
