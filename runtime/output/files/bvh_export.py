"""Export of the motion of a character's skeleton as a BVH file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from replay.bvh.writer import LONE_STEP, write_bvh
from replay.even_times import even_times
from replay.rigid_bones import aim_all, as_matrices
from runtime.characters.character import Character
from runtime.output.files.kept_file import millimetres
from runtime.output.files.node_motion import NodeMotion, NodeMotionRecorder
from runtime.output.files.whole_file import check_suffix, check_writable, whole_file
from runtime.output.output import PerformedFrame

Array = NDArray[np.float64]


class BvhExport:
    """Writes the skeleton at rest, and one line of channels per frame, in centimetres.

    Bones keep their rest length, and have the direction of the performance: the rotation of each
    node, plus the smallest turn that aims it at its children. With `within`, a joint that would
    be further off gets channels for its place too, as the root has.

    BVH has one time step for all frames: here the median step of the show. A show with jitter or
    gaps is interpolated at that rate, so it keeps its timing.

    The file is written at the end, in one piece.

    Args:
        path: ends in .bvh.
        character: the performed character.
        within: how far a joint may be from where it was performed, as a share of the character's
            height; None for rigid bones.

    Raises:
        InputError: the suffix is not .bvh, or the file cannot be written.
    """

    pictures_a_second = 0.0

    def __init__(self, path: Path, character: Character, *, within: float | None = None) -> None:
        check_suffix(path, (".bvh",))
        check_writable(path)
        self._path = path
        self._skeleton = character.skeleton
        height = float(np.ptp(character.vertices[:, 1]))
        self._within = math.inf if within is None else within * height
        self._off: float | None = None
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
        slides, self._off = _slides(skeleton, motion.positions, turned, self._within)
        with whole_file(self._path) as path, path.open("w", encoding="utf-8") as file:
            write_bvh(file, skeleton, root, turned, slides=slides, step=step)

    @property
    def error(self) -> str:
        """How far the joints are from where they were performed, in words."""
        return "" if self._off is None else f"joints within {millimetres(self._off)} mm"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _slides(
    skeleton: Skeleton, performed: Array, turned: Array, within: float
) -> tuple[dict[int, Array], float]:
    """The places (T, 3) [m] in the parent of joints that slide, and how far the others are off.

    Args:
        skeleton: the tree at rest.
        performed: (T, K, 3) [m] where the joints were.
        turned: (T, K, 3, 3) the world rotations in the file.
        within: [m] how far a joint may be off without sliding.
    """
    rest, placed, off = skeleton.rest_positions, performed.copy(), 0.0
    slides: dict[int, Array] = {}
    for joint in skeleton.order:
        parent = int(skeleton.parents[joint])
        if parent < 0:
            continue
        bone = np.broadcast_to(rest[joint] - rest[parent], placed[:, joint].shape)
        rigid = placed[:, parent] + np.einsum("tij,tj->ti", turned[:, parent], bone)
        distances = np.linalg.norm(rigid - performed[:, joint], axis=1)
        furthest = float(distances.max(initial=0.0))
        if furthest > within:
            away = performed[:, joint] - placed[:, parent]
            slides[joint] = np.einsum("tji,tj->ti", turned[:, parent], away)
        else:
            placed[:, joint], off = rigid, max(off, furthest)
    return slides, off


def _evenly_timed(motion: NodeMotion) -> tuple[NodeMotion, float]:
    """Return the motion resampled at even times, and its time step [s]."""
    even = even_times(motion.times)
    if even is None:
        return motion, LONE_STEP
    positions, rotations = even.vectors(motion.positions), even.rotations(motion.rotations)
    return NodeMotion(even.vectors(motion.times), positions, rotations), even.step
