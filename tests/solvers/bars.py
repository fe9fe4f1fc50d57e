"""A round bar whose ends are bent: the mesh of many tests of deformation."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def bar(rings: int = 40, around: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """A closed round bar along x, of length 4 and radius 0.5, Delaunay everywhere."""
    x = np.linspace(0.0, 4.0, rings)
    angle = 2 * np.pi * (np.arange(around) + 0.5 * (np.arange(rings)[:, None] % 2)) / around
    tube = np.stack(
        [np.broadcast_to(x[:, None], angle.shape), 0.5 * np.cos(angle), 0.5 * np.sin(angle)], -1
    ).reshape(-1, 3)
    i, k = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    i, k = i.ravel(), k.ravel()
    a, b = i * around + k, i * around + (k + 1) % around
    c, d = a + around, b + around
    odd = (i % 2 == 1)[:, None]
    first = np.where(odd, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(odd, np.stack([a, d, c], 1), np.stack([b, d, c], 1))
    last = len(tube)
    k = np.arange(around)
    start = np.stack([np.full(around, last), (k + 1) % around, k], 1)
    end = np.stack([np.full(around, last + 1), k, (k + 1) % around], 1)
    end[:, 1:] += last - around
    return np.vstack([tube, [-0.1, 0, 0], [4.1, 0, 0]]), np.concatenate([first, second, start, end])


def ends(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Handles at both ends of the bar, and their groups."""
    handles = np.flatnonzero((vertices[:, 0] < 0.25) | (vertices[:, 0] > 3.75))
    return handles, (vertices[handles, 0] > 2.0).astype(int)


def bent(vertices: np.ndarray, handles: np.ndarray, groups: np.ndarray, angle: float) -> np.ndarray:
    """Targets with the second group of handles turned about the middle by `angle` [rad]."""
    targets = vertices[handles].copy()
    turn = Rotation.from_rotvec([0.0, 0.2 * angle, angle])
    middle = np.array([2.0, 0.0, 0.0])
    targets[groups == 1] = turn.apply(targets[groups == 1] - middle) + middle
    return targets


def stretch(vertices: np.ndarray, faces: np.ndarray, answer: np.ndarray) -> np.ndarray:
    """The relative change of length of each side of each face."""
    a, b = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    rest = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    return abs(np.linalg.norm(answer[a] - answer[b], axis=1) / rest - 1.0)
