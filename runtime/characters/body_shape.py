"""What the shape of a body shows: which limbs are legs, which are arms, and where the front is.

The rules were found on figures, animals, toys and things from free collections of meshes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.limbs import closest_bones
from solvers.skeleton.mirror_pairs import LimbPair, MirroredTree
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Chain = tuple[int, ...]

UP = np.array([0.0, 1.0, 0.0])

LEAST = 0.08
"""Of the body's size: a shorter arm or tail is none."""

_STANDS = 0.15  # of the height: a leg ends below
_TOUCHES = 0.05  # of the height: or the surface of its outer half does
_LIKE = 0.6  # of the longest leg: a limb as long is another leg
_OVER = 0.25  # of the size: so far from its legs the middle of a body may be
_ASIDE = 0.03  # of the size: no tail that stands on the floor ends farther from the middle
_FALLS = 0.25  # of its length: so much a lifted leg leads down
_LEAP = 0.15  # of the size: the least trunk between two pairs of legs that leap
_NEAR = 0.25  # of the size, added to the distance of arms from legs: long arms may be far
_ARMED = 0.2  # of the size: the least arms of a body without legs
_CLEAR = 0.08  # the greatest cost of theirs

# What points forward.
_TOES = 4.0  # weight of feet ahead of shins
_HANDS = 0.3  # weight of hands ahead of shoulders
_SOLE, _SHIN = 0.06, (0.08, 0.2)  # of the height
_DOUBT = 0.05

# What makes the end of a trunk a head.
_RISE = 0.25  # the greatest count of its height
_THICK = 2.0  # weight of its radius
_EARS = (2.0, 0.3)  # weight of the pairs of limbs there, and their greatest count


@dataclass(frozen=True, slots=True, eq=False)
class Roles:
    """Which pair of limbs is which.

    Attributes:
        legs, arms: pairs of limbs; of four legs the front pair are arms. None for no such pair.
        forward: (3,) unit, horizontal, in the mirror plane.
        head: the node at the end of the head; None for none.
        on_four: whether the arms are forelegs.
    """

    legs: LimbPair | None
    arms: LimbPair | None
    forward: Array
    head: int | None
    on_four: bool = False


