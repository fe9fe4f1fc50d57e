"""First frames that do not belong to a recording are replaced, and nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replay.builtin import builtin_recording
from replay.false_start import without_false_start
from replay.recording import Recording


def spoilt(recording: Recording, fault: str, frames: int = 1) -> Recording:
    positions, confidence = recording.positions.copy(), recording.confidence.copy()
    if fault == "unseen":
        positions[:frames], confidence[:frames] = np.nan, 0.0
    elif fault == "zeros":
        positions[:frames] = 0.0
    elif fault == "folded":
        positions[:frames] = positions[:frames, :1] + 0.001
    else:  # a T pose somewhere else
        positions[:frames] = recording.skeleton.rest_positions + np.array([2.0, 0.0, 1.0])
    return replace(recording, positions=positions, confidence=confidence)


FAULTS = ("unseen", "zeros", "folded", "elsewhere")


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("frames", [1, 3])
def test_a_false_start_is_held_at_the_first_true_frame(fault: str, frames: int) -> None:
    clean = builtin_recording("walk")
    mended = without_false_start(spoilt(clean, fault, frames))
    np.testing.assert_array_equal(mended.times, clean.times)
    np.testing.assert_array_equal(mended.positions[frames:], clean.positions[frames:])
    for held in range(frames):
        np.testing.assert_array_equal(mended.positions[held], clean.positions[frames])
        np.testing.assert_array_equal(mended.confidence[held], clean.confidence[frames])


@pytest.mark.parametrize("name", ["walk", "wave", "bow"])
def test_a_clean_recording_is_returned_as_it_is(name: str) -> None:
    recording = builtin_recording(name)
    assert without_false_start(recording) is recording


def test_a_recording_that_goes_on_as_it_begins_is_let_be() -> None:
    recording = builtin_recording("walk")
    noise = np.random.default_rng(0).normal(0.0, 1.0, recording.positions.shape)
    noisy = replace(recording, positions=recording.positions + noise)
    assert without_false_start(noisy) is noisy


def test_each_performer_starts_on_their_own() -> None:
    clean = builtin_recording("walk")
    late = spoilt(clean, "zeros")
    both = replace(
        clean,
        times=np.repeat(clean.times, 2),
        positions=np.stack([clean.positions, late.positions], 1).reshape(
            -1, *late.positions[0].shape
        ),
        rotations=None,
        confidence=np.repeat(clean.confidence, 2, axis=0),
        performers=np.tile([4, 7], len(clean)),
        arrivals=np.repeat(clean.arrivals, 2),
        blends=None,
    )
    mended = without_false_start(both)
    np.testing.assert_array_equal(mended.positions[0], clean.positions[0])
    np.testing.assert_array_equal(mended.positions[1], clean.positions[1])
