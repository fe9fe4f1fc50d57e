"""Ranks the parts of a character by their similarity to a performer's pose, seen on the screen.

Source: AniMesh (Jin et al. 2015), section 4.2 and figure 3g.

Both trees are moved so that their roots coincide, scaled so that the longest branch has length one,
and projected to the screen. The score of a match is the paper's: the sum, over the pairs of
branches, of the cosine of the angle between them. A branch that is nearly perpendicular to the
screen (after the scaling) has no angle there; its cosine fades to 0 as its picture gets shorter
than `_FADE`.

A performer with several forks (a body: shoulders and hips) is also matched with the unfolded
sub-trees of `abstraction`. Then the chains between the forks are paired as well: pelvis to chest
with the same chain of the character. These inner pairs have no score.

More pairs can give a larger sum. So a part of the character that can take all of the performer's
branches comes before a part that can take fewer. With `size_preference` = 0 the order is that of
the scores. Above 0 each pair adds that much to the merit if its target chain is at least a third as
long as the character's longest, and proportionally less if it is shorter. So limbs come before
spurs of the same direction, and a tail does not come before a leg.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.retarget.abstraction import SubTree, abstract
from solvers.retarget.assignment import MOST_COLUMNS, rank_assignments
from solvers.retarget.source_limbs import SimplifiedSource, simplify
from solvers.skeleton.tree import Tree, extend_to_leaf

__all__ = ["Match", "TargetHierarchy", "Tree", "extend_to_leaf", "rank_matches"]

Array = NDArray[np.float64]
Chain = tuple[int, ...]
# A match's pairs, limbs, stops, root and level.
_Plan = tuple[tuple[tuple[Chain, Chain], ...], int, tuple[int, ...], int, int]

SIZE_PREFERENCE: Final = 0.8  # for a live show, where the audience should see the moving part
_FADE: Final = 0.05  # of the longest branch
_REMEMBERED: Final = 4096  # matches whose chains are cached


@dataclass(frozen=True, slots=True)
class Match:
    """One way to let a performer drive a part of a character.

    Attributes:
        score: sum of the cosines over the first `limbs` pairs, at most `limbs`.
        pairs: chains of source and of target nodes, from the root outward; first the limbs (target
            chains extended to a leaf, figure 5 right), then the inner chains between their roots.
        limbs: the number of pairs that are limbs.
        stops: for each pair the number of target nodes up to the abstracted sub-tree's root
            (figure 5 middle).
        root: target node that stays in place; all target chains lead away from it.
        level: level of detail of the sub-tree, from 1 (small parts) up.
        merit: the key of the order: the score plus the preference for size.
    """

    score: float
    pairs: tuple[tuple[Chain, Chain], ...]
    limbs: int
    stops: tuple[int, ...]
    root: int
    level: int
    merit: float

    def stopped(self) -> Match:
        """Return the same match with target chains that stop at the sub-trees' roots."""
        stopped = tuple(
            (source, target[:stop])
            for (source, target), stop in zip(self.pairs, self.stops, strict=True)
        )
        return replace(self, pairs=stopped)


@dataclass(frozen=True, slots=True, eq=False)
class _Candidates:
    """The sub-trees that are compared with sources of one kind, and all their branches."""

    subtrees: tuple[SubTree, ...]
    starts: NDArray[np.int64]  # (C + 1,)
    vectors: Array  # (T, 3) from the sub-tree's centre, its longest branch of length one
    sizes: Array  # (T,) 1 for extended chains at least a third as long as the longest, less below
    tips: NDArray[np.int64]  # (T,) last nodes of the extended chains


