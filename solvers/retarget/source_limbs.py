"""Simplifies a performer's skeleton to its limbs, for matching in every frame.

Source: AniMesh (Jin et al. 2015), section 4.1 and figure 3b.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solvers.retarget.folding import BODY_PLAN, SPUR, Folding, centre_node, unfold
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

# The most limbs of a performer, the longest first; two hands have ten.
MOST_LIMBS: Final = 20


@dataclass(frozen=True, slots=True, eq=False)
class SimplifiedSource:
    """A performer's skeleton after one step of simplification (figure 3b).

    Attributes:
        tree: the performer's joints.
        chains: joint ids of each of the m branches, from its fork to a leaf.
        weights: (m, J); a branch's abstracted position is its row times the joints' positions.
        forks: joint ids of the kept branch nodes, the nearest to the tree's root first.
        centre: the joint that is the branches' origin, chosen as in `abstraction.SubTree`.
        stem: joint ids from the tree's root down to the first fork; () where that is the root.
        length: the longest branch at rest, from `centre` to its abstracted position.
    """

    tree: Tree
    chains: tuple[tuple[int, ...], ...]
    weights: Array
    forks: tuple[int, ...]
    centre: int
    stem: tuple[int, ...]
    length: float

    def branch_vectors(self, positions: Array) -> Array:
        """Return the abstracted branches (m, 3) of a pose (J, 3), measured from the centre."""
        vectors: Array = self.weights @ positions - positions[self.centre]
        return vectors


def simplify(tree: Tree) -> SimplifiedSource:
    """Simplify a performer's skeleton to its limbs: AniMesh, section 4.1 and figure 3b.

    Leaf chains collapse in a single step, as in the paper. A part that is small against the whole
    belongs to the limb at which it is attached: hands with fingers on a body, a face, twist joints.
    A hand alone keeps its fingers.
    """
    folding = Folding(tree, np.eye(len(tree)))
    shortest = SPUR * tree.heights[tree.root]
    stem: tuple[int, ...] = (tree.root,)
    if len(first := folding.limbs(tree.root, shortest)) == 1:
        stem = folding.walk_limb(tree.root, first[0], shortest)
    top = stem[-1] if len(folding.limbs(stem[-1], shortest)) > 1 else tree.root
    limbs = unfold(folding, top, BODY_PLAN)
    longest = sorted(limbs.branches, key=lambda branch: -branch.length)[:MOST_LIMBS]
    branches = tuple(branch for branch in limbs.branches if branch in longest)
    weights = np.array([branch.position for branch in branches]).reshape(-1, len(tree))
    centre = centre_node(tree, limbs.forks, weights @ tree.positions, branches)
    vectors = weights @ tree.positions - tree.positions[centre]
    return SimplifiedSource(
        tree,
        tuple(branch.chain + branch.extension for branch in branches),
        weights,
        limbs.forks,
        centre,
        stem if top != tree.root else (),
        float(np.linalg.norm(vectors, axis=1).max(initial=0.0)),
    )
