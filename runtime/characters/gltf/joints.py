"""Build one skeleton from the joints of all skins of a glTF file, without idle joints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from replay.gltf.scene import Scene

Array = NDArray[np.float64]
_COINCIDENT = 1e-4
"""Joints nearer than this fraction of the rig's extent stand at the same place."""
_STEM = 0.05
"""A root nearer to the scene's origin than this fraction of the rig's extent stands on it."""


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """A skeleton, and the joint that each node of the scene moves with.

    Attributes:
        skeleton: in scene coordinates.
        joint_of: (n,) joint of each of the scene's n nodes; -1 for nodes that are no joints.
    """

    skeleton: Skeleton
    joint_of: NDArray[np.int64]


def with_connections(scene: Scene, joints: Iterable[int]) -> set[int]:
    """The joints, and all nodes between them."""
    named = set(joints)
    result = set(named)
    for joint in named:
        above = scene.ancestors(joint)
        highest = max((i for i, node in enumerate(above) if node in named), default=-1)
        result.update(above[: highest + 1])
    return result


def build_rig(
    scene: Scene, joints: set[int], weight: Array, names: list[str], *, moving: bool
) -> Rig:
    """Build one skeleton of `joints`, which are closed under `with_connections`.

    A joint at the position of its parent is merged with it. Joints that move nothing are left out,
    except the end of each bone. Several roots become children of the node above them all; if that
    node only places the rig in the scene, of the nearest joint of the largest tree.

    Args:
        scene: the node tree.
        joints: node indices.
        weight: (n,) sum of the skin weights of each node.
        names: n node names.
        moving: whether there is a surface; without one every joint is kept.
    """
    positions = scene.positions
    reach = float(np.linalg.norm(np.ptp(positions[sorted(joints)], axis=0)))
    tree = _Tree.of(scene, joints, weight, names)
    if moving:
        tree.drop_idle(positions)
    tree.drop_stem(positions, _STEM * reach, moving=moving)
    tree.merge_coincident(positions, _COINCIDENT * reach)
    roots = tree.roots()
    if len(roots) > 1:
        above = _above_all(scene, roots)
        if above is None or tree.places(above, positions, _STEM * reach):
            tree.graft(positions)
        else:
            tree.join(roots, above)
    return tree.rig(positions, len(scene.parents))


def _above_all(scene: Scene, nodes: list[int]) -> int | None:
    common = scene.ancestors(nodes[0])
    for node in nodes[1:]:
        among = set(scene.ancestors(node))
        common = [other for other in common if other in among]
    return common[0] if common else None