class TargetHierarchy:
    """A character's skeleton with its sub-trees, prepared once for matching in every frame.

    Args:
        tree: the character's skeleton at rest.
        root: the hierarchy's root; found if not given.
    """

    def __init__(self, tree: Tree, root: int | None = None) -> None:
        self.tree = tree
        self.hierarchy = abstract(tree, root)
        self._candidates: dict[tuple[int, bool], _Candidates] = {}
        self._plans: dict[tuple[int, Chain], tuple[_Plan, int]] = {}
        self._numbers: dict[tuple[object, ...], int] = {}
        self._source: SimplifiedSource | None = None

    def rank(
        self,
        source: SimplifiedSource,
        view: ArrayLike,
        positions: ArrayLike | None = None,
        *,
        limit: int = 20,
        source_view: ArrayLike | None = None,
        size_preference: float = 0.0,
        leaning: Array | None = None,
    ) -> list[Match]:
        """Return matches with a performer's pose, best first.

        Args:
            source: the performer's simplified skeleton.
            view: (3, 3) rotation from the stage to the camera (x right, y up, z to the viewer).
            positions: (J, 3) the joints' positions, finite; the skeleton's rest if not given.
            limit: the most matches.
            source_view: (3, 3) as `view`, for the capture device; the identity if not given.
            size_preference: see the module.
            leaning: (m, K) what each of the source's limbs adds to the merit where it takes a
                branch that ends at a node; nothing if not given.

        Source: AniMesh, section 4.2.
        """
        pose = source.tree.positions if positions is None else np.asarray(positions, np.float64)
        if len(source.chains) == 0 or limit < 1:
            return []
        candidates = self._for(len(source.chains), len(source.forks) > 1)
        if not candidates.subtrees:
            return []
        seen = _on_screen(source.branch_vectors(pose) / max(source.length, 1e-300), source_view)
        cosines = seen @ _on_screen(candidates.vectors, view).T
        preferred = np.broadcast_to(size_preference * candidates.sizes, cosines.shape)
        if leaning is not None:
            preferred = preferred + leaning[:, candidates.tips]
        # Two unfoldings can contain the same match: rank more, and keep the first of each.
        more = 2 if any(subtree.unfolding for subtree in candidates.subtrees) else 1
        taken, columns, merits = rank_assignments(
            cosines + preferred, candidates.starts, more * limit
        )
        rows = np.arange(len(preferred))
        beside = preferred[rows, candidates.starts[taken, None] + columns]
        scores = (merits - np.where(columns < 0, 0.0, beside).sum(axis=1)).tolist()
        matches: dict[int, Match] = {}
        for which, row, score, merit in zip(
            taken.tolist(), columns.tolist(), scores, merits.tolist(), strict=True
        ):
            plan, number = self._plan(source, candidates.subtrees[which], tuple(row))
            if number not in matches:
                matches[number] = Match(score, *plan, merit)
        # Scores that are equal up to rounding may be in any order.
        return sorted(matches.values(), key=lambda match: -match.merit)[:limit]

    def _for(self, branches: int, several_forks: bool) -> _Candidates:
        key = branches, several_forks
        if key not in self._candidates:
            self._candidates[key] = _gather(self.tree, self.hierarchy.subtrees, *key)
        return self._candidates[key]

    def _plan(
        self, source: SimplifiedSource, subtree: SubTree, columns: Chain
    ) -> tuple[_Plan, int]:
        """A match without its score, from a cache, and a number that identifies it."""
        if source is not self._source or len(self._plans) >= _REMEMBERED:
            self._source = source
            self._plans.clear()
            self._numbers.clear()
        key = id(subtree), columns
        if key not in self._plans:
            plan = _plan(self.tree, source, subtree, columns)
            self._plans[key] = (
                plan,
                self._numbers.setdefault(plan[:1] + plan[3:4], len(self._numbers)),
            )
        return self._plans[key]


def rank_matches(
    source: Tree,
    target: Tree,
    view: ArrayLike,
    *,
    limit: int = 100,
    source_view: ArrayLike | None = None,
    size_preference: float = 0.0,
) -> list[Match]:
    """Rank the parts of `target` that the pose of `source` resembles on the screen, best first.

    Args:
        source: the performer's joints as they are posed, seen straight on (x right, y up).
        target: the character's skeleton.
        view: (3, 3) rotation from the stage to the target's camera (x right, y up, z to viewer).
        limit: the most matches.
        source_view: (3, 3) as `view`, for the source.
        size_preference: merit of a full-sized limb over a spur; 0 orders by the score alone.

    Source: AniMesh (Jin et al. 2015), section 4.
    """
    return TargetHierarchy(target).rank(
        simplify(source),
        view,
        limit=limit,
        source_view=source_view,
        size_preference=size_preference,
    )


def _on_screen(vectors: Array, view: ArrayLike | None) -> Array:
    """Directions (n, 2) of vectors on the screen: unit, or shorter where the picture is a dot."""
    if view is not None:
        rotation = np.asarray(view, dtype=np.float64)
        if rotation.shape != (3, 3):
            raise ValueError(f"Expected a view of shape (3, 3), got {rotation.shape}")
        vectors = vectors @ rotation.T
    flat = vectors[:, :2]
    lengths = np.sqrt((flat * flat).sum(axis=1, keepdims=True))
    directions: Array = flat / np.maximum(lengths, _FADE)
    return directions


