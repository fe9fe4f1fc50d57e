"""The motion of the character's skeleton as a BVH file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.skeleton import Skeleton
from runtime.character import Character
from runtime.output.node_motion import NodeMotion, NodeMotionRecorder
from runtime.output.output import PerformedFrame
from runtime.output.whole_file import check_suffix, check_writable, whole_file

_PER_METRE = 100.0  # BVH names no unit; the programs that read it mostly take it as centimetres
_LENGTHEN = 16  # a gappy recording may become so many times as many frames, at most
_TIP = 0.25  # an end site's offset, as a part of the bone before it


class BvhExport:
    """Writes the skeleton at rest, and one line of channels for every frame.

    In centimetres, +Y up. The root has six channels, position and then rotation in the order
    Z, X, Y; all other joints have the three rotations, as every program reads them. So bones keep
    their rest length, and turn such that each points where the performance has it: the nodes'
    own rotations, and as little on top of them as the directions to the children ask for.

    BVH has one time step for all frames. It is the median step of the show; a show with jitter or
    gaps is interpolated at that rate, so that it keeps its timing.

    Everything is written at the end, in one piece.

    Args:
        path: ends in .bvh.
        character: who performs.

    Raises:
        InputError: another suffix, or the file cannot be written.
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
        """Keep one frame."""
        self._motion.add(frame)

    def close(self) -> None:
        """Write the file; without frames it has none.

        Raises:
            InputError: the disk fails.
        """
        if self._closed:
            return
        self._closed = True
        motion, step = _evenly_timed(self._motion.motion())
        channels = _channels(self._skeleton, motion)
        with whole_file(self._path) as path, path.open("w", encoding="utf-8") as file:
            file.write(f"{_hierarchy(self._skeleton)}\n")
            file.write(f"MOTION\nFrames: {len(channels)}\nFrame Time: {step:.9f}\n")
            np.savetxt(file, channels, fmt="%.6f")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _evenly_timed(motion: NodeMotion) -> tuple[NodeMotion, float]:
    """The motion at even times, and the time between two of its frames [s]."""
    times = motion.times
    if len(times) < 2:
        return motion, 1 / 30
    span = float(times[-1])
    step = max(float(np.median(np.diff(times))), span / (_LENGTHEN * len(times)))
    count = max(round(span / step), 1)
    even = np.linspace(0.0, span, count + 1)
    after = np.clip(np.searchsorted(times, even), 1, len(times) - 1)
    share = (even - times[after - 1]) / (times[after] - times[after - 1])
    weight = share[:, None, None]

    def between(values: NDArray[np.float64]) -> NDArray[np.float64]:
        blended: NDArray[np.float64] = (1 - weight) * values[after - 1] + weight * values[after]
        return blended

    rotations = between(motion.rotations)
    rotations /= np.maximum(np.linalg.norm(rotations, axis=-1, keepdims=True), 1e-12)
    return NodeMotion(even, between(motion.positions), rotations), span / count


def _channels(skeleton: Skeleton, motion: NodeMotion) -> NDArray[np.float64]:
    """All channels (T, 3 + 3 K) in the order of the hierarchy: centimetres, degrees."""
    aimed = [_aimed(skeleton, motion, joint) for joint in range(len(skeleton.names))]
    columns = [_PER_METRE * motion.positions[:, skeleton.root]]
    for joint in _depth_first(skeleton):
        parent = int(skeleton.parents[joint])
        local = aimed[joint] if parent < 0 else np.swapaxes(aimed[parent], 1, 2) @ aimed[joint]
        columns.append(_euler_zxy(local))
    return np.concatenate(columns, axis=1)


