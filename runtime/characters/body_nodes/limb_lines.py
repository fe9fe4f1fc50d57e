"""Lines along the limbs of a body: alike on both sides, and divided at the same places."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.mirror_pairs import evenly
from solvers.skeleton.mirror_plane import MirrorPlane

Array = NDArray[np.float64]
Chain = tuple[int, ...]
Segments = Callable[[Chain, Array], tuple[Chain, ...]]

SAMPLES = 40  # of a limb
_ALIKE = 0.04  # of the size: limbs whose mirror images are nearer are made alike
_BONES = 3  # of each segment
_CORNER = np.cos(np.radians(50.0))  # an arm that turns by more leaves the trunk there,
_EARLY = 0.4  # if this happens before this share of its length
_CUT = (0.12, 0.5)  # shares of an arm between which such a corner is looked for


def arc_shares(points: Array) -> Array:
    """Return for points (n, 3) how far each is along the line through them, of its length."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    shares: Array = along / max(float(along[-1]), 1e-12)
    return shares


def outside_trunk(line: Array) -> Array:
    """Return a line (n, 3) along an arm without its beginning inside the trunk.

    An arm that hangs turns down where the shoulder is: a skeleton leads there across the chest.
    """
    points = evenly(line, SAMPLES)
    best, corner = _CORNER, 0
    for place in range(int(_CUT[0] * SAMPLES), int(_EARLY * SAMPLES)):
        before, beyond = points[place] - points[0], points[-1] - points[place]
        cosine = float(
            before @ beyond / max(np.linalg.norm(before) * np.linalg.norm(beyond), 1e-12)
        )
        if cosine < best:
            best, corner = cosine, place
    return points[corner:] if corner else line


def made_alike(one: Array, other: Array, plane: MirrorPlane, size: float) -> tuple[Array, Array]:
    """Return two lines (`SAMPLES`, 3), each other's mirror images if they nearly are.

    Args:
        one, other: (n, 3), (m, 3) [m] lines along a pair of limbs, from the trunk outward.
        plane: the mirror plane.
        size: [m] of the body.
    """
    one, other = evenly(one, SAMPLES), evenly(other, SAMPLES)
    image = plane.mirrored(other)
    if np.linalg.norm(image - one, axis=1).mean() > _ALIKE * size:
        return one, other
    mean = (one + image) / 2.0
    return mean, plane.mirrored(mean)


def divided(
    one: Array, other: Array, plane: MirrorPlane, segments: Segments
) -> tuple[list[Array], list[Array]]:
    """Divide a pair of lines (`SAMPLES`, 3) at the same places: where the mean of both bends.

    Returns:
        For each line its segments, each (`_BONES` + 1, 3), from the end of the one before.
    """
    mean = (one + plane.mirrored(other)) / 2.0
    shares = arc_shares(mean)
    pieces = segments(tuple(range(len(mean))), mean)
    marks = [0.0, *(float(shares[piece[-1]]) for piece in pieces)]
    return _cut(one, marks), _cut(other, marks)


def _cut(line: Array, marks: list[float]) -> list[Array]:
    shares = arc_shares(line)
    found = []
    for near, far in pairwise(marks):
        at = np.linspace(near, far, _BONES + 1)
        found.append(np.stack([np.interp(at, shares, line[:, k]) for k in range(3)], axis=1))
    return found
