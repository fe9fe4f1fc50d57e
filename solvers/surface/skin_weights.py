"""Fits skin weights with which a skinned skeleton reproduces a performed surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import shortest_path
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from solvers.skeleton.tree import Tree

INFLUENCES = 4  # the most nodes for a vertex, as in game engines
_CANDIDATES = 8  # nodes from which those are chosen
_NEAR = 3  # steps along the tree within which only the distance counts
_PRIOR = 2e-3  # of the character's size: for smaller deviations the prior weights count more
_ITERATIONS = 200


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """The nodes that each vertex follows, and their weights.

    Attributes:
        nodes: (N, C) int, distinct in each row where weights are not 0.
        weights: (N, C), not negative, rows sum to 1.
    """

    nodes: NDArray[np.int64]
    weights: NDArray[np.float64]

    def strongest(self, count: int) -> Skin:
        """Return the skin with at most the `count` strongest nodes of each vertex."""
        if self.nodes.shape[1] <= count:
            return self
        order = np.argsort(-self.weights, axis=1, kind="stable")[:, :count]
        weights = np.take_along_axis(self.weights, order, axis=1)
        weights /= weights.sum(axis=1, keepdims=True)
        return Skin(np.take_along_axis(self.nodes, order, axis=1), weights)


@dataclass(frozen=True, slots=True, eq=False)
class PosedSamples:
    """Frames of a performance to which a skin is fitted.

    Attributes:
        vertices: (S, N, 3) [m] the surface; S may be 0.
        positions: (S, K, 3) [m] the nodes.
        rotations: (S, K, 4) the nodes' world rotations from rest.
    """

    vertices: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]


def skin_of_weights(weights: csr_array) -> Skin:
    """Return the four strongest nodes of each row of weights (N, K); an empty row gives node 0."""
    entries = csr_array(weights).tocoo()
    values = np.maximum(entries.data, 0)
    order = np.lexsort((-values, entries.row))
    row, column, values = entries.row[order], entries.col[order], values[order]
    rank = np.arange(len(row)) - np.searchsorted(row, row)
    strong = rank < INFLUENCES
    nodes = np.zeros((weights.shape[0], INFLUENCES), np.int64)
    kept = np.zeros(nodes.shape)
    nodes[row[strong], rank[strong]] = column[strong]
    kept[row[strong], rank[strong]] = values[strong]
    kept[kept.sum(axis=1) == 0, 0] = 1.0
    return Skin(nodes, kept / kept.sum(axis=1, keepdims=True))


def skin_of_distances(vertices: NDArray[np.float64], tree: Tree) -> Skin:
    """Return weights that fall with the fourth power of the distance to the nodes.

    Nodes far from the nearest one along the tree are penalised, so that a limb does not follow
    another limb that hangs beside it.
    """
    rest = tree.positions
    count = min(_CANDIDATES, len(rest))
    steps = _steps_between(tree)
    extent = float(np.ptp(np.concatenate([vertices, rest]), axis=0).max())
    nearest = KDTree(rest).query(vertices)[1]
    nodes = np.zeros((len(vertices), count), np.int64)
    distances = np.zeros((len(vertices), count))
    for node in np.unique(nearest):
        mine = np.flatnonzero(nearest == node)
        penalty = extent * np.maximum(steps[node] - _NEAR, 0)
        far = cdist(vertices[mine], rest) + penalty
        nodes[mine] = np.argsort(far, axis=1, kind="stable")[:, :count]
        distances[mine] = np.take_along_axis(far, nodes[mine], axis=1)
    weights = (distances + 1e-6 * max(extent, 1e-30)) ** -4
    return Skin(nodes, weights / weights.sum(axis=1, keepdims=True))


def fit_skin(vertices: NDArray[np.float64], tree: Tree, prior: Skin, samples: PosedSamples) -> Skin:
    """Return the skin with at most `INFLUENCES` nodes a vertex that reproduces the samples best.

    For each vertex, weights w >= 0 that sum to 1 minimise the squared distance between the
    skinned and the performed vertex over all samples, plus a small multiple of |w - prior|^2 that
    decides where several nodes move alike. A first fit uses all of the prior's nodes, a second one
    the strongest of them. The weight step of Le & Deng 2012, "Smooth skinning decomposition with
    rigid bones", section 4.2, here with given bones.

    Args:
        vertices: (N, 3) rest positions.
        tree: the nodes at rest.
        prior: the candidates and their default weights.
        samples: the frames to reproduce.
    """
    if len(samples.vertices) == 0:
        return prior.strongest(INFLUENCES)
    extent = float(np.ptp(vertices, axis=0).max())
    pull = len(samples.vertices) * (_PRIOR * extent) ** 2
    wide = _minimise(_moments(vertices, tree, prior, samples), prior.weights, pull)
    narrow = Skin(prior.nodes, wide).strongest(INFLUENCES)
    moments = _moments(vertices, tree, narrow, samples)
    return Skin(narrow.nodes, _minimise(moments, narrow.weights, pull))


def deviations(
    vertices: NDArray[np.float64], tree: Tree, skin: Skin, samples: PosedSamples
) -> NDArray[np.float64]:
    """Return the distances (S, N) [m] between the skinned and the performed surface."""
    found = np.zeros(samples.vertices.shape[:2])
    for sample in range(len(found)):
        offsets = _offsets(vertices, tree, skin, samples, sample)  # (N, C, 3)
        found[sample] = np.linalg.norm(np.einsum("nc,nci->ni", skin.weights, offsets), axis=1)
    return found


def _steps_between(tree: Tree) -> NDArray[np.float64]:
    """The number of bones between any two nodes (K, K)."""
    count = len(tree.parents)
    children = np.flatnonzero(tree.parents >= 0)
    ones = np.ones(len(children))
    bones = csr_array((ones, (children, tree.parents[children])), shape=(count, count))
    steps: NDArray[np.float64] = shortest_path(bones, directed=False, unweighted=True)
    return steps


def _offsets(
    vertices: NDArray[np.float64],
    tree: Tree,
    skin: Skin,
    samples: PosedSamples,
    sample: int,
) -> NDArray[np.float64]:
    """The offset from each performed vertex to its place as moved by each node: (N, C, 3)."""
    turns = Rotation.from_quat(samples.rotations[sample]).as_matrix()  # (K, 3, 3)
    shifts = samples.positions[sample] - np.einsum("kij,kj->ki", turns, tree.positions)
    carried = np.einsum("ncij,nj->nci", turns[skin.nodes], vertices) + shifts[skin.nodes]
    offsets: NDArray[np.float64] = carried - samples.vertices[sample][:, None, :]
    return offsets


def _moments(
    vertices: NDArray[np.float64], tree: Tree, skin: Skin, samples: PosedSamples
) -> NDArray[np.float64]:
    """The quadratic forms (N, C, C) that give the squared error of weights over all samples."""
    width = skin.nodes.shape[1]
    moments = np.zeros((len(vertices), width, width))
    for sample in range(len(samples.vertices)):
        offsets = _offsets(vertices, tree, skin, samples, sample)
        moments += offsets @ offsets.transpose(0, 2, 1)
    return moments


def _minimise(
    moments: NDArray[np.float64], prior: NDArray[np.float64], pull: float
) -> NDArray[np.float64]:
    """Weights (N, C) on the simplex that minimise w.M.w + pull |w - prior|^2.

    Accelerated projected gradient: Beck & Teboulle 2009, "A fast iterative shrinkage-thresholding
    algorithm", equations (4.1) to (4.3).
    """
    bound = np.abs(moments).sum(axis=2).max(axis=1) + pull  # of the largest eigenvalue
    step = 1.0 / np.maximum(bound, 1e-300)[:, None]
    weights = ahead = prior
    momentum = 1.0
    for _ in range(_ITERATIONS):
        gradient = np.einsum("ncd,nd->nc", moments, ahead) + pull * (ahead - prior)
        moved = _onto_simplex(ahead - step * gradient)
        following = 0.5 * (1 + np.sqrt(1 + 4 * momentum**2))
        ahead = moved + (momentum - 1) / following * (moved - weights)
        weights, momentum = moved, following
    return weights


def _onto_simplex(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nearest points (N, C) whose numbers are not negative and sum to 1.

    Source: Duchi et al. 2008, "Efficient projections onto the l1-ball", figure 1.
    """
    falling = -np.sort(-points, axis=1)
    excess = np.cumsum(falling, axis=1) - 1
    counts = np.arange(1, points.shape[1] + 1)
    last = np.count_nonzero(falling * counts > excess, axis=1)
    threshold = np.take_along_axis(excess, last[:, None] - 1, axis=1) / last[:, None]
    nearest: NDArray[np.float64] = np.maximum(points - threshold, 0)
    return nearest