class BodyShape:
    """A body that stands upright, divided by a mirror plane.

    Args:
        tree: the skeleton's nodes at rest [m].
        halves: the tree as the mirror plane divides it.
        points: (n, 3) [m] spread evenly over the surface.
    """

    def __init__(self, tree: Tree, halves: MirroredTree, points: Array) -> None:
        self.size = float(np.ptp(points, axis=0).max())
        self._tree, self._halves, self._points = tree, halves, points
        self._floor, self._height = float(points[:, 1].min()), float(np.ptp(points[:, 1]))
        self._nearest, self._distance = closest_bones(points, tree.parents, tree.positions)
        self._along = np.cross(halves.plane.normal, UP)

    def roles(self) -> Roles | None:
        """The roles of the pairs of limbs, or None where they are not clear."""
        if not self._halves.middle:
            return None
        standing = self.standing()
        if not standing:
            return self._on_one_foot() or self._leaping()
        longest = self.length(standing[0])
        legs = [pair for pair in standing if self.length(pair) >= _LIKE * longest]
        if len(legs) > 2 or not self._balanced(legs) or self._has_lonely_leg(longest):
            return None
        return self._on_four(legs[0], legs[1]) if len(legs) == 2 else self._on_two(legs[0])

    def standing(self) -> list[LimbPair]:
        """The pairs of limbs that reach the floor, the longest first."""
        return [pair for pair in self._halves.pairs if self._stands(pair)]

    def length(self, pair: LimbPair) -> float:
        """The mean length [m] of the limbs of a pair, from the middle line."""
        return sum(self._tree.length(chain) for chain in pair.chains) / 2.0

    # How a body stands.

    def _on_four(self, one: LimbPair, other: LimbPair) -> Roles | None:
        """Four legs: the head's end is the front."""
        best: tuple[float, Roles] | None = None
        for front, hind in ((one, other), (other, one)):
            ahead = self._middle_of(front) - self._middle_of(hind)
            forward = self._along * np.sign(ahead @ self._along or 1.0)
            necks = self._necks(front, hind, forward)
            if not necks:
                continue
            level = (self._place(front.root)[1] + self._place(hind.root)[1]) / 2.0
            worth = max(self._headness(neck, float(level)) for neck in necks)
            ends = [self._place(neck[-1]) for neck in necks]
            reach = [float(end @ forward + 0.5 * end[1]) for end in ends]
            if best is None or worth > best[0]:
                head = necks[int(np.argmax(reach))][-1]
                best = worth, Roles(hind, front, forward, head, on_four=True)
        return None if best is None else best[1]

    def _necks(self, front: LimbPair, hind: LimbPair, forward: Array) -> list[Chain]:
        """The chains along the middle line from the front legs to ends ahead of them."""
        found = []
        for end in self._halves.ends:
            chain = self._tree.chain(hind.root, end)
            ahead = (self._place(end) - self._place(front.root)) @ forward > 0.0
            if ahead and front.root in chain and end != front.root:
                found.append(chain[chain.index(front.root) :])
        return found

    def _on_two(self, legs: LimbPair) -> Roles | None:
        """Two legs: the feet point forward."""
        arms, best = None, 0.0
        for pair in self._halves.pairs:
            length = self.length(pair) / self.size
            away = self._tree.length(self._tree.chain(legs.root, pair.root)) / self.size
            if pair is not legs and length >= LEAST and length / (away + _NEAR) > best:
                arms, best = pair, length / (away + _NEAR)
        if arms is not None and self._are_lifted_legs(arms, legs):
            return self._on_four(legs, arms)
        forward = self._front(legs, arms)
        return Roles(legs, arms, forward, self._top(legs, arms, forward))

    def _on_one_foot(self) -> Roles | None:
        """No legs, but one pair of arms on an upright trunk that stands on the floor."""
        pairs = self._halves.pairs
        if not pairs or len(self._halves.ends) != 2:
            return None
        arms = pairs[0]
        low, high = sorted(self._halves.ends, key=lambda node: float(self._place(node)[1]))
        clear = all(self.length(pair) < _LIKE * self.length(arms) for pair in pairs[1:])
        long = self.length(arms) > _ARMED * self.size
        stands = self._place(low)[1] < self._floor + _STANDS * self._height
        if not (clear and long and stands and arms.cost < _CLEAR):
            return None
        return Roles(None, arms, self._front(None, arms), high)

    def _are_lifted_legs(self, arms: LimbPair, legs: LimbPair) -> bool:
        """Whether arms are legs that are lifted in running: they hang down from a level trunk."""
        trunk = self._place(arms.root) - self._place(legs.root)
        level = abs(trunk[1]) < float(np.hypot(trunk[0], trunk[2]))
        like = self.length(arms) > _LIKE * self.length(legs)
        return bool(level and like and self._falls(arms))

    def _leaping(self) -> Roles | None:
        """Four legs that are stretched in a leap: two like pairs that hang from a level trunk."""
        if len(self._halves.pairs) < 2:
            return None
        one, other = self._halves.pairs[:2]
        apart = self._tree.length(self._tree.chain(one.root, other.root)) > _LEAP * self.size
        tips = [chain[-1] for pair in (one, other) for chain in pair.chains]
        low = self._tree.positions[tips, 1].min() < self._floor + _STANDS * self._height
        if not (apart and low and self._falls(one) and self._are_lifted_legs(other, one)):
            return None
        return self._on_four(one, other)

    def _falls(self, legs: LimbPair) -> bool:
        """Whether a pair of limbs leads down, at the mean of both."""
        falls = [self._place(chain[0])[1] - self._place(chain[-1])[1] for chain in legs.chains]
        return bool(np.mean(falls) > _FALLS * self.length(legs))

    def _balanced(self, legs: Sequence[LimbPair]) -> bool:
        """Whether legs, or their feet, carry the middle of the body."""
        tips = [chain[-1] for pair in legs for chain in pair.chains]
        middle = self._points.mean(axis=0) @ self._along
        held = (
            float((self._tree.positions[nodes] @ self._along).mean())
            for nodes in (tips, [pair.root for pair in legs])
        )
        return bool(min(abs(middle - at) for at in held) < _OVER * self.size)

    def _has_lonely_leg(self, longest: float) -> bool:
        """Whether a limb without a partner stands on the floor beside the middle, like a leg."""
        pairs = self._halves.pairs
        paired = {node for pair in pairs for chain in pair.chains for node in chain}
        for tip in self._tree.leaves:
            away = abs(float(self._halves.plane.distance(self._place(tip)[None])[0]))
            path = self._tree.chain(tip, pairs[0].root)
            own = path[: next(place for place, node in enumerate(path) if node in paired) + 1]
            long = self._tree.length(own) > _LIKE * longest
            if away > _ASIDE * self.size and long and self._reaches_floor(own[::-1]):
                return True
        return False

    def _stands(self, pair: LimbPair) -> bool:
        return all(self._reaches_floor(chain) for chain in pair.chains)

    def _reaches_floor(self, chain: Chain) -> bool:
        """Whether a limb ends near the floor, or its outer half touches it, as of one who sits."""
        tip = float(self._place(chain[-1])[1])
        outer = self._points[np.isin(self._nearest, chain[len(chain) // 2 + 1 :])]
        lowest = float(outer[:, 1].min(initial=tip))
        near = min(tip - _STANDS * self._height, lowest - _TOUCHES * self._height)
        return bool(near < self._floor)

    # Front and head.

    def _front(self, legs: LimbPair | None, arms: LimbPair | None) -> Array:
        """The direction that a body without forelegs faces.

        Its toes are ahead of its shins, and its hands of its shoulders; what rises leads forward,
        like a neck, and what sinks leads backward, like a tail.
        """
        sign = 0.0
        for chain in () if legs is None else legs.chains:
            sign += _TOES * self._toes(chain) + self._ahead(chain[0], chain[-1])
        for chain in () if arms is None else arms.chains:
            sign += _HANDS * self._ahead(chain[0], chain[-1])
        base = legs or arms
        if base is not None:
            for end in self._halves.ends:
                rise = float(self._place(end)[1] - self._place(base.root)[1]) / self.size
                sign += self._ahead(base.root, end) * float(np.clip(4.0 * rise, -1.0, 1.0))
        if abs(sign) < _DOUBT:  # as most files have it; with a tie broken the same way always
            sign = float(self._along @ [0.1, 0.0, 1.0])
        forward: Array = self._along * np.sign(sign)
        return forward

    def _ahead(self, near: int, far: int) -> float:
        """How far one node is along the plane from another, in shares of the size."""
        return float((self._place(far) - self._place(near)) @ self._along) / self.size

    def _toes(self, chain: Chain) -> float:
        """How far the foot of a leg reaches along the plane from its shin, of the size."""
        own = self._points[np.isin(self._nearest, chain[1:])]
        height = (own[:, 1] - self._floor) / self._height
        foot = own[height < _SOLE] @ self._along
        shin = own[(height > _SHIN[0]) & (height < _SHIN[1])] @ self._along
        if len(foot) < 10 or len(shin) < 10:
            return self._ahead(chain[len(chain) // 2], chain[-1]) / 2.0
        return float((foot.min() + foot.max()) / 2.0 - shin.mean()) / self.size

    def _headness(self, neck: Chain, level: float) -> float:
        """How much the end of a neck looks like a head, not like a tail.

        Heads are high above the trunk's level, thick, and have ears, horns or a mouth.
        """
        rise = (float(self._tree.positions[list(neck), 1].max()) - level) / self.size
        own = np.isin(self._nearest, neck[-3:])
        thick = float(np.median(self._distance[own])) / self.size if own.any() else 0.0
        ears = [self.length(pair) for pair in self._halves.pairs if pair.root in neck[1:]]
        return min(rise, _RISE) + _THICK * thick + min(_EARS[0] * sum(ears) / self.size, _EARS[1])

    def _top(self, legs: LimbPair, arms: LimbPair | None, forward: Array) -> int | None:
        """The node of the middle line beyond the arms that is the top of the head, or None."""
        start = legs.root if arms is None else arms.root
        best, top = 0.0, None
        for node in sorted(self._halves.middle):
            if start in self._tree.chain(legs.root, node):
                reach = self._place(node) - self._place(start)
                score = float(reach[1] + 0.5 * reach @ forward)
                if score > best:
                    best, top = score, node
        return top

    # Measures.

    def _place(self, node: int) -> Array:
        place: Array = self._tree.positions[node]
        return place

    def _middle_of(self, pair: LimbPair) -> Array:
        nodes = [node for chain in pair.chains for node in chain]
        middle: Array = self._tree.positions[nodes].mean(axis=0)
        return middle
