"""Small sessions for tests: a chain of five nodes, and takes that turn it."""

from __future__ import annotations

import random

import numpy as np
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.session import edits
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


def random_edit(made: Session, dice: random.Random) -> Session:
    """Some edit of some clip; a new take where there is none."""
    if not made.clips or dice.random() < 0.1:
        return edits.with_take(made, take(dice.uniform(-1.0, 1.0)), dice.uniform(0.0, 9.0))
    clip = dice.choice(made.clips)
    try:
        return dice.choice(
            [
                lambda: edits.moved(made, clip.id, dice.uniform(-1.0, 9.0)),
                lambda: edits.trimmed(made, clip.id, dice.uniform(0, 9), dice.uniform(0, 9)),
                lambda: edits.split(made, clip.id, dice.uniform(clip.start, clip.end)),
                lambda: edits.paced(made, clip.id, dice.uniform(0.1, 10.0)),
                lambda: edits.looped(made, clip.id, dice.uniform(0.1, 10.0)),
                lambda: edits.weighted(made, clip.id, dice.random()),
                lambda: edits.muted(made, clip.id, not clip.muted),
                lambda: edits.made_additive(made, clip.id, not clip.additive),
                lambda: edits.copied(made, clip.id, dice.uniform(0.0, 9.0)),
                lambda: edits.raised(made, clip.id, dice.randint(-3, 3)),
                lambda: edits.without_clip(made, clip.id),
                lambda: edits.marked(made, dice.uniform(0.0, 9.0), "here"),
            ]
        )()
    except InputError:
        return made
