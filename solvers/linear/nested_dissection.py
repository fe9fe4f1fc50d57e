"""Nested dissection: an elimination order that keeps a sparse factor small and its solve parallel.

A small set of vertices, the separator, splits a mesh into two halves. The halves are ordered first,
each in the same way; the separator comes last. The halves do not touch each other, so they can be
eliminated at the same time.

Source: George 1973, Nested dissection of a regular finite element mesh.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.linear.laplacian import Floats

Indices = NDArray[np.int32]

LEAF = 32  # parts of at most this many vertices are eliminated as one dense block


class Graph(NamedTuple):
    """A symmetric graph as compressed rows, and the positions (n, 3) of its vertices."""

    starts: Indices
    neighbours: Indices
    points: Floats


class Workspace(NamedTuple):
    """Scratch memory of a cut.

    For each vertex: the part that owns it, its side (0 or 1, or 2 for the separator) and its
    distance along edges. For each place in the part: the key to cut at, and a queue.
    """

    owner: Indices
    side: NDArray[np.int8]
    distance: Indices
    keys: Floats
    queue: Indices


class Dissection(NamedTuple):
    """An order of n vertices and its tree of K blocks, children before parents.

    Vertex order[k] is eliminated k-th. Block b has the places firsts[b] to firsts[b + 1] and the
    parent parents[b], or -1. A block touches only its own unknowns and those of its descendants and
    ancestors.
    """

    order: Indices
    firsts: Indices
    parents: Indices


def dissect(graph: sp.csr_matrix, points: Floats) -> Dissection:
    """Order the vertices of a symmetric graph (n, n) that lie at points (n, 3).

    The points only guide the cuts; any graph gets a valid order.
    """
    count = graph.shape[0]
    rows = Graph(
        graph.indptr.astype(np.int32),
        graph.indices.astype(np.int32),
        np.ascontiguousarray(points, dtype=np.float64),
    )
    order, sizes, tops, parents = _dissect(rows)
    used = np.flatnonzero(sizes)  # in the order of discovery, parents first
    for block in range(len(parents)):
        while parents[block] >= 0 and sizes[parents[block]] == 0:
            parents[block] = parents[parents[block]]
    used = used[np.argsort(tops[used], kind="stable")]
    place = np.full(len(sizes) + 1, -1, dtype=np.int32)
    place[used] = np.arange(len(used))
    firsts = np.append(tops[used] - sizes[used], count).astype(np.int32)
    return Dissection(order, firsts, place[parents[used]])


@kernel
def _dissect(graph: Graph) -> tuple[Indices, Indices, Indices, Indices]:
    """Return the order, and the size, end and parent of each block, parents before children."""
    count = len(graph.points)
    order = np.arange(count).astype(np.int32)
    workspace = Workspace(
        np.zeros(count, np.int32),
        np.zeros(count, np.int8),
        np.empty(count, np.int32),
        np.empty(count),
        np.empty(count, np.int32),
    )
    most = 2 * count + 1
    sizes, tops = np.zeros(most, np.int32), np.zeros(most, np.int32)
    parents = np.full(most, -1, np.int32)
    low, high = np.zeros(most, np.int32), np.zeros(most, np.int32)
    high[0] = count
    blocks = 1
    block = 0
    while block < blocks:
        first, last = low[block], high[block]
        tops[block] = last
        part = order[first:last]
        if last - first <= LEAF:
            sizes[block] = last - first
        else:
            _cut(graph, part, np.int64(block), workspace)
            left, right = _split(part, workspace.side)
            sizes[block] = len(part) - left - right
            begin, end = first, first + left
            for _ in range(2):
                if begin < end:
                    low[blocks], high[blocks], parents[blocks] = begin, end, block
                    for k in range(begin, end):
                        workspace.owner[order[k]] = blocks
                    blocks += 1
                begin, end = end, end + right
            for k in range(first + left + right, last):
                workspace.owner[order[k]] = -1
        block += 1
    return order, sizes[:blocks], tops[:blocks], parents[:blocks]


@kernel
def _split(part: Indices, side: NDArray[np.int8]) -> tuple[int, int]:
    """Sort a part by side: 0, 1, then the separator 2; return the sizes of the first two."""
    old = part.copy()
    filled = 0
    sizes = np.zeros(3, np.int64)
    for wanted in range(3):
        for v in old:
            if side[v] == wanted:
                part[filled] = v
                filled += 1
                sizes[wanted] += 1
    return sizes[0], sizes[1]


@kernel
def _cut(graph: Graph, part: Indices, block: np.int64, workspace: Workspace) -> None:
    """Assign a side to each vertex of a part: the best of four cuts, each at the median of a key.

    The keys are the three coordinates, and the difference of the distances along edges to two far
    ends. The last key follows a limb around its bends.
    """
    side, keys = workspace.side, workspace.keys
    best = len(part) + 1
    chosen = np.zeros(len(part), np.int8)
    for candidate in range(4):
        if candidate < 3:
            for k in range(len(part)):
                keys[k] = graph.points[part[k], candidate]
        else:
            _far_ends(graph, part, block, workspace)
        middle = _median(keys[: len(part)])
        below = 0
        for k in range(len(part)):
            below += keys[k] < middle
        # Vertices whose key is the median are shared out so that both halves have the same size.
        wanted = len(part) // 2 - below
        for k in range(len(part)):
            is_left = keys[k] < middle
            if keys[k] == middle and wanted > 0:
                is_left = True
                wanted -= 1
            side[part[k]] = 0 if is_left else 1
        size = _separate(graph, part, block, workspace)
        if size < best:
            best = size
            for k in range(len(part)):
                chosen[k] = side[part[k]]
    for k in range(len(part)):
        side[part[k]] = chosen[k]


@kernel
def _median(values: Floats) -> float:
    """Return the value at len // 2 in ascending order; numba's own partition compiles for seconds.

    Source: Hoare 1961, Algorithm 65: Find.
    """
    rest = values.copy()
    wanted = len(rest) // 2
    low, high = 0, len(rest) - 1
    while low < high:
        a, b, c = rest[low], rest[(low + high) // 2], rest[high]
        pivot = max(min(a, b), min(max(a, b), c))
        i, j = low, high
        while i <= j:
            while rest[i] < pivot:
                i += 1
            while rest[j] > pivot:
                j -= 1
            if i <= j:
                rest[i], rest[j] = rest[j], rest[i]
                i += 1
                j -= 1
        if wanted <= j:
            high = j
        elif wanted >= i:
            low = i
        else:
            break
    return float(rest[wanted])


@kernel
def _separate(graph: Graph, part: Indices, block: np.int64, workspace: Workspace) -> int:
    """Make the smaller rim of the cut between sides 0 and 1 the separator; return its size."""
    starts, neighbours, owner, side = (
        graph.starts,
        graph.neighbours,
        workspace.owner,
        workspace.side,
    )
    rims = np.zeros(2, np.int64)
    for v in part:
        for h in range(starts[v], starts[v + 1]):
            u = neighbours[h]
            if owner[u] == block and side[u] != side[v]:
                rims[side[v]] += 1
                break
    thinner = 0 if rims[0] < rims[1] else 1
    for v in part:
        if side[v] == thinner:
            for h in range(starts[v], starts[v + 1]):
                u = neighbours[h]
                if owner[u] == block and side[u] == 1 - thinner:
                    side[v] = 2
                    break
    return int(rims[thinner])


@kernel
def _far_ends(graph: Graph, part: Indices, block: np.int64, workspace: Workspace) -> None:
    """Compute keys that grow from one end of a part to the other, counted along its edges."""
    starts, neighbours, owner = graph.starts, graph.neighbours, workspace.owner
    distance, queue, keys = workspace.distance, workspace.queue, workspace.keys
    far = part[0]
    for sweep in range(3):
        for v in part:
            distance[v] = -1
        distance[far] = 0
        queue[0] = far
        head, tail = 0, 1
        while head < tail:
            v = queue[head]
            head += 1
            for h in range(starts[v], starts[v + 1]):
                u = neighbours[h]
                if owner[u] == block and distance[u] < 0:
                    distance[u] = distance[v] + 1
                    queue[tail] = u
                    tail += 1
        far = queue[tail - 1]
        for k in range(len(part)):
            d = distance[part[k]]
            reached = d if d >= 0 else len(part)
            if sweep == 1:
                keys[k] = reached
            elif sweep == 2:
                keys[k] -= reached
