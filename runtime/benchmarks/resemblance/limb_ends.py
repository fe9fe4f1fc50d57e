"""Whether the ends of limbs keep their volume: measures crushed hands and feet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Chain
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]

DISTAL = 0.2  # of a limb's length: its end
CRUSHED = 5.0  # percentile of the frames that tells how far an end is crushed
_FEWEST = 8  # triangles of an end
_FLAT = 0.02  # of the 3/2 power of its area (a ball: 0.094): an end of less volume is a sheet


class LimbEnds:
    """The ends of the arms and legs of a character, whose volumes are followed over a show.

    Args:
        vertices: (N, 3) [m] at rest.
        faces: (F, 3) triangles.
        tree: the nodes at rest.
        plan: which of them are limbs.
    """

    def __init__(self, vertices: Array, faces: Indices, tree: Tree, plan: BodyPlan) -> None:
        tree = tree.rerooted(plan.hips)  # a bone is told by its outer node
        owner, share = _nearest_bones(vertices, tree)
        self._faces: dict[str, Indices] = {}
        self._rest: dict[str, float] = {}
        self._volumes: dict[str, list[float]] = {}
        for name, limbs in (("arm", plan.arms), ("leg", plan.legs)):
            for side in SIDES:
                if side not in limbs:
                    continue
                is_end = _is_end(limbs[side].chain, tree, owner, share)
                own = faces[is_end[faces].all(axis=1)]
                volume = _volume(vertices, own)
                if len(own) >= _FEWEST and abs(volume) > _FLAT * _area(vertices, own) ** 1.5:
                    key = f"{side} {name}"
                    self._faces[key], self._rest[key], self._volumes[key] = own, volume, []

    def add(self, vertices: Array) -> None:
        """Take in the deformed vertices (N, 3) [m] of a frame."""
        for name, faces in self._faces.items():
            self._volumes[name].append(_volume(vertices, faces) / self._rest[name])

    @property
    def kept(self) -> dict[str, float]:
        """The share of its volume that each end keeps in the frames that crush it most."""
        return {
            name: float(np.percentile(volumes, CRUSHED))
            for name, volumes in self._volumes.items()
            if volumes
        }


def _nearest_bones(vertices: Array, tree: Tree) -> tuple[Indices, Array]:
    """The far node of the bone nearest to each vertex (N,), and where along it (N,), 0 to 1."""
    best = np.full(len(vertices), np.inf)
    owner, share = np.zeros(len(vertices), dtype=np.int64), np.zeros(len(vertices))
    for node, parent in enumerate(tree.parents):
        if parent < 0:
            continue
        start, bone = tree.positions[parent], tree.positions[node] - tree.positions[parent]
        along = (vertices - start) @ bone / max(float(bone @ bone), 1e-12)
        along = np.clip(along, 0.0, 1.0)
        gap = np.linalg.norm(vertices - start - along[:, None] * bone, axis=1)
        nearer = gap < best
        best[nearer], owner[nearer], share[nearer] = gap[nearer], node, along[nearer]
    return owner, share


def _is_end(chain: Chain, tree: Tree, owner: Indices, share: Array) -> Flags:
    """Whether each vertex (N,) is beyond the greatest part of a limb, or on what hangs there."""
    bones = np.linalg.norm(np.diff(tree.positions[list(chain)], axis=0), axis=1)
    far = np.append(0.0, bones.cumsum())
    begins = (1.0 - DISTAL) * far[-1]
    is_end = np.zeros(len(owner), dtype=np.bool_)
    for number in range(1, len(chain)):
        on_bone = owner == chain[number]
        is_end |= on_bone & (far[number - 1] + share * bones[number - 1] > begins)
        if far[number] > begins:
            beyond = set(tree.subtree(chain[number])) - set(chain)
            is_end |= np.isin(owner, list(beyond))
    return is_end


def _volume(vertices: Array, faces: Indices) -> float:
    """The signed volume [m^3] within a piece of surface and the cone that closes it."""
    if not len(faces):
        return 0.0
    corners = vertices[faces]
    a, b, c = np.moveaxis(corners - vertices[np.unique(faces)].mean(axis=0), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6.0)


def _area(vertices: Array, faces: Indices) -> float:
    """The area [m^2] of a piece of surface."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
