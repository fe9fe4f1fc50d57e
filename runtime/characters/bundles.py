"""Bones that run side by side are one limb until they part.

Some rigs hang every finger on the forearm itself, so that four bones lie in one arm. The forearm
would then be the place where limbs part, and the wrist no place at all. A node is put in where they
really part, and the bones hang on it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, hstack

from devices.skeleton import Skeleton
from runtime.characters.character import Character

SIDE_BY_SIDE = np.cos(np.radians(20.0))  # of the angle between two bones of a bundle
SHARED = 0.85  # of the shortest bone's length lies in the bundle
LONG = 0.06  # of the character's size; what is shorter needs no wrist

Array = NDArray[np.float64]


def unbundled(character: Character) -> Character:
    """The character with a node put in wherever several bones of its skeleton run side by side."""
    skeleton = character.skeleton
    shortest = LONG * float(np.ptp(skeleton.rest_positions, axis=0).max())
    names, parents = list(skeleton.names), skeleton.parents.tolist()
    positions = list(skeleton.rest_positions)
    for node in range(len(skeleton.names)):
        bundle = _bundle(node, parents, positions, shortest)
        if len(bundle) < 2:
            continue
        bones = np.array([positions[child] - positions[node] for child in bundle])
        lengths = np.linalg.norm(bones, axis=1)
        way = (bones / lengths[:, None]).mean(axis=0)
        positions.append(positions[node] + SHARED * lengths.min() * way)
        names.append(f"{skeleton.names[node]} parts")
        parents.append(node)
        for child in bundle:
            parents[child] = len(names) - 1
    added = len(names) - len(skeleton.names)
    if added == 0:
        return character
    weights = character.weights
    if weights is not None:
        weights = csr_array(hstack([weights, csr_array((weights.shape[0], added))]))
    return replace(
        character,
        skeleton=Skeleton(tuple(names), np.array(parents), np.array(positions)),
        weights=weights,
    )


def _bundle(node: int, parents: list[int], positions: list[Array], shortest: float) -> list[int]:
    """The children of a node whose bones run along the longest one's."""
    children = [child for child, parent in enumerate(parents) if parent == node]
    bones = [positions[child] - positions[node] for child in children]
    lengths = [float(np.linalg.norm(bone)) for bone in bones]
    if len(children) < 2 or max(lengths) <= shortest:
        return []
    longest = bones[int(np.argmax(lengths))] / max(lengths)
    return [
        child
        for child, bone, length in zip(children, bones, lengths, strict=True)
        if length > shortest and bone @ longest > SIDE_BY_SIDE * length
    ]
