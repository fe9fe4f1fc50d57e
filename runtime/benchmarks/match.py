"""Benchmark: matching a performer with a character, and driving it, each frame.

It matches performers with 2 to 5 branches against characters of 200 nodes, with a budget of 0.5 ms,
and computes the motion of such a match, from joints to all nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from solvers.matching import SIZE_PREFERENCE, Match, TargetHierarchy
from solvers.retarget.chain_retargets import ChainRetargets
from solvers.retarget.polyline_motion import map_chain
from solvers.retarget.source_limbs import simplify
from solvers.skeleton.forward_kinematics import SkeletonPose
from solvers.skeleton.tree import Tree

BUDGET_MS = 0.5
FRAMES = 300
NODES = 200
_VIEW = np.eye(3)

Figures = dict[str, float]


def run() -> dict[str, object]:
    """Print and return a table: milliseconds at the median and the 99th percentile."""
    targets = {"tentacles": _star(8), "sea urchin": _star(40), "bush": _bush()}
    matching: dict[str, Figures] = {}
    print(f"match: {NODES} nodes, best 20 of all, {FRAMES} poses; budget {BUDGET_MS} ms")
    print(f"{'character':>12} {'branches':>8} {'p50 ms':>8} {'p99 ms':>8} {'motion':>8}")
    for name, target in targets.items():
        start = perf_counter()
        hierarchy = TargetHierarchy(target)
        built = 1e3 * (perf_counter() - start)
        for branches in (2, 3, 4, 5):
            source = _star(branches, count=3 * branches + 1)
            figures = _measure(hierarchy, source) | {"build": built}
            matching[f"{name}, {branches} branches"] = figures
            print(
                f"{name:>12} {branches:>8} {figures['p50']:8.3f} {figures['p99']:8.3f}"
                f" {figures['motion_p50']:8.3f}"
            )
    return {"budget_ms": BUDGET_MS, "nodes": NODES, "match_ms": matching}


def _measure(hierarchy: TargetHierarchy, rest: Tree) -> Figures:
    source = simplify(rest)
    rng = np.random.default_rng(0)
    poses = rest.positions + rng.normal(scale=0.03, size=(FRAMES, *rest.positions.shape))

    def match(pose: NDArray[np.float64]) -> list[Match]:
        return hierarchy.rank(source, _VIEW, pose, size_preference=SIZE_PREFERENCE)

    best = match(poses[0])[0]
    drive = _driver(hierarchy.tree, rest, best)
    drive(poses[0])
    matched, moved = _times(match, poses), _times(drive, poses)
    return {
        "p50": float(np.median(matched)),
        "p99": float(np.percentile(matched, 99)),
        "motion_p50": float(np.median(moved)),
        "motion_p99": float(np.percentile(moved, 99)),
    }


def _driver(target: Tree, rest: Tree, match: Match) -> Callable[[NDArray[np.float64]], object]:
    """Return the work of a frame with a chosen match: rotations of all chains, then all nodes."""
    sources = [list(source) for source, _ in match.pairs]
    driven = [list(chain) for _, chain in match.pairs]
    maps = [
        map_chain(rest.positions[joints], target.positions[nodes], _VIEW, _VIEW)
        for joints, nodes in zip(sources, driven, strict=True)
    ]
    skeleton, chains = SkeletonPose(target, match.root, driven), ChainRetargets(maps, sources)
    gains = np.ones(len(maps))
    return lambda pose: skeleton.place(chains.rotations(pose, gains))


def _times(
    function: Callable[[NDArray[np.float64]], object], poses: NDArray[np.float64]
) -> list[float]:
    """Return the milliseconds for each pose."""
    times = []
    for pose in poses:
        start = perf_counter()
        function(pose)
        times.append(1e3 * (perf_counter() - start))
    return times


def _star(arms: int, count: int = NODES) -> Tree:
    """Return arms of equal length around one node, in the screen plane."""
    each = (count - 1) // arms
    parents, positions = [-1], [(0.0, 0.0, 0.0)]
    for arm in range(arms):
        angle = 2.0 * np.pi * (arm + 0.3) / arms
        for step in range(1, each + 1):
            parents.append(len(parents) - 1 if step > 1 else 0)
            positions.append((step / each * np.cos(angle), step / each * np.sin(angle), 0.0))
    return Tree(np.array(parents), np.array(positions))


def _bush() -> Tree:
    """Return a tree with many forks, such as the skeleton of a surface with fringes."""
    rng = np.random.default_rng(1)
    parents, positions = [-1], [np.zeros(3)]
    for node in range(1, NODES):
        parents.append(node - 1 if rng.random() < 0.75 else int(rng.integers(0, node)))
        positions.append(positions[parents[-1]] + 0.1 * rng.normal(size=3))
    return Tree(np.array(parents), np.array(positions))
