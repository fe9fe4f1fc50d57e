"""Small sessions for tests: a chain of five nodes, and takes that turn it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from devices.skeleton import Skeleton
from runtime.session.document import Actor, Session, Take
from runtime.session.edits import with_actor, with_take
from runtime.session.performance import Performance

NODES = 5


def chain() -> Skeleton:
    """Five nodes in a row, one unit apart."""
    rest = np.zeros((NODES, 3))
    rest[:, 1] = np.arange(NODES)
    return Skeleton(tuple(f"node {k}" for k in range(NODES)), np.arange(-1, NODES - 1), rest)


def performance(
    angle: float, nodes: tuple[int, ...] = (1, 2), seconds: float = 2.0, frames: int = 21
) -> Performance:
    """Nodes that turn about z, evenly from 0 to `angle` [rad], while the character walks along."""
    times = np.linspace(0.0, seconds, frames).astype(np.float32)
    angles = np.linspace(0.0, angle, frames)
    turns = Rotation.from_rotvec(angles[:, None] * [0.0, 0.0, 1.0]).as_quat()
    every = np.repeat(turns[:, None], len(nodes), axis=1).astype(np.float32)
    shifts = np.zeros((frames, len(nodes), 3), np.float32)
    placements = np.zeros((frames, 5), np.float32)
    placements[:, 1] = angles
    return Performance(times, np.array(nodes), every, shifts, placements)


def take(angle: float, nodes: tuple[int, ...] = (1, 2), **options: float) -> Take:
    """A take of the first actor."""
    return Take(0, f"take of {angle:g}", 1, performance(angle, nodes, **options))  # type: ignore[arg-type]  # one of them is an int


def session(*takes: Take, start: float = 0.0) -> Session:
    """A session of one actor whose takes all start at the same moment."""
    made = with_actor(Session(), Actor(1, "chain", "chain", "relative", NODES))
    for each in takes:
        made = with_take(made, each, start)
    return made
