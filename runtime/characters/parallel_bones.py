"""Insert a node where bones that start at one joint and run side by side separate.

Some rigs attach every finger to the forearm, so that four bones lie in one arm: the limbs would
branch at the elbow, and there would be no wrist. The inserted node is the wrist; the finger bones
start there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, hstack

from devices.skeleton import Skeleton
from runtime.characters.character import Character

SIDE_BY_SIDE = np.cos(np.radians(20.0))  # least cosine between two parallel bones
SHARED = 0.85  # distance of the new node from the joint, over the shortest bone's length
LONG = 0.06  # least length of a bone, over the character's size

Array = NDArray[np.float64]


def split_parallel_bones(character: Character) -> Character:
    """Return the character with a node inserted wherever several of its bones run side by side."""
    skeleton = character.skeleton
    shortest = LONG * float(np.ptp(skeleton.rest_positions, axis=0).max())
    names, parents = list(skeleton.names), skeleton.parents.tolist()
    positions = list(skeleton.rest_positions)
    for node in range(len(skeleton.names)):
        parallel = _parallel(node, parents, positions, shortest)
        if len(parallel) < 2:
            continue
        bones = np.array([positions[child] - positions[node] for child in parallel])
        lengths = np.linalg.norm(bones, axis=1)
        way = (bones / lengths[:, None]).mean(axis=0)
        positions.append(positions[node] + SHARED * lengths.min() * way)
        names.append(f"{skeleton.names[node]} parts")
        parents.append(node)
        for child in parallel:
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


def _parallel(node: int, parents: list[int], positions: list[Array], shortest: float) -> list[int]:
    """The children of a node whose bones run along its longest bone."""
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
