"""A few shapes whose weighted sums give each frame of a moving surface to a stated distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class CorrectiveShapes:
    """Shapes that grow in number until their sums reach every frame that was added.

    The frames come in pieces. What the shapes cannot reach of a piece is split into its principal
    components, and the strongest of them become new shapes, as few as are needed. The reduced
    basis of Alexa & Mueller 2000, "Representing animations by principal components", section 3,
    here to a bound on the greatest distance and piece by piece. Shapes are orthogonal, so later
    ones do not change the weights of earlier ones.

    Args:
        vertices: N, how many the surface has.
        within: the greatest distance of a vertex from its place, in the unit of the frames.

    Attributes:
        shapes: (S, N, 3) orthonormal as rows of 3 N numbers.
    """

    def __init__(self, vertices: int, within: float) -> None:
        self._rows = np.zeros((0, 3 * vertices))
        self._within = within

    @property
    def shapes(self) -> Array:
        """The shapes (S, N, 3)."""
        return self._rows.reshape(len(self._rows), self._rows.shape[1] // 3, 3)

    def add(self, frames: NDArray[np.floating]) -> None:
        """Add the shapes that frames (F, N, 3) need; the time grows with F cubed."""
        rows = _rows(frames).astype(np.float64)
        missing = self._missing(rows)
        if self._is_beyond(missing):
            # Faint components are neither orthogonal to one another nor to the shapes at first.
            found = _orthonormal(self._missing(_orthonormal(self._components(missing))))
            self._rows = np.concatenate([self._rows, found])

    def weights(self, frames: NDArray[np.floating]) -> Array:
        """Return the weights (F, S) of the shapes whose sums are nearest to frames (F, N, 3)."""
        weights: Array = _rows(frames) @ self._rows.T
        return weights

    def distances(self, frames: NDArray[np.floating], weights: NDArray[np.floating]) -> Array:
        """Return the distances (F, N) between frames and the sums of the shapes."""
        return _lengths(_rows(frames) - weights @ self._rows)

    def _missing(self, rows: Array) -> Array:
        """What the shapes do not reach; twice, because rounding leaves some of it."""
        once = rows - (rows @ self._rows.T) @ self._rows
        missing: Array = once - (once @ self._rows.T) @ self._rows
        return missing

    def _is_beyond(self, rows: Array) -> bool:
        return bool(rows.size) and float(_lengths(rows).max()) > self._within

    def _components(self, rows: Array) -> Array:
        """The fewest principal components of rows (F, 3 N) that leave nothing beyond the bound."""
        energies, turns = np.linalg.eigh(rows @ rows.T)
        turns = turns[:, ::-1][:, energies[::-1] > 1e-14 * energies[-1]]  # the strongest first
        few, enough = 1, turns.shape[1]
        while few < enough:
            count = (few + enough) // 2
            kept = turns[:, :count]
            if self._is_beyond(rows - kept @ (kept.T @ rows)):
                few = count + 1
            else:
                enough = count
        components: Array = turns[:, :few].T @ rows
        return components


def _rows(frames: NDArray[np.floating]) -> NDArray[np.floating]:
    """Frames (F, N, 3) as rows of 3 N numbers."""
    return frames.reshape(len(frames), 3 * frames.shape[1])


def _orthonormal(rows: Array) -> Array:
    """Orthonormal rows that span the same."""
    unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    spanning: Array = np.linalg.qr(unit.T)[0].T
    return spanning


def _lengths(rows: NDArray[np.floating]) -> Array:
    lengths: Array = np.linalg.norm(rows.reshape(len(rows), rows.shape[1] // 3, 3), axis=2)
    return lengths
