"""Random animated parts for tests, and how to compare them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from solvers.editing.bending import bent
from solvers.editing.clips_on_chains import LaidClip, with_clip
from solvers.editing.motion import Clip, Motion, Quaternion
from solvers.editing.part import Part, part_of
from solvers.editing.part_pose import pose_at

Array = NDArray[np.float64]
TIMES = (-1.0, 0.0, 0.31, 0.777, 1.2, 2.5, 9.0)


def some_quaternion(random: np.random.Generator) -> Quaternion:
    x, y, z, w = Rotation.random(rng=random).as_quat().tolist()
    return x, y, z, w


def some_motion(random: np.random.Generator) -> Motion:
    """A few frames of a few bones, that turn by up to a radian each from frame to frame."""
    frames, knots = int(random.integers(1, 5)), int(random.integers(2, 6))
    times = np.concatenate([[0.0], np.cumsum(random.uniform(0.1, 1.0, frames - 1))])
    at = np.concatenate([[0.0], np.cumsum(random.uniform(0.1, 1.0, knots - 1))])
    steps = random.normal(scale=0.4, size=(frames, knots, 3))
    turns = Rotation.from_rotvec(np.cumsum(steps, axis=0).reshape(-1, 3)).as_quat()
    return Motion(times, at / at[-1], turns.reshape(frames, knots, 4))


def some_clip(random: np.random.Generator, motion: Motion) -> Clip:
    return Clip(
        motion,
        some_quaternion(random) if random.random() < 0.5 else (0.0, 0.0, 0.0, 1.0),
        start=float(random.uniform(-0.5, 0.5)),
        speed=float(random.uniform(0.3, 2.0)),
        passes=float(random.choice([0.7, 1.0, 3.0, np.inf])),
        weight=float(random.choice([1.0, 1.0, 0.4])),
    )


def some_part(random: np.random.Generator, nodes: int = 8, clips: int = 3) -> Part:
    """A random tree, bent here and there, with random clips on random chains."""
    parents = np.array([-1, *(int(random.integers(0, node)) for node in range(1, nodes))])
    part = part_of(random.normal(size=(nodes, 3)), parents)
    motions = [some_motion(random) for _ in range(2)]
    for _ in range(clips):
        way = part.path(int(random.integers(1, nodes)))
        begin = int(random.integers(0, len(way) - 1))
        first, last = random.uniform(0.0, 1.0, 2) if random.random() < 0.5 else (0.0, 1.0)
        clip = some_clip(random, motions[int(random.integers(2))])
        chain = [node.id for node in way[begin:]]
        part = with_clip(part, chain, LaidClip(clip, float(first), float(last)))
    for _ in range(2):
        part = bent(part, int(random.integers(0, nodes)), some_quaternion(random), 0.4)
    return part


def some_bone(random: np.random.Generator, part: Part) -> int:
    """The id of a node at which a bone ends."""
    return part.nodes[int(random.integers(1, len(part)))].id


def angle(p: Array, q: Array) -> float:
    """Between two rotations [rad], also where it is tiny."""
    apart = min(np.linalg.norm(p - q), np.linalg.norm(p + q))
    return float(4.0 * np.arcsin(min(apart / 2.0, 1.0)))


def apart(one: Part, other: Part, time: float) -> tuple[float, float]:
    """The greatest angle [rad] and distance between the nodes that two parts share."""
    first, second = pose_at(one, time), pose_at(other, time)
    both = sorted(set(one.index) & set(other.index))
    angles = [angle(first.rotation(node), second.rotation(node)) for node in both]
    gaps = [np.linalg.norm(first.position(node) - second.position(node)) for node in both]
    return max(angles), float(max(gaps))
