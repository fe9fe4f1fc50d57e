"""The parts of a performer or a character that a person can choose: chains, with their names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import BodyPlan, Chain
from devices.bodies.plan_by_names import plan_by_names
from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.driving.part_names import part_name
from runtime.puppet.bound_skeleton import BoundSkeleton
from solvers.skeleton.limbs import closest_bones, surface_points
from solvers.skeleton.part_chains import PartChains, part_chains
from solvers.skeleton.repeated_chains import repeated_chains

SAME = 0.3  # of the bones of two chains, at least, that both have if one stands for the other


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The chains of a skeleton that can be chosen; no two share a bone.

    Attributes:
        chains: joints or nodes of each from the trunk outward, two at least.
        names: of each, in words; no two are the same.
        of_node: (K,) the chain that the bone belongs to which ends at each node; -1 for none.
        groups: chains that repeat, each group in the order in which they stand.
        root: all chains lead away from this node.
    """

    chains: tuple[Chain, ...]
    names: tuple[str, ...]
    of_node: NDArray[np.int64]
    groups: tuple[tuple[int, ...], ...]
    root: int

    def alike(self, chain: int) -> tuple[int, ...]:
        """Return the group of a chain; itself alone where it does not repeat."""
        return next((group for group in self.groups if chain in group), (chain,))

    def nearest(self, chain: Sequence[int]) -> int | None:
        """Return the chain that is most like a chain of nodes; None if none is nearly the same."""
        bones = frozenset(chain[1:])
        shares = [
            len(bones.intersection(own[1:])) / len(bones.union(own[1:])) for own in self.chains
        ]
        best = int(np.argmax(shares)) if shares else -1
        return best if best >= 0 and shares[best] >= SAME else None

    def named(self, words: str) -> int:
        """Return the chain called so: by its name, the beginning of it, or one of its nodes.

        Raises:
            InputError: they mean none, or several.
        """
        wanted = _plain(words)
        whole = [number for number, name in enumerate(self.names) if _plain(name) == wanted]
        begun = [
            number
            for number, name in enumerate(self.names)
            if re.match(rf"{re.escape(wanted)}(?!\w)", _plain(name))
        ]
        found = whole or begun
        if len(found) == 1:
            return found[0]
        said = "; ".join(self.names[number] for number in found or range(len(self.names)))
        problem = "means several parts" if found else "is no part"
        raise InputError(f"{words!r} {problem}; there are: {said}")


def performer_parts(skeleton: Skeleton) -> Parts:
    """Return the parts of a performer: limbs by their names, other chains by the skeleton."""
    plan = plan_by_names(skeleton)
    root = skeleton.root if plan is None else plan.hips
    return _parts(skeleton, plan, root, None)


def character_parts(character: Character, bound: BoundSkeleton) -> Parts:
    """Return the parts of a character: limbs of its plan, other chains by the skeleton.

    Args:
        character: whose skeleton and surface.
        bound: the same nodes, bound to the surface.
    """
    skeleton, plan = character.skeleton, character.plan
    root = bound.root if plan is None else plan.hips
    points = surface_points(character.vertices, character.faces)
    nearest, distance = closest_bones(
        points, skeleton.tree.rerooted(root).parents, skeleton.rest_positions
    )

    def radius(chain: Chain) -> float:
        """As thick as its outer half: its beginning may lie inside the trunk."""
        near = np.isin(nearest, chain[len(chain) // 2 :])
        return float(np.median(distance[near])) if near.any() else 0.0

    return _parts(skeleton, plan, root, radius)


def _parts(
    skeleton: Skeleton,
    plan: BodyPlan | None,
    root: int,
    radius: Callable[[Chain], float] | None,
) -> Parts:
    known = () if plan is None else tuple(plan.in_words().values())
    split = part_chains(skeleton.tree, root, known)
    radii = None if radius is None else [radius(chain) for chain in split.chains]
    pairs, single = ([], []) if plan is None else _of_plan(plan, split)
    groups = repeated_chains(skeleton.tree, root, split.chains, radii, pairs=pairs, single=single)
    names = _told_apart([part_name(skeleton, plan, chain) for chain in split.chains])
    return Parts(split.chains, names, split.of_node, tuple(groups), root)


def _of_plan(plan: BodyPlan, split: PartChains) -> tuple[list[tuple[int, int]], list[int]]:
    """The chains that a plan knows to be left and right of each other, and those in the middle."""
    known = {chain: number for number, chain in enumerate(split.chains)}
    limbs = (plan.arms, plan.legs, *plan.more_legs)
    twins = [tuple(known.get(limb.chain, -1) for limb in pair.values()) for pair in limbs]
    middle = [known.get(chain, -1) for chain in (plan.trunk, plan.head, plan.tail)]
    pairs = [(twin[0], twin[1]) for twin in twins if len(twin) == 2 and min(twin) >= 0]
    return pairs, [number for number in middle if number >= 0]


def chains_of_vertices(parts: Parts, bound: BoundSkeleton) -> NDArray[np.int64]:
    """Return the chain that each vertex of a character belongs to (N,), -1 for none.

    Args:
        parts: of the character.
        bound: its nodes, bound to its surface.
    """
    away = bound.tree.rerooted(parts.root).parents
    pivot, node = bound.bone_of_vertex.T
    chains: NDArray[np.int64] = parts.of_node[np.where(away[pivot] == node, pivot, node)]
    return chains


def _told_apart(names: Sequence[str]) -> tuple[str, ...]:
    """Names with a number after each that occurs more than once."""
    often, seen = Counter(names), Counter[str]()
    told = []
    for name in names:
        seen[name] += 1
        told.append(f"{name} {seen[name]}" if often[name] > 1 else name)
    return tuple(told)


def _plain(words: str) -> str:
    """Words without what people write in different ways."""
    return " ".join(re.split(r"[\s_,-]+", words.strip().casefold()))
