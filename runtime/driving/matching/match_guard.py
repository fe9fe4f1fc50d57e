"""Rejects matches that contradict a body's anatomy, and prefers those that look like it.

The screen alone takes any part that points the same way for an arm. A body's left and right arm
are a pair, so they belong to a pair of limbs, left to left; its head belongs to the middle, its
legs below, and the one part on which a character stands stays where it is. Only the driver that
suits by itself is guarded so: the matches of AniMesh are the screen's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import Kind, Side
from runtime.characters.character import Character
from runtime.driving.performer import Performer
from runtime.puppet.puppet import Puppet
from solvers.matching import SIZE_PREFERENCE, Match, TargetHierarchy
from solvers.retarget.source_limbs import SimplifiedSource
from solvers.skeleton.limbs import surface_points
from solvers.skeleton.mirror_pairs import mirrored_tree
from solvers.skeleton.mirror_plane import mirror_planes
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Chain = tuple[int, ...]
_Limb = tuple[tuple[Kind, ...], Side]

_LOOKED_THROUGH = 300  # matches among which those of pairs are looked for

_ARM = (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND)
_LEG = (Kind.UPPER_LEG, Kind.LOWER_LEG, Kind.FOOT, Kind.TOES)
_HEAD = (Kind.NECK, Kind.HEAD)

# In cosines, as the score.
_ASTRAY = -0.6  # an arm or leg on the middle line, a head on a limb of a pair
_HIGH = -0.8  # a leg on a part that ends in the upper half
_PAIRED, _CROSSED, _PARTED = 1.0, -0.5, -0.6  # two limbs on a pair; on its other sides; on two

_PLANES = 4  # that are tried
_ASYMMETRIC = 0.05  # a plane with more asymmetry divides no character
_ACROSS = 0.7  # least share of a plane's normal that lies across the stage
_STANDS = 0.15  # of the height: a part ends below
_FEWEST = 3  # branches of a character with a base


class MatchGuard:
    """Ranks the matches of one performer's body with one character by their anatomy too.

    Args:
        performer: the performer.
        source: the performer's chosen joints at rest, simplified.
        puppet: what is driven.
    """

    def __init__(self, performer: Performer, source: SimplifiedSource, puppet: Puppet) -> None:
        character, tree = puppet.character, puppet.bound_skeleton.tree
        self._source = source
        self._nodes, self._fork = _without_base(character, tree)
        place = {int(node): index for index, node in enumerate(self._nodes)}
        parents = [place.get(int(tree.parents[node]), -1) for node in self._nodes]
        self._tree = Tree(np.array(parents, dtype=np.int64), tree.positions[self._nodes])
        self._hierarchy = TargetHierarchy(self._tree, place.get(puppet.bound_skeleton.root))
        self._limbs = _limbs(performer, source)
        self._partner, middle = _partners(character, self._tree)
        half = float(character.vertices[:, 1].min() + character.vertices[:, 1].max()) / 2.0
        high = self._tree.positions[:, 1] > half
        self._leaning = np.zeros((len(source.chains), len(self._tree)))
        for row, (kinds, _) in enumerate(self._limbs.values()):
            astray = {_HEAD: list(self._partner), _ARM: middle, _LEG: middle}.get(kinds, [])
            self._leaning[row, astray] = _ASTRAY
            if kinds == _LEG:
                self._leaning[row, high] += _HIGH

    def rank(self, positions: Array, view: Array, limit: int) -> list[Match]:
        """Return matches with a pose, best first, whose merit counts pairs of limbs.

        Args:
            positions: (J, 3) [m] the performer's chosen joints.
            view: (3, 3) rotation from the stage to the camera.
            limit: the most matches.
        """
        ranked = self._hierarchy.rank(
            self._source,
            view,
            positions,
            limit=_LOOKED_THROUGH,
            size_preference=SIZE_PREFERENCE,
            leaning=self._leaning,
        )
        weighed = [replace(match, merit=match.merit + self._of_pairs(match)) for match in ranked]
        weighed.sort(key=lambda match: -match.merit)
        return [self._on_the_whole(match) for match in weighed[:limit]]

    def _of_pairs(self, match: Match) -> float:
        """What is added to the merit of a match for its pairs of limbs."""
        tips = {self._limbs[source]: target[-1] for source, target in match.pairs[: match.limbs]}
        return sum(
            self._worth(tips[kinds, Side.LEFT], tips[kinds, Side.RIGHT])
            for kinds in (_ARM, _LEG)
            if (kinds, Side.LEFT) in tips and (kinds, Side.RIGHT) in tips
        )

    def _worth(self, left: int, right: int) -> float:
        """What is added where a left and a right limb take branches that end at these nodes."""
        if self._partner.get(left) == right:
            places = self._tree.positions
            return _PAIRED if places[left, 0] > places[right, 0] else _CROSSED
        return _PARTED if left in self._partner or right in self._partner else 0.0

    def _on_the_whole(self, match: Match) -> Match:
        """The match with the nodes of the character in place of those without its base.

        What the base carries stays with it: a limb begins where the base ends.
        """
        pairs, stops = [], []
        for (source, target), stop in zip(match.pairs, match.stops, strict=True):
            nodes = tuple(int(node) for node in self._nodes[list(target)])
            start = nodes.index(self._fork) if self._fork in nodes[1 : stop - 1] else 0
            pairs.append((source, nodes[start:]))
            stops.append(stop - start)
        root = int(self._nodes[match.root])
        return replace(match, pairs=tuple(pairs), stops=tuple(stops), root=root)


def _limbs(performer: Performer, source: SimplifiedSource) -> dict[Chain, _Limb]:
    """What each of the performer's chains is, in their order."""
    parts, joints = label_joints(performer.skeleton), performer.joints
    return {
        chain: next(
            (
                (kinds, part.side)
                for joint in reversed(chain)
                for kinds in (_ARM, _LEG, _HEAD)
                if (part := parts[joints[joint]]) is not None and part.kind in kinds
            ),
            ((), Side.CENTRE),
        )
        for chain in source.chains
    }