class _Tree:
    """Joints while they are pruned.

    Attributes:
        parent: each joint's parent joint, -1 for roots; parents come before their children.
        names: of all nodes.
        became: the joint that each merged joint moves with.
        weight: sum of the skin weights of each node.
    """

    def __init__(self, parent: dict[int, int], weight: Array, names: list[str]) -> None:
        self.parent = parent
        self.names = list(names)
        self.became: dict[int, int] = {}
        self.weight = weight.copy()

    @classmethod
    def of(cls, scene: Scene, joints: set[int], weight: Array, names: list[str]) -> _Tree:
        above = {joint: scene.ancestors(joint) for joint in joints}
        parent: dict[int, int] = {}
        for joint in sorted(joints, key=lambda joint: (len(above[joint]), joint)):
            parent[joint] = next((node for node in above[joint] if node in joints), -1)
        return cls(parent, weight, names)

    def children(self) -> dict[int, list[int]]:
        below: dict[int, list[int]] = {joint: [] for joint in self.parent}
        for joint, parent in self.parent.items():
            if parent >= 0:
                below[parent].append(joint)
        return below

    def merge_coincident(self, positions: Array, reach: float) -> None:
        """Merge each joint at its parent's position; the name of the one with more weight stays."""
        for joint in list(self.parent):
            parent = self.became.get(self.parent[joint], self.parent[joint])
            self.parent[joint] = parent
            if parent < 0 or np.linalg.norm(positions[joint] - positions[parent]) > reach:
                continue
            if self.weight[joint] > self.weight[parent]:
                self.names[parent] = self.names[joint]
            self.weight[parent] += self.weight[joint]
            self.became[joint] = parent
            del self.parent[joint]

    def drop_idle(self, positions: Array) -> None:
        """Drop joints without weight, also below them, except the farthest end of each bone."""
        below = self.children()
        busy: dict[int, bool] = {}
        for joint in reversed(list(self.parent)):
            busy[joint] = self.weight[joint] > 0.0 or any(busy[child] for child in below[joint])
        keep = {joint for joint in self.parent if busy[joint]}
        for joint in list(keep):
            if below[joint] and not any(busy[child] for child in below[joint]):
                reach = np.linalg.norm(positions[below[joint]] - positions[joint], axis=1)
                keep.add(below[joint][int(np.argmax(reach))])
        self.parent = {joint: self.parent[joint] for joint in self.parent if joint in keep}

    def roots(self) -> list[int]:
        """The joints without a parent."""
        return [joint for joint, parent in self.parent.items() if parent < 0]

    def places(self, joint: int, positions: Array, reach: float) -> bool:
        """Whether a joint only places the rig in the scene: at the origin, without weight."""
        return self.weight[joint] == 0.0 and float(np.linalg.norm(positions[joint])) <= reach

    def drop_stem(self, positions: Array, reach: float, *, moving: bool) -> None:
        """Drop roots that are no part of the body.

        A root with one child goes if it moves nothing, one with several if it only places the rig.
        Without a surface, a root with one child goes if it only places the rig.
        """
        below = self.children()
        waiting = self.roots()
        for joint in waiting:
            idle = self.weight[joint] == 0.0 and moving
            places = self.places(joint, positions, reach)
            forked = any(below[child] for child in below[joint])
            lone = len(below[joint]) == 1
            if forked and ((lone and (idle or places)) or (idle and places)):
                del self.parent[joint]
                self.parent.update(dict.fromkeys(below[joint], -1))
                waiting.extend(below[joint])

    def graft(self, positions: Array) -> None:
        """Attach smaller trees, such as feet below an IK root, to the largest tree."""
        below = self.children()
        trees = {root: [root] for root in self.roots()}
        for joints in trees.values():
            for joint in joints:
                joints.extend(below[joint])
        trunk = max(trees, key=lambda root: len(trees[root]))
        stock = np.array(trees.pop(trunk))
        for root in trees:
            gap = np.linalg.norm(positions[stock] - positions[root], axis=1)
            self.parent[root] = int(stock[np.argmin(gap)])

    def join(self, roots: list[int], above: int) -> None:
        """Make all roots children of a new root."""
        self.parent = {above: -1} | self.parent | dict.fromkeys(roots, above)

    def rig(self, positions: Array, nodes: int) -> Rig:
        """The skeleton of the remaining joints, and the joint of each node of the scene."""
        joints = list(self.parent)
        place = {joint: number for number, joint in enumerate(joints)}
        joint_of = np.full(nodes, -1, dtype=np.int64)
        for joint, number in place.items():
            if joint < nodes:
                joint_of[joint] = number
        for joint, heir in self.became.items():
            joint_of[joint] = place.get(heir, -1)
        parents = [place.get(self.parent[joint], -1) for joint in joints]
        names = unique_names([self.names[joint] for joint in joints])
        return Rig(Skeleton(names, np.array(parents), positions[joints]), joint_of)


def unique_names(names: list[str]) -> tuple[str, ...]:
    """The names, with a number appended to repeated ones."""
    taken = set(names)
    seen: set[str] = set()
    result: list[str] = []
    for name in names:
        fresh, number = name, 2
        while fresh in seen or (fresh != name and fresh in taken):
            fresh, number = f"{name}.{number}", number + 1
        seen.add(fresh)
        result.append(fresh)
    return tuple(result)
