"""A recording of one performer as a BVH file: filled, on rigid bones, at even times."""

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
class BvhMade:
    """What became of a recording in a BVH file.

    Attributes:
        frames: in the file.
        step: between two of them [s].
        filled: share of the joints that were not seen and are guesses.
        strays: how far [m] seen joints lie from where they were recorded: median, 99th percentile,
            most. Bones that keep their length cannot follow a sensor whose bones do not.
    """

    frames: int
    step: float
    filled: float
    strays: tuple[float, float, float]


def write_bvh_recording(
    file: TextIO, recording: Recording, *, unit: str = "cm", rate: float | None = None
) -> BvhMade:
    """Write what one performer did.

    What was not seen is filled as in a show (`replay.fill`). Bones get their median length and turn
    to where they were seen (`replay.rigid_bones`). Frames are at even times, by default a median
    step apart; in between, places are interpolated linearly and turns along the shorter arc.

    Args:
        file: open for writing.
        recording: of one performer.
        unit: a key of `UNITS`.
        rate: frames a second of the file.

    Raises:
        InputError: there would be more poses than `replay.bvh.reader` reads.
    """
    fresh = np.flatnonzero(np.diff(recording.times, prepend=-np.inf) > 0)  # one frame a moment
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
        raise InputError(f"{len(even.share)} frames are too many; ask for a lower rate")
    if even is not None:
        quaternions = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat()
        turned = as_matrices(even.rotations(quaternions.reshape(*turned.shape[:2], 4)))
        slides = {joint: even.vectors(way) for joint, way in slides.items()}
        root, step = even.vectors(root), even.step
    per_metre = UNITS[unit]
    write_bvh(file, motion.skeleton, root, turned, slides=slides, step=step, per_metre=per_metre)
    median, most_of_all, most = (float(value) for value in strays)
    return BvhMade(len(root), step, float(missing.mean()), (median, most_of_all, most))
