"""Divides a limb whose joints have no names at its elbow and wrist, or knee and ankle.

A limb bends where its rest pose does. A straight one is divided where a human limb is. A head is
divided from its neck in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Chain = tuple[int, ...]

# Shares of the length of a straight human limb: elbow and wrist, from shoulder to finger tip; knee
# and ankle, from hip to sole or toe.
_ARM = (0.40, 0.77)
_LEG = (0.46, 0.90)
_NECK = (0.33,)  # from the end of the trunk to the top of the head
_FOOT_TURNS = np.cos(np.radians(50.0))  # least cosine between a shin and straight down
_LONGEST_FOOT = 0.4  # share of the leg
_TRUST = (
    0.02  # in shares: what a joint off its human place costs, beside a joint off a straight line
)

_MOST_PLACES = 48  # at which a bend is tried; a longer chain is sampled, for all pairs are tried


def arm_segments(chain: Sequence[int], positions: Array) -> tuple[Chain, ...]:
    """Divide an arm, wing or foreleg at its elbow and wrist.

    Args:
        chain: nodes from the shoulder to the tip of the hand.
        positions: (K, 3) at rest, of all nodes, in any unit.

    Returns:
        Upper arm, forearm and hand as chains of nodes, each from the node at which the one before
        it ends. A chain of two nodes is an upper arm, of three nodes an upper arm and a forearm.
        Nothing for fewer than two nodes.
    """
    nodes = _apart(chain, positions)
    return _cut(nodes, _best_bends(positions[list(nodes)], _ARM))


def leg_segments(chain: Sequence[int], positions: Array) -> tuple[Chain, ...]:
    """Divide a leg at its knee and ankle.

    A foot begins where the chain turns from down to forward.

    Args:
        chain: nodes from the hip to the sole or the toe.
        positions: (K, 3) at rest, of all nodes, +Y up, in any unit.

    Returns:
        Thigh, shin and foot as chains of nodes, each from the node at which the one before it ends;
        a leg without a foot has two. Nothing for fewer than two nodes.
    """
    nodes = _apart(chain, positions)
    points = positions[list(nodes)]
    ankle = _ankle(points)
    if ankle is None:
        return _cut(nodes, _best_bends(points, _LEG))
    knee = _best_bends(points[: ankle + 1], (_LEG[0] / _LEG[1],))
    return _cut(nodes, (*knee, ankle))


def neck_and_head(chain: Sequence[int], positions: Array) -> tuple[Chain, ...]:
    """Divide a head from its neck.

    Args:
        chain: nodes from the end of the trunk to the top of the head, or to the snout.
        positions: (K, 3) at rest, of all nodes, in any unit.

    Returns:
        The neck and the head as chains of nodes; one part for two nodes, nothing for fewer.
    """
    nodes = _apart(chain, positions)
    return _cut(nodes, _best_bends(positions[list(nodes)], _NECK))


def bend_between(chain: Sequence[int], positions: Array) -> tuple[Chain, ...]:
    """Divide a limb without its hand or foot at its elbow or knee.

    Args:
        chain: nodes from the shoulder to the wrist, or from the hip to the ankle.
        positions: (K, 3) at rest, of all nodes, in any unit.

    Returns:
        The upper and the lower part; one part for two nodes, nothing for fewer.
    """
    nodes = _apart(chain, positions)
    return _cut(nodes, _best_bends(positions[list(nodes)], (0.5,)))


def _apart(chain: Sequence[int], positions: Array) -> Chain:
    """The chain, without an end at which all nodes stand at one place."""
    nodes = tuple(int(node) for node in chain)
    while len(nodes) > 1 and np.allclose(positions[nodes[-1]], positions[nodes[-2]], atol=1e-9):
        nodes = nodes[:-1]
    return nodes


def _cut(nodes: Chain, bends: Sequence[int]) -> tuple[Chain, ...]:
    """The pieces of a chain between its ends and some places on it."""
    marks = [0, *(bend for bend in bends if 0 < bend < len(nodes) - 1), len(nodes) - 1]
    return tuple(nodes[near : far + 1] for near, far in pairwise(marks) if near < far)


def _ankle(points: Array) -> int | None:
    """The place at which the last part of a leg begins to lead away from straight down, or None."""
    bones = np.diff(points, axis=0)
    lengths = np.linalg.norm(bones, axis=1)
    if len(bones) < 2 or not lengths.sum() > 0.0:
        return None
    level = -bones[:, 1] < _FOOT_TURNS * lengths
    ankle = len(bones)
    while ankle > 0 and level[ankle - 1]:
        ankle -= 1
    foot = lengths[ankle:].sum()
    return ankle if 0 < ankle < len(bones) and foot < _LONGEST_FOOT * lengths.sum() else None


def _best_bends(points: Array, shares: tuple[float, ...]) -> tuple[int, ...]:
    """Places on a polyline at which straight lines through them stay nearest to it and to `shares`.

    The cost of a choice is the mean square distance of the polyline from the lines, in shares of
    its length, plus `_TRUST` times the squares of the distances of the places from `shares`.
    """
    count = len(points) - 1
    along = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    wanted = min(len(shares), count - 1)
    if wanted < 1 or not along[-1] > 0.0:
        return ()
    scaled, along = points / along[-1], along / along[-1]
    # A limb need not have a hand or a foot: its last bend may be its end.
    places = range(1, count + 1) if wanted > 1 else range(1, count)
    places = places[:: 1 + len(places) // _MOST_PLACES]

    def cost(bends: tuple[int, ...]) -> float:
        off = sum((along[bend] - share) ** 2 for bend, share in zip(bends, shares, strict=False))
        return float(_off_lines(scaled, along, (0, *bends, count)) + _TRUST * off)

    return min(combinations(places, wanted), key=cost)


def _off_lines(points: Array, along: Array, marks: tuple[int, ...]) -> float:
    """Mean square distance of a polyline's nodes from the lines between some of them."""
    weights = np.gradient(along) if len(along) > 1 else np.ones(1)
    total = 0.0
    for near, far in pairwise(marks):
        line = points[far] - points[near]
        length = float(line @ line)
        inner = points[near + 1 : far] - points[near]
        share = np.clip(inner @ line / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(inner))
        away = inner - share[:, None] * line
        total += float(weights[near + 1 : far] @ np.einsum("ij,ij->i", away, away))
    return total