def _aimed(skeleton: Skeleton, motion: NodeMotion, joint: int) -> NDArray[np.float64]:
    """World rotations (T, 3, 3) of a joint, nearest to its own, that aim at its children.

    The rotation that takes the bones at rest to the performed ones with the least squares (Kabsch
    1976); the identity that is added weakly decides what they leave open: the twist.
    """
    own: NDArray[np.float64] = Rotation.from_quat(motion.rotations[:, joint]).as_matrix()
    children = np.flatnonzero(skeleton.parents == joint)
    rest = skeleton.rest_positions[children] - skeleton.rest_positions[joint]  # (C, 3)
    size = float(np.sum(rest**2))
    if size == 0.0:
        return own
    turned = np.einsum("tij,cj->tci", own, rest)
    seen = motion.positions[:, children] - motion.positions[:, [joint]]
    covariance = np.einsum("tci,tcj->tij", seen, turned) + 1e-6 * size * np.eye(3)
    u, _, vt = np.linalg.svd(covariance)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]  # no reflections
    aimed: NDArray[np.float64] = u @ vt @ own
    return aimed


def _euler_zxy(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles (T, 3) [degrees] z, x, y with R = Rz Rx Ry, without jumps from frame to frame."""
    sine = np.clip(matrices[:, 2, 1], -1, 1)
    locked = np.abs(sine) > 1 - 1e-12  # z and y turn about one axis: all of it goes to z
    z = np.where(
        locked,
        np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0]),
        np.arctan2(-matrices[:, 0, 1], matrices[:, 1, 1]),
    )
    y = np.where(locked, 0.0, np.arctan2(-matrices[:, 2, 0], matrices[:, 2, 2]))
    angles = np.stack([z, np.arcsin(sine), y], axis=1)
    unwrapped: NDArray[np.float64] = np.degrees(np.unwrap(angles, axis=0))
    return unwrapped


def _depth_first(skeleton: Skeleton) -> list[int]:
    """Joints in the order in which the hierarchy names them."""
    order, waiting = [], [skeleton.root]
    while waiting:
        order.append(joint := waiting.pop())
        waiting.extend(np.flatnonzero(skeleton.parents == joint)[::-1].tolist())
    return order


def _plain_names(skeleton: Skeleton) -> list[str]:
    """Names without blanks or braces, which end a name in BVH, still unique."""
    names: list[str] = []
    for joint, name in enumerate(skeleton.names):
        plain = re.sub(r"[\s{}]+", "_", name.strip()) or "joint"
        while plain in names:
            plain += f"_{joint}"
        names.append(plain)
    return names


def _hierarchy(skeleton: Skeleton) -> str:
    """The text of all joints; the root's offset is 0, since its position channels are absolute."""
    names, rest = _plain_names(skeleton), skeleton.rest_positions
    lines = ["HIERARCHY"]
    waiting: list[tuple[int, int]] = [(skeleton.root, 0)]  # joints, or -1 for a closing brace
    while waiting:
        joint, depth = waiting.pop()
        tab = "\t" * depth
        if joint < 0:
            lines.append(f"{tab}}}")
            continue
        parent = int(skeleton.parents[joint])
        children = np.flatnonzero(skeleton.parents == joint).tolist()
        offset = rest[joint] - rest[parent] if parent >= 0 else np.zeros(3)
        turns = "Zrotation Xrotation Yrotation"
        lines += [
            f"{tab}{'ROOT' if parent < 0 else 'JOINT'} {names[joint]}",
            f"{tab}{{",
            f"{tab}\tOFFSET {_centimetres(offset)}",
            f"{tab}\tCHANNELS "
            + (f"6 Xposition Yposition Zposition {turns}" if parent < 0 else f"3 {turns}"),
        ]
        if not children:
            tip = f"OFFSET {_centimetres(_TIP * offset)}"
            lines += [f"{tab}\tEnd Site", f"{tab}\t{{", f"{tab}\t\t{tip}", f"{tab}\t}}"]
        waiting.append((-1, depth))
        waiting.extend((child, depth + 1) for child in reversed(children))
    return "\n".join(lines)


def _centimetres(metres: NDArray[np.float64]) -> str:
    return " ".join(f"{_PER_METRE * value:.6f}" for value in metres)
