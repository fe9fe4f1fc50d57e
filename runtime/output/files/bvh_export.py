"""Export of the motion of a character's skeleton as a BVH file."""

from __future__ import annotations

from pathlib import Path
from typing import Self

import numpy as np

from replay.bvh.writer import LONE_STEP, write_bvh
from replay.even_times import even_times
from replay.rigid_bones import aim_all, as_matrices
from runtime.characters.character import Character
from runtime.output.files.node_motion import NodeMotion, NodeMotionRecorder
from runtime.output.files.whole_file import check_suffix, check_writable, whole_file
from runtime.output.output import PerformedFrame


class BvhExport:
    """Writes the skeleton at rest, and one line of channels per frame, in centimetres.

    Bones keep their rest length. Each bone has the direction of the performance: the rotation of
    its node, plus the smallest turn that aims it at its children.

    BVH has one time step for all frames: here the median step of the show. A show with jitter or
    gaps is interpolated at that rate, so it keeps its timing.

    The file is written at the end, in one piece.

    Args:
        path: ends in .bvh.
        character: the performed character.

    Raises:
        InputError: the suffix is not .bvh, or the file cannot be written.
    """

    pictures_a_second = 0.0

    def __init__(self, path: Path, character: Character) -> None:
        check_suffix(path, (".bvh",))
        check_writable(path)
        self._path = path
        self._skeleton = character.skeleton
        self._motion = NodeMotionRecorder(len(character.skeleton.names))
        self._closed = False

    def write(self, frame: PerformedFrame) -> None:
        """Store one frame."""
        self._motion.add(frame)

    def close(self) -> None:
        """Write the file; a show without frames gives a file without frames.

        Raises:
            InputError: the disk fails.
        """
        if self._closed:
            return
        self._closed = True
        motion, step = _evenly_timed(self._motion.motion())
        skeleton = self._skeleton
        parents = np.where(skeleton.parents < 0, skeleton.root, skeleton.parents)
        turned = aim_all(
            skeleton,
            skeleton.rest_positions - skeleton.rest_positions[parents],
            motion.positions - motion.positions[:, parents],
            as_matrices(motion.rotations),
        )
        root = motion.positions[:, skeleton.root]
        with whole_file(self._path) as path, path.open("w", encoding="utf-8") as file:
            write_bvh(file, skeleton, root, turned, step=step)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _evenly_timed(motion: NodeMotion) -> tuple[NodeMotion, float]:
    """Return the motion resampled at even times, and its time step [s]."""
    even = even_times(motion.times)
    if even is None:
        return motion, LONE_STEP
    positions, rotations = even.vectors(motion.positions), even.rotations(motion.rotations)
    return NodeMotion(even.vectors(motion.times), positions, rotations), even.step
