"""The surface that the benchmarks deform: a torus with any number of vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def torus(count: int) -> tuple[Floats, Ints]:
    """Return a torus of about `count` vertices with nearly equilateral triangles."""
    across = round((count * 0.35) ** 0.5)
    along = round(count / across)
    u, v = np.meshgrid(np.arange(along), np.arange(across), indexing="ij")
    a = (u * across + v).ravel()
    b = ((u + 1) % along * across + v).ravel()
    c = ((u + 1) % along * across + (v + 1) % across).ravel()
    d = (u * across + (v + 1) % across).ravel()
    big, small = 2 * np.pi * u / along, 2 * np.pi * v / across
    ring = 1.0 + 0.35 * np.cos(small)
    vertices = np.stack([ring * np.cos(big), 0.35 * np.sin(small), ring * np.sin(big)], axis=-1)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return vertices.reshape(-1, 3), faces.astype(np.int64)


def pulled_patch(vertices: Floats) -> tuple[Ints, Floats]:
    """Return two opposite patches of 1 % as handles (H,), and targets (H, 3) that move one away."""
    order = np.argsort(vertices[:, 0], kind="stable")
    patch = max(1, len(vertices) // 100)
    handles = np.concatenate([order[:patch], order[-patch:]])
    targets = vertices[handles]
    targets[patch:] += [0.3, 0.2, 0.1]
    return handles, targets
