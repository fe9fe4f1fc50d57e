"""Convert a recording of one performer to BVH: fill gaps, fit rigid bones, resample evenly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TextIO

import numpy as np
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from replay.bvh.text import MOST_POSES
from replay.bvh.writer import LONE_STEP, UNITS, write_bvh
from replay.even_times import even_times
from replay.fill import Filler
from replay.recording import Recording
from replay.rigid_bones import as_matrices, fit_rigid_bones


@dataclass(frozen=True, slots=True)
class BvhSummary:
    """The frames of a written BVH file, and how well they follow the recording.

    Attributes:
        frames: number of frames in the file.
        step: between two frames [s].
        filled: share of joint positions that were not seen and are guesses.
        strays: distance [m] of seen joints from their recorded positions: median, 99th percentile,
            maximum. Bones of constant length cannot follow a sensor whose bones vary.
    """

    frames: int
    step: float
    filled: float
    strays: tuple[float, float, float]


def write_bvh_recording(
    file: TextIO, recording: Recording, *, unit: str = "cm", rate: float | None = None
) -> BvhSummary:
    """Write the motion of one performer.

    Joints that were not seen are filled as in a show (`replay.fill`). Bones get their median length
    and turn to the seen positions (`replay.rigid_bones`). Frames are evenly spaced, by default a
    median step apart; positions are interpolated linearly, rotations along the shorter arc.

    Args:
        file: open for writing.
        recording: of one performer.
        unit: a key of `UNITS`.
        rate: frames per second of the file.

    Raises:
        InputError: the file would have more poses than `replay.bvh.reader` reads.
    """
    fresh = np.flatnonzero(np.diff(recording.times, prepend=-np.inf) > 0)  # one frame per time
    filler = Filler(recording.skeleton)
    filled = [filler.fill(recording.frame(int(index))) for index in fresh]
    positions = np.stack([frame.positions for frame in filled])
    missing = np.stack([frame.filled for frame in filled])
    rotations = None if recording.rotations is None else recording.rotations[fresh]
    motion = fit_rigid_bones(recording.skeleton, positions, rotations)
    off = np.linalg.norm(motion.positions() - positions, axis=2)[~missing]
    strays = np.percentile(off, (50, 99, 100)) if off.size else np.zeros(3)
    root, turned, slides, step = motion.root, motion.rotations, motion.slides, LONE_STEP
    even = even_times(recording.times[fresh], rate)
    if even is not None and len(even.share) * len(recording.skeleton.names) > MOST_POSES:
        raise InputError(f"{len(even.share)} frames are too many; give a lower rate")
    if even is not None:
        quaternions = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat()
        turned = as_matrices(even.rotations(quaternions.reshape(*turned.shape[:2], 4)))
        slides = {joint: even.vectors(way) for joint, way in slides.items()}
        root, step = even.vectors(root), even.step
    per_metre = UNITS[unit]
    write_bvh(file, motion.skeleton, root, turned, slides=slides, step=step, per_metre=per_metre)
    median, most_of_all, most = (float(value) for value in strays)
    return BvhSummary(len(root), step, float(missing.mean()), (median, most_of_all, most))
