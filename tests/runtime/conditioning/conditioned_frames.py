"""Frames that go through a conditioner, clean and spoilt, and measures of what comes out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from devices.skeleton import Skeleton, SkeletonFrame
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.recording import Recording
from runtime.conditioning.conditioner import ConditionedFrame, Conditioner
from runtime.conditioning.switches import (
    Conditioning,
    filled_only,
)
from tests.runtime.stick_figures import BODY

STEP = 1 / 30
HANGING = {"ShoulderLeft": (0.0, 0.0, -0.7), "ShoulderRight": (0.0, 0.0, 0.7)}
ONLY = filled_only


def frame(positions: np.ndarray, time: float) -> SkeletonFrame:
    seen = np.isfinite(positions).all(axis=1)
    return SkeletonFrame(time, positions, None, seen.astype(float))


def conditioned(
    frames: Sequence[SkeletonFrame], switches: Conditioning, skeleton: Skeleton = BODY
) -> list[ConditionedFrame]:
    conditioner = Conditioner(skeleton, switches)
    return [conditioner.condition(each) for each in frames]


def places(frames: Sequence[ConditionedFrame]) -> np.ndarray:
    return np.array([each.positions for each in frames])


def frames_of(recording: Recording, most: int = 400) -> list[SkeletonFrame]:
    return [recording.frame(index) for index in range(min(len(recording), most))]


def show(count: int = 240, every: int = 2) -> list[SkeletonFrame]:
    """What ships, at 30 frames a second."""
    recording = builtin_recording("show")
    return [recording.frame(index) for index in range(0, every * count, every)]


def jumps(positions: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=2).max())


def jitter(positions: np.ndarray) -> float:
    return float(np.sqrt((np.diff(positions, 2, axis=0) ** 2).sum(axis=2).mean()))


def clean(shared: Path) -> Recording:
    return read_recording(shared / "bvh/cmu1_jumping_jacks_animdraw.bvh")


def spoilt(
    recording: Recording, at: slice, spoil: Callable[[np.ndarray], np.ndarray]
) -> list[SkeletonFrame]:
    """As a sensor would see it: joints alone, some frames of them spoilt."""
    frames = frames_of(replace(recording, rotations=None))
    for index in range(*at.indices(len(frames))):
        positions = spoil(frames[index].positions.copy())
        seen = np.isfinite(positions).all(axis=1)
        frames[index] = replace(frames[index], positions=positions, confidence=seen.astype(float))
    return frames


def limb(recording: Recording, *words: str) -> np.ndarray:
    names = recording.skeleton.names
    return np.array([k for k, name in enumerate(names) if all(w in name for w in words)])