def _partners(character: Character, tree: Tree) -> tuple[dict[int, int], list[int]]:
    """The tips of pairs of limbs, each with its partner's, and the other tips, in the middle.

    Both are empty where no plane between left and right is seen from the front.
    """
    points = surface_points(character.vertices, character.faces)
    size = float(np.ptp(points, axis=0).max())
    for plane in mirror_planes(points, _PLANES) if size > 0.0 else []:
        if abs(plane.normal[0]) < _ACROSS or plane.asymmetry > _ASYMMETRIC:
            continue
        halves = mirrored_tree(tree, plane, size)
        if halves.pairs:
            tips = [(pair.chains[0][-1], pair.chains[1][-1]) for pair in halves.pairs]
            return {a: b for one, other in tips for a, b in ((one, other), (other, one))}, list(
                halves.ends
            )
    return {}, []


def _without_base(character: Character, tree: Tree) -> tuple[NDArray[np.int64], int]:
    """The nodes, but for those of the one branch on which a character stands, and its fork.

    All of them, and no fork (-1), where it stands on several, or on its root, or has no others.
    """
    low = character.vertices[:, 1].min() + _STANDS * np.ptp(character.vertices[:, 1])
    feet = [end for end in tree.leaves if tree.positions[end, 1] < low]
    branch = tree.chain(tree.root, feet[0]) if len(feet) == 1 else ()
    if not branch or tree.positions[tree.root, 1] < low or len(tree.leaves) < _FEWEST:
        return np.arange(len(tree)), -1
    fork = max(place for place, node in enumerate(branch) if len(tree.children[node]) > 1)
    return np.setdiff1d(np.arange(len(tree)), branch[fork + 1 :]), branch[fork]