def _gather(
    tree: Tree, subtrees: Sequence[SubTree], branches: int, several_forks: bool
) -> _Candidates:
    """The candidates for sources with so many branches.

    A sub-tree as the paper folds it is always a candidate. Unfolded, it is one if the coarser
    unfolding has too few branches, or, within the body plan, if the source has several forks.
    """
    chosen = [
        _largest(subtree)
        for subtree in subtrees
        if subtree.branches
        and (
            subtree.unfolding == 0
            or subtree.coarser < branches
            or (several_forks and subtree.body_plan)
        )
    ]
    chosen.sort(key=lambda s: (-sum(b.length for b in s.branches), s.unfolding, s.root))
    flat = [branch for subtree in chosen for branch in subtree.branches]
    lengths = np.array([tree.length(branch.chain + branch.extension) for branch in flat])
    vectors = np.zeros((len(flat), 3))
    starts = np.cumsum([0] + [len(subtree.branches) for subtree in chosen])
    for subtree, first, end in zip(chosen, starts, starts[1:], strict=False):
        block = np.array([branch.position for branch in subtree.branches])
        block -= tree.positions[subtree.centre]
        vectors[first:end] = block / max(np.linalg.norm(block, axis=1).max(), 1e-300)
    sizes = np.minimum(3.0 * lengths / max(lengths.max(initial=0.0), 1e-300), 1.0)
    tips = np.array([(branch.chain + branch.extension)[-1] for branch in flat], dtype=np.int64)
    return _Candidates(tuple(chosen), starts, vectors, sizes, tips)


def _largest(subtree: SubTree) -> SubTree:
    """The sub-tree with at most `MOST_COLUMNS` branches, the longest, in their order."""
    if len(subtree.branches) <= MOST_COLUMNS:
        return subtree
    kept = sorted(subtree.branches, key=lambda branch: -branch.length)[:MOST_COLUMNS]
    return replace(subtree, branches=tuple(b for b in subtree.branches if b in kept))


def _plan(tree: Tree, source: SimplifiedSource, subtree: SubTree, columns: Chain) -> _Plan:
    """The chains driven by a choice of branches; `columns` is the branch of each source branch."""
    limbs = [
        (chain, subtree.branches[column])
        for chain, column in zip(source.chains, columns, strict=True)
        if column >= 0
    ]
    pairs = [(chain, branch.chain + branch.extension) for chain, branch in limbs]
    stops = [len(branch.chain) for _, branch in limbs]
    hang = [(chain[0], branch.fork) for chain, branch in limbs]
    places = _place_forks(tree, source, subtree.root, hang)
    inner = _inner_pairs(tree, source, places)
    root = next(iter(places.values()))
    if source.stem and subtree.stem and root == subtree.root and source.stem[-1] in places:
        inner.append((source.stem, subtree.stem))
        root = subtree.stem[0]
    stops += [len(target) for _, target in inner]
    return (*pairs, *inner), len(pairs), tuple(stops), root, subtree.level


def _place_forks(
    tree: Tree, source: SimplifiedSource, root: int, hang: Sequence[tuple[int, int]]
) -> dict[int, int]:
    """For each source fork the target node where its limbs meet, seen from the sub-tree's root.

    A fork without a matched limb lies where the forks below it meet. The source fork nearest to the
    performer's root comes first.

    Args:
        tree: the target.
        source: the performer.
        root: the sub-tree's root.
        hang: the source fork and the target fork of each pair of limbs.
    """
    places: dict[int, int] = {}
    hanging: dict[int, list[int]] = {fork: [] for fork in source.forks}
    for fork in reversed(source.forks):  # outer forks first
        own = [target for carries, target in hang if carries == fork]
        below = hanging[fork]
        if own or len(below) > 1:
            places[fork] = _meet(tree, root, own or below)
            below = [places[fork]]
        above = _next_above(source, fork, hanging)
        if above is not None:
            hanging[above].extend(below)
    return dict(reversed(places.items()))


def _inner_pairs(
    tree: Tree, source: SimplifiedSource, places: dict[int, int]
) -> list[tuple[Chain, Chain]]:
    """The chains between forks that exist on both sides, the nearest to the root first."""
    root = next(iter(places.values()))
    driven: set[tuple[int, int]] = set()
    pairs: list[tuple[Chain, Chain]] = []
    for fork, node in places.items():
        above = _next_above(source, fork, places)
        if above is None or places[above] == node:
            continue
        target = tree.chain(places[above], node)
        outward = tree.chain(root, node)[-len(target) :] == target
        if outward and driven.isdisjoint(pairwise(target)):
            driven.update(pairwise(target))
            pairs.append((source.tree.chain(above, fork), target))
    return pairs


def _next_above(source: SimplifiedSource, fork: int, among: Container[int]) -> int | None:
    """The next of the forks in `among` on the way from `fork` to the performer's root."""
    node = int(source.tree.parents[fork])
    while node >= 0 and node not in among:
        node = int(source.tree.parents[node])
    return node if node >= 0 else None


def _meet(tree: Tree, root: int, nodes: Sequence[int]) -> int:
    """The last node that the chains from `root` to all of `nodes` have in common."""
    ways = [tree.chain(root, node) for node in nodes]
    shared = 0
    while all(len(way) > shared and way[shared] == ways[0][shared] for way in ways):
        shared += 1
    return ways[0][shared - 1]
