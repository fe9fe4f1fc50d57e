"""The plan of a body without names: its legs, arms, head and tail by the shape of its skeleton."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import BodyPlan, Limb
from devices.bodies.joint_names import Side
from devices.bodies.limb_segments import arm_segments, leg_segments
from runtime.characters.body_shape import LEAST, UP, BodyShape, Roles
from runtime.characters.creatures.wings import are_wings
from solvers.skeleton.limbs import bones_in_trunk, surface_points
from solvers.skeleton.mirror_pairs import LimbPair, MirroredTree, evenly, mirrored_tree
from solvers.skeleton.mirror_plane import MirrorPlane
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Chain = tuple[int, ...]
Segments = Callable[[Chain, Array], tuple[Chain, ...]]

_ASYMMETRIC = 0.03  # a plane with more asymmetry divides no body,
_WORSE = 0.015  # nor does one with so much more than the best plane
_FEWEST = 4  # nodes
_NECK = 0.35  # of the way from the trunk to the top of the head
_CHEST = 0.6  # of the way from the hips to the top of the head, where there are no arms
_ROOTED = 0.35  # share of a limb beyond which its root never lies
_SAMPLES = 40  # of a limb that is divided


def plan_by_shape(
    vertices: Array, faces: Indices, tree: Tree, planes: list[MirrorPlane]
) -> BodyPlan | None:
    """Return the plan of a body whose joints have no names, or None where the shape is not clear.

    The body must stand upright, +Y up, and be its own mirror image but for its pose. Legs are the
    pair of limbs that reaches the floor; of two such pairs the hind pair, and the front pair are
    arms. Wings and fins are arms too. More pairs on the floor, as of a spider, have no plan.

    Args:
        vertices: (N, 3) [m] surface at rest.
        faces: (F, 3) into `vertices`.
        tree: the skeleton's nodes at rest [m].
        planes: mirror planes of the surface, the best first.
    """
    if len(tree) < _FEWEST or not planes:
        return None
    points = surface_points(vertices, faces)
    size = float(np.ptp(points, axis=0).max())
    inside = bones_in_trunk(vertices, faces, tree.parents, tree.positions)
    best, most = None, 0.0
    for plane in planes:
        if plane.asymmetry > min(_ASYMMETRIC, planes[0].asymmetry + _WORSE):
            continue
        halves = mirrored_tree(tree, plane, size)
        shape = BodyShape(tree, halves, points)
        roles = shape.roles()
        if roles is not None and (worth := _worth(shape, halves, roles)) > most:
            best, most = _Plan(tree, halves, roles, inside, size).plan(), worth
    if best is not None and best.arm_word == "arm" and are_wings(points, tree, best):
        return replace(best, arm_word="wing")
    return best


def _worth(shape: BodyShape, halves: MirroredTree, roles: Roles) -> float:
    """How much of the body the roles explain; more is better."""
    pairs = [pair for pair in (roles.legs, roles.arms) if pair is not None]
    explained = sum(shape.length(pair) * (1.0 - 4.0 * pair.cost) for pair in pairs)
    return explained / shape.size - 10.0 * halves.plane.asymmetry


class _Plan:
    """Makes the chains of a plan from the roles of the limbs."""

    def __init__(
        self,
        tree: Tree,
        halves: MirroredTree,
        roles: Roles,
        inside: NDArray[np.bool_],
        size: float,
    ) -> None:
        self._tree, self._halves, self._roles = tree, halves, roles
        self._inside, self._size = inside, size

    def plan(self) -> BodyPlan:
        arms, legs = self._roles.arms, self._roles.legs
        trunk, head = self._trunk_and_head()
        return BodyPlan(
            trunk=trunk,
            head=head,
            skull=self._nearest(head, _NECK) if head else None,
            arms={} if arms is None else dict(self._limbs(arms, arm_segments)),
            legs={} if legs is None else dict(self._limbs(legs, leg_segments)),
            tail=self._tail(trunk, head),
            arm_word="foreleg" if self._roles.on_four else "arm",
            leg_word="hind leg" if self._roles.on_four else "leg",
        )

    def _trunk_and_head(self) -> tuple[Chain, Chain]:
        tree, roles = self._tree, self._roles
        if roles.legs is not None:
            hips = roles.legs.root
        else:
            hips = min(self._halves.ends, key=lambda node: float(tree.positions[node, 1]))
        trunk: Chain = (hips,)
        if roles.arms is not None:
            trunk = tree.chain(hips, roles.arms.root)
        elif roles.head is not None:
            whole = tree.chain(hips, roles.head)
            trunk = tree.chain(hips, self._nearest(whole, _CHEST))
        head = () if roles.head is None else tree.chain(trunk[-1], roles.head)
        return trunk, head if len(head) > 1 else ()

    def _tail(self, trunk: Chain, head: Chain) -> Chain:
        """The longest branch of the middle line that leads backward from the trunk; or none."""
        tree = self._tree
        longest: Chain = ()
        for end in self._halves.ends:
            chain = tree.chain(trunk[-1], end)
            if end in trunk or not set(chain).isdisjoint(head[1:]):
                continue
            chain = chain[max(place for place, node in enumerate(chain) if node in trunk) :]
            behind = (tree.positions[end] - tree.positions[trunk[0]]) @ self._roles.forward < 0.0
            if behind and tree.length(chain) > max(tree.length(longest), LEAST * self._size):
                longest = chain
        return longest

    def _limbs(self, pair: LimbPair, segments: Segments) -> Iterator[tuple[Side, Limb]]:
        """The limbs of a pair by the body's own sides, divided at the same places."""
        root = float(np.mean([self._root(chain) for chain in pair.chains]))
        outer = [chain[chain.index(self._nearest(chain, root)) :] for chain in pair.chains]
        marks = self._bends(outer, segments)
        left = np.cross(UP, self._roles.forward)
        sides = (Side.LEFT, Side.RIGHT)
        if self._halves.plane.normal @ left < 0.0:
            sides = sides[::-1]
        for side, chain in zip(sides, outer, strict=True):
            cuts = [chain.index(self._nearest(chain, mark)) for mark in marks]
            ends = sorted({0, *cuts, len(chain) - 1})
            yield side, Limb(*(chain[a : b + 1] for a, b in pairwise(ends)))

    def _root(self, chain: Chain) -> float:
        """The share of a limb, from the middle line on, that lies inside the trunk."""
        at, last = self._shares(chain), 0
        while last + 1 < len(chain) and self._inside[chain[last + 1]]:
            last += 1
        # The middle line itself is no root, or both limbs would turn about one point.
        return float(at[1] if last == 0 else min(at[last], max(at[1], _ROOTED)))

    def _bends(self, outer: list[Chain], segments: Segments) -> list[float]:
        """Where a pair of limbs bends, in shares of its length: where the mean of both does."""
        one, other = (evenly(self._tree.positions[list(chain)], _SAMPLES) for chain in outer)
        mean = (one + self._halves.plane.mirrored(other)) / 2.0
        along = self._arc(mean)
        pieces = segments(tuple(range(_SAMPLES)), mean)
        return [float(along[piece[-1]]) for piece in pieces[:-1]]

    def _nearest(self, chain: Chain, share: float) -> int:
        """The node of a chain nearest to a share of its length."""
        return chain[int(np.argmin(np.abs(self._shares(chain) - share)))]

    def _shares(self, chain: Chain) -> Array:
        return self._arc(self._tree.positions[list(chain)])

    @staticmethod
    def _arc(points: Array) -> Array:
        """The arc length from the first of points (n, 3) to each, of the whole."""
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        shares: Array = along / max(float(along[-1]), 1e-12)
        return shares
