"""Closed shapes between two patches of handles that squash or stretch them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.arap import ArapSolver
from solvers.squash_stretch import SquashStretchSolver


def revolved(radii: np.ndarray, heights: np.ndarray, around: int = 16) -> tuple:
    """A closed surface about the y axis, pole to pole; every other ring turned by half a step."""
    rings = len(radii)
    angle = 2 * np.pi * (np.arange(around) + 0.5 * (np.arange(rings)[:, None] % 2)) / around
    y = np.broadcast_to(heights[:, None], angle.shape)
    tube = np.stack([radii[:, None] * np.sin(angle), y, radii[:, None] * np.cos(angle)], -1)
    i, k = (a.ravel() for a in np.mgrid[: rings - 1, :around])
    a, b = i * around + k, i * around + (k + 1) % around
    c, d = a + around, b + around
    odd = (i % 2 == 1)[:, None]
    first = np.where(odd, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(odd, np.stack([a, d, c], 1), np.stack([b, d, c], 1))
    k, last = np.arange(around), rings * around
    low = np.stack([np.full(around, last), (k + 1) % around, k], 1)
    high = np.stack([np.full(around, last + 1), k, (k + 1) % around], 1)
    high[:, 1:] += last - around
    poles = [[0.0, 1.5 * heights[0] - 0.5 * heights[1], 0.0]]
    poles += [[0.0, 1.5 * heights[-1] - 0.5 * heights[-2], 0.0]]
    return np.vstack([tube.reshape(-1, 3), poles]), np.concatenate([first, second, low, high])


def cylinder(length: float = 2.0) -> tuple:
    return revolved(np.full(24, 0.5), np.linspace(0.0, length, 24))


def capsule() -> tuple:
    t = np.linspace(-1.35, 1.35, 30)
    return revolved(0.5 * np.sqrt(1.0 - np.clip(abs(t) - 0.85, 0, None) ** 2 / 0.26), 1.2 * t)


def pear() -> tuple:
    t = np.linspace(0.05, 0.95, 28)
    return revolved(0.5 * np.sqrt(np.sin(np.pi * t)) * (1.3 - 0.6 * t), 2.0 * t, 20)


def box(width: float = 1.0, height: float = 1.0, depth: float = 1.0, cuts: int = 8) -> tuple:
    """A box of squares cut in two, the cuts turning every other square."""
    steps = [max(2, round(cuts * side)) for side in (width, height, depth)]
    names: dict[tuple, int] = {}
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, steps[axis]):
            for i, j in np.ndindex(steps[u], steps[v]):
                corner = np.zeros((4, 3), dtype=int)
                corner[:, axis] = end
                corner[:, u] = i + np.array([0, 1, 1, 0])
                corner[:, v] = j + np.array([0, 0, 1, 1])
                quad = [names.setdefault(tuple(c), len(names)) for c in corner.tolist()]
                quad = quad if end else quad[::-1]
                quad = quad if (i + j) % 2 else quad[1:] + quad[:1]
                faces += [quad[:3], [quad[0], *quad[2:]]]
    points = np.array(list(names)) / steps * [width, height, depth]
    return points, np.array(faces)


SHAPES = {
    "cylinder": cylinder(),
    "long cylinder": cylinder(4.0),
    "capsule": capsule(),
    "pear": pear(),
    "cube": box(),
    "tall box": box(1.0, 2.0, 1.0, 7),
}


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = np.moveaxis(vertices[faces] - vertices.mean(axis=0), 1, 0)
    return float(np.einsum("fi,fi->", a, np.cross(b, c))) / 6.0


@dataclass(frozen=True)
class Press:
    """Two patches of handles at both ends of an axis, to squash or stretch what lies between."""

    vertices: np.ndarray
    faces: np.ndarray
    handles: np.ndarray
    groups: np.ndarray
    span: float
    axis: int = 1

    @classmethod
    def on(cls, vertices: np.ndarray, faces: np.ndarray, axis: int = 1) -> Press:
        height = vertices[:, axis]
        cut = 0.12 * np.ptp(height)
        low, high = height < height.min() + cut, height > height.max() - cut
        handles = np.flatnonzero(low | high)
        span = height[high].min() - height[low].max()
        return cls(vertices, faces, handles, high[handles].astype(int), float(span), axis)

    def targets(self, ratio: float) -> np.ndarray:
        """The handles, with what lies between `ratio` times as long."""
        targets = self.vertices[self.handles].copy()
        targets[self.groups == 1, self.axis] += (ratio - 1.0) * self.span
        return targets

    def solver(self, **options: object) -> SquashStretchSolver:
        return SquashStretchSolver(
            self.vertices,
            self.faces,
            self.handles,
            groups=self.groups,
            **options,
        )

    def pressed(self, solver: ArapSolver, ratio: float, frames: int = 20) -> np.ndarray:
        """The answer after a way there of some frames, and as many of waiting."""
        for share in [*np.linspace(0.0, 1.0, frames), *np.ones(frames)]:
            answer = solver.solve(self.targets(1.0 + share * (ratio - 1.0)), 3)
        return answer

    def kept(self, answer: np.ndarray) -> float:
        """The volume between the patches, which move rigidly, over the volume there at rest."""
        height = self.vertices[:, self.axis]
        low = height[self.handles[self.groups == 0]].max()
        part = _slice_volume(self.vertices, self.faces, self.axis, low, low + self.span)
        return 1.0 + (volume(answer, self.faces) - volume(self.vertices, self.faces)) / part


def _slice_volume(
    vertices: np.ndarray, faces: np.ndarray, axis: int, low: float, high: float
) -> float:
    """Volume between two planes: the shell clipped by heights, as an integral of x dy dz over it.

    Clamping heights to the planes flattens what lies beyond onto them and leaves the part between.
    """
    clamped = vertices.copy()
    clamped[:, axis] = np.clip(clamped[:, axis], low, high)
    return volume(clamped, faces)
