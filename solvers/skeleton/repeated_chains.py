"""Finds the chains of a skeleton that repeat: a squid's arms, a spider's legs, left and right."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from solvers.skeleton.part_chains import Chain
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

# How far chains that repeat may differ, measured on squid, cactus, octopus, armadillo, spider and
# bodies: real arms differ by up to a fifth in length, and legs from arms by a third.
_LENGTH: Final = 0.3  # of the longer one's length
_PLACE: Final = 0.3  # of its length, of each point's distance from the middle of the body
_SHAPE: Final = 0.35  # of its length, of the distances between its points
_STAR, _LOOSE = 5, 2.0  # so many from one fork are the arms of a star, and may differ so much more
_GIRTH: Final = 0.45  # of the thicker one's radius
_NEVER: Final = 1e3
_POINTS: Final = 5  # along each chain
_IN_LINE: Final = 0.1  # of the spread along a row, across it: such chains stand in a row


def repeated_chains(
    tree: Tree,
    root: int,
    chains: Sequence[Chain],
    radii: ArrayLike | None = None,
    *,
    pairs: Sequence[tuple[int, int]] = (),
    single: Sequence[int] = (),
) -> list[tuple[int, ...]]:
    """Return the groups of chains that repeat, each in the order in which they stand.

    Chains repeat where a turn or a mirror about the root could take one to the other: their lengths
    agree, the distances between points along them (which tell how they bend), the distances of
    these points from the root, the number of chains that branch off, and their radii. Every two of
    a group agree. Groups in a ring begin with the first chain and go round anticlockwise, seen from
    the side that looks most to the front, the top or the left; groups in a row go along it.

    Args:
        tree: K nodes at rest.
        root: the middle of the body.
        chains: nodes of each, away from the root.
        radii: (C,) how thick the surface is around each chain; None if there is no surface.
        pairs: chains that are known to repeat, as the arms of a body.
        single: chains that are known not to, as its tail.

    Returns:
        Groups of two chains or more, by their numbers.
    """
    count = len(chains)
    if count < 2:
        return []
    points = np.array([_along(tree.positions[list(chain)]) for chain in chains])  # (C, P, 3)
    unlike = _unlikeness(tree, root, chains, points)
    if radii is not None:
        girth = np.asarray(radii, dtype=np.float64)
        thick = np.maximum(np.maximum(girth[:, None], girth), 1e-300)
        unlike = np.maximum(unlike, np.abs(girth[:, None] - girth) / (_GIRTH * thick))
    unlike[list(single)] = unlike[:, list(single)] = _NEVER
    for one, other in pairs:
        unlike[one, other] = unlike[other, one] = 0.0
    np.fill_diagonal(unlike, 0.0)
    # Complete linkage: every two chains of a group agree, so a row of ever longer legs is no group.
    labels = fcluster(linkage(squareform(unlike, checks=False), "complete"), 1.0, "distance")
    groups = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    ordered = [_in_order(group, points[group, _POINTS // 2 :].mean(axis=1)) for group in groups]
    return sorted(group for group in ordered if len(group) > 1)


def _unlikeness(tree: Tree, root: int, chains: Sequence[Chain], points: Array) -> Array:
    """How far every two chains differ (C, C): above 1 they do not repeat."""
    lengths = np.array([max(tree.length(chain), 1e-300) for chain in chains])
    longer = np.maximum(lengths[:, None], lengths)
    unlike = np.abs(lengths[:, None] - lengths) / (_LENGTH * longer)
    away = np.linalg.norm(points - tree.positions[root], axis=2)  # (C, P)
    apart = np.linalg.norm(points[:, :, None] - points[:, None], axis=3).reshape(len(chains), -1)
    for signs, most in ((away, _PLACE), (apart, _SHAPE)):
        differ = np.abs(signs[:, None] - signs).max(axis=2)
        unlike = np.maximum(unlike, differ / (most * longer))
    starts = np.array([chain[0] for chain in chains])
    in_star = (starts[:, None] == starts).sum(axis=1) >= _STAR
    unlike[(starts[:, None] == starts) & in_star] /= _LOOSE
    branches = np.array([_branches(tree, chain) for chain in chains])
    more = np.maximum(branches[:, None], branches)
    differ = np.abs(branches[:, None] - branches) / (1.0 + 0.5 * more)
    return np.asarray(np.maximum(unlike, differ))


def _along(polyline: Array) -> Array:
    """Points (P, 3) evenly along a polyline (n, 3), its ends included."""
    steps = np.linalg.norm(np.diff(polyline, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0.0, way[-1], _POINTS)
    return np.column_stack([np.interp(wanted, way, polyline[:, axis]) for axis in range(3)])


def _branches(tree: Tree, chain: Chain) -> int:
    """How many chains branch off a chain beyond its first node."""
    inner = sum(int(tree.degree[node]) - 2 for node in chain[1:-1])
    return inner + max(int(tree.degree[chain[-1]]) - 1, 0)


def _in_order(group: NDArray[np.int64], places: Array) -> tuple[int, ...]:
    """A group's chains, whose outer halves are at `places` (G, 3), in the order they stand in."""
    offsets = places - places.mean(axis=0)
    spread, axes = np.linalg.eigh(offsets.T @ offsets)
    if len(group) < 3 or spread[1] < _IN_LINE**2 * spread[2]:
        row = axes[:, 2] * (-1.0 if axes[np.argmax(np.abs(axes[:, 2])), 2] > 0.0 else 1.0)
        order = np.argsort(offsets @ row, kind="stable")  # from the left (+X) on, from the top
        return tuple(int(chain) for chain in group[order])
    normal = axes[:, 0] * (1.0 if axes[np.argmax(np.abs(axes[:, 0])), 0] > 0.0 else -1.0)
    across = axes[:, 2]
    angles = np.arctan2(offsets @ np.cross(normal, across), offsets @ across)
    turned = np.mod(angles - angles[0] + 1e-9, 2.0 * np.pi)
    return tuple(int(chain) for chain in group[np.argsort(turned, kind="stable")])
