"""Surfaces of revolution with nearly regular triangles."""

from __future__ import annotations

import numpy as np

from solvers.linear.laplacian import Floats, Ints


def revolved(x: Floats, radii: Floats, around: int) -> tuple[Floats, Ints]:
    """Return a closed surface about the x axis: rings at x (R,) of radii (R,), a pole at each end.

    Every other ring is turned by half a step. It has R * around + 2 vertices; faces face outward.
    """
    rings = len(x)
    angle = 2 * np.pi * (np.arange(around) + 0.5 * (np.arange(rings)[:, None] % 2)) / around
    long = np.broadcast_to(x[:, None], angle.shape)
    circle = np.stack([long, radii[:, None] * np.cos(angle), radii[:, None] * np.sin(angle)], -1)
    i, k = (index.ravel() for index in np.mgrid[: rings - 1, :around])
    a, b = i * around + k, i * around + (k + 1) % around
    c, d = a + around, b + around
    odd = (i % 2 == 1)[:, None]
    first = np.where(odd, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(odd, np.stack([a, d, c], 1), np.stack([b, d, c], 1))
    k, last = np.arange(around), rings * around
    start = np.stack([np.full(around, last), (k + 1) % around, k], axis=1)
    end = np.stack([np.full(around, last + 1), k, (k + 1) % around], axis=1)
    end[:, 1:] += last - around
    poles = [[1.5 * x[0] - 0.5 * x[1], 0.0, 0.0], [1.5 * x[-1] - 0.5 * x[-2], 0.0, 0.0]]
    faces = np.concatenate([first, second, start, end]).astype(np.int64)
    return np.vstack([circle.reshape(-1, 3), poles]), faces
