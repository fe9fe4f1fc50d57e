"""Read the node tree of a glTF file: parents and world transforms.

Source: Khronos, "glTF 2.0 Specification", section 3.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from replay.gltf.checked_json import Entry
from replay.gltf.file import GltfFile

MOST_NODES = 30_000
MOST_DEPTH = 1_000


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """All n nodes of a file, in its default pose.

    Attributes:
        parents: (n,) each node's parent, -1 for roots.
        to_scene: (n, 4, 4) takes a node's coordinates to the scene's.
        drawn: the nodes of the default scene, each parent before its children, in file order.
    """

    parents: NDArray[np.int64]
    to_scene: NDArray[np.float64]
    drawn: tuple[int, ...]

    @property
    def positions(self) -> NDArray[np.float64]:
        """The positions (n, 3) of the nodes."""
        return self.to_scene[:, :3, 3]

    def ancestors(self, node: int) -> list[int]:
        """The nodes above `node`, the nearest first."""
        above: list[int] = []
        parent = int(self.parents[node])
        while parent >= 0:
            above.append(parent)
            parent = int(self.parents[parent])
        return above


def read_scene(file: GltfFile) -> Scene:
    """Read the node tree.

    Raises:
        ContentError: it is no forest, or a transform is not finite.
    """
    nodes = _with_lone_meshes(file)
    if len(nodes) > MOST_NODES:
        raise ContentError(f"it has {len(nodes)} nodes, more than {MOST_NODES}; simplify the scene")
    children = [node.wholes("children", below=len(nodes)) for node in nodes]
    parents = np.full(len(nodes), -1, dtype=np.int64)
    for index, below in enumerate(children):
        for child in below:
            if parents[child] >= 0:
                raise nodes[child].wrong("it hangs on two nodes")
            parents[child] = index
    roots = [int(root) for root in np.flatnonzero(parents < 0)]
    order = _depth_first(roots, children)
    if len(order) < len(nodes):
        raise ContentError("its nodes form a cycle; export the model again")
    depth = np.zeros(len(nodes), dtype=np.int64)
    for node in order:
        depth[node] = 0 if parents[node] < 0 else depth[parents[node]] + 1
    if len(nodes) and depth.max() > MOST_DEPTH:
        raise ContentError(f"its nodes nest deeper than {MOST_DEPTH}; simplify the scene")
    to_scene = np.empty((len(nodes), 4, 4))
    with np.errstate(all="ignore"):  # overflow is refused below
        for node in order:
            local = local_transform(nodes[node])
            to_scene[node] = local if parents[node] < 0 else to_scene[parents[node]] @ local
    if not (np.abs(to_scene) < 1e15).all():
        raise ContentError("the transform of a node is beyond all bounds; export the model again")
    drawn = _depth_first(_scene_roots(file, roots), children)
    if not any("mesh" in nodes[node] for node in drawn) and any("mesh" in node for node in nodes):
        file.notes["the default scene draws no mesh: all of the file's are used"] = None
        drawn = _depth_first(roots, children)
    return Scene(parents, to_scene, tuple(drawn))


def _with_lone_meshes(file: GltfFile) -> list[Entry]:
    """The nodes; where none of them has a mesh, followed by one for each mesh of the file."""
    nodes = file.entries("nodes")
    meshes = len(file.entries("meshes"))
    if meshes and not any("mesh" in node for node in nodes):
        file.notes["no node draws a mesh: all of the file's are used as they are"] = None
        nodes += [Entry({"mesh": mesh}, f"the node of mesh {mesh}") for mesh in range(meshes)]
    return nodes


def _scene_roots(file: GltfFile, roots: list[int]) -> list[int]:
    if not file.entries("scenes"):
        return roots
    scene = file.entry("scenes", file.document.whole("scene", 0))
    named = scene.wholes("nodes", below=len(file.entries("nodes")))
    return list(dict.fromkeys(root for root in named if root in set(roots)))


def _depth_first(roots: list[int], children: list[list[int]]) -> list[int]:
    order: list[int] = []
    waiting = list(reversed(roots))
    while waiting:
        node = waiting.pop()
        order.append(node)
        waiting.extend(reversed(children[node]))
    return order


def local_transform(node: Entry) -> NDArray[np.float64]:
    """A node's matrix (4, 4), given as it is or by translation, rotation and scale."""
    if "matrix" in node:
        matrix: NDArray[np.float64] = node.numbers("matrix", (0.0,) * 16).reshape(4, 4).T
        return matrix
    x, y, z, w = node.numbers("rotation", (0.0, 0.0, 0.0, 1.0))
    length = x * x + y * y + z * z + w * w
    if not length > 0.0:
        raise node.wrong("its rotation is no quaternion")
    transform = np.eye(4)
    # Normalised by the squared length in place: files hold quaternions rounded to float32.
    turn = np.array(
        [
            [y * y + z * z, w * z - x * y, -w * y - x * z],
            [-w * z - x * y, x * x + z * z, w * x - y * z],
            [w * y - x * z, -w * x - y * z, x * x + y * y],
        ]
    )
    transform[:3, :3] = np.eye(3) - 2.0 / length * turn
    transform[:3, :3] *= node.numbers("scale", (1.0, 1.0, 1.0))
    transform[:3, 3] = node.numbers("translation", (0.0, 0.0, 0.0))
    return transform
