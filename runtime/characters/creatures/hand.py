"""The plan of a character that is a hand, with or without its arm: by names, else by its shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import Chain
from devices.bodies.hand_plan import NAMED, HandPlan, hands_by_names
from devices.bodies.joint_names import Side
from runtime.characters.character import Character
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_SPUR = 0.1  # of the longest branch: a shorter leaf is no finger
_FAN = 0.4  # least cosine between a finger and the middle of all
_BACK = -0.3  # greatest cosine between the arm and the fingers
_LIKE = 0.4  # of the longest finger: the shortest is as long


def hand_of(character: Character) -> HandPlan | None:
    """Return the plan of a character that is one hand; None for any other, and for a body."""
    if character.plan is not None:
        return None
    named = hands_by_names(character.skeleton)
    if len(named) == 1:
        return named[0]
    return hand_by_shape(character.skeleton.tree) if not named else None


def hand_by_shape(tree: Tree) -> HandPlan | None:
    """Return the plan of a hand: five like branches that spread like a fan, away from an arm.

    The thumb is the finger at that side of the fan which reaches less far.

    Args:
        tree: the skeleton's nodes at rest [m].
    """
    leaves = _leaves(tree)
    if len(leaves) != len(NAMED) + 1:
        return None
    for stump in leaves:
        fingers = [tree.chain(stump, leaf) for leaf in leaves if leaf != stump]
        shared = [nodes[0] for nodes in zip(*fingers, strict=False) if len(set(nodes)) == 1]
        own = [chain[len(shared) - 1 :] for chain in fingers]
        reach = _reach(tree, own, tree.positions[shared[-1]] - tree.positions[stump])
        if reach is not None:
            return HandPlan(Side.CENTRE, tuple(shared), dict(zip(NAMED, reach, strict=True)))
    return None


def _leaves(tree: Tree) -> list[int]:
    """The ends of all branches, the root's too, that are long enough."""
    at_root = [tree.root] if len(tree.children[tree.root]) == 1 else []
    ends = list(dict.fromkeys([*tree.leaves, *at_root]))
    forks = {node for node in range(len(tree)) if len(tree.children[node]) > 1}
    forks -= {tree.root} if len(tree.children[tree.root]) < 3 else set()
    lengths = {}
    for end in ends:
        others = [other for other in ends if other != end]
        ways = [tree.chain(end, other) for other in others]
        lengths[end] = min(
            tree.length(way[: next((i for i, n in enumerate(way) if n in forks), len(way) - 1) + 1])
            for way in ways
        )
    longest = max(lengths.values(), default=0.0)
    return [end for end in ends if lengths[end] > _SPUR * longest]


def _reach(tree: Tree, fingers: list[Chain], arm: Array) -> list[Chain] | None:
    """The fingers from the thumb on, if they spread from the end of an arm (3,) like a fan."""
    lengths = [tree.length(finger) for finger in fingers]
    ways = np.array([tree.positions[chain[-1]] - tree.positions[chain[0]] for chain in fingers])
    long = np.linalg.norm(ways, axis=1, keepdims=True)
    if min(lengths) < _LIKE * max(lengths) or not long.min() > 0.0 or not arm.any():
        return None
    middle = (ways / long).mean(axis=0)
    middle /= max(float(np.linalg.norm(middle)), 1e-9)
    if (ways / long @ middle).min() < _FAN or -arm @ middle > _BACK * np.linalg.norm(arm):
        return None
    flat = ways - np.outer(ways @ middle, middle)
    across = np.linalg.svd(flat - flat.mean(axis=0))[2][0]
    order = np.argsort(flat @ across)
    if ways[order[0]] @ middle > ways[order[-1]] @ middle:
        order = order[::-1]
    return [fingers[finger] for finger in order]
