"""Slow reference versions of the papers' equations in NumPy, which our solvers are compared with.

The figures compare our solvers with them: as-rigid-as-possible deformation (Sorkine and
Alexa 2007), the scaled-shape state (Celikcan et al. 2015, eqs. (4) to (9)), and deformation under
one constraint on the whole volume (in the manner of Huang et al. 2006, Subspace gradient domain
mesh deformation, section 3; in the full space, with the one multiplier found along its gradient).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.sparse.csgraph import connected_components

from solvers.linear.laplacian import Floats, Ints, cotangent_edges, graph_laplacian


class PlainSolver:
    """Solves for one surface: vertices (N, 3), faces (F, 3), and handles (H,) at their targets."""

    def __init__(self, vertices: Floats, faces: Ints, handles: Ints) -> None:
        edges = cotangent_edges(vertices, faces)
        self._rest, self._faces, self._handles = vertices, faces, handles
        self._tails = np.concatenate([edges.pairs[:, 0], edges.pairs[:, 1]])
        self._heads = np.concatenate([edges.pairs[:, 1], edges.pairs[:, 0]])
        self._weights = np.tile(edges.weights, 2)
        self._edges = vertices[self._tails] - vertices[self._heads]
        count = len(vertices)
        slots = np.arange(len(self._tails))
        self._sum = sp.csr_matrix((np.ones(len(slots)), (self._tails, slots)), (count, len(slots)))
        laplacian = graph_laplacian(edges, count)
        # A component without a handle stays at rest.
        _, part_of = connected_components(laplacian, directed=False)
        is_free = np.isin(part_of, part_of[handles])
        is_free[handles] = False
        self._free = np.flatnonzero(is_free)
        self._coupling = laplacian[self._free][:, handles]
        self._factor = spla.splu(sp.csc_matrix(laplacian[self._free][:, self._free]))
        self._volume = volume(vertices, faces)

    def cold_start(self, targets: Floats) -> Floats:
        """Return the first guess for handles at their targets (H, 3), without rotations.

        Source: Celikcan et al. 2015, eq. (3); Lipman et al. 2004.
        """
        x = self._rest.copy()
        x[self._handles] = targets
        return self.global_step(x, np.tile(np.eye(3), (len(x), 1, 1)))

    def rigid_step(self, x: Floats) -> Floats:
        """Do a local and a global step. Sorkine and Alexa 2007, eqs. (6) and (9)."""
        return self.global_step(x, self.rigid_cells(x))

    def whole_volume_step(self, x: Floats) -> Floats:
        """Do a local and a global step under one hard constraint: the whole volume is kept.

        The stationary point of the energy plus a multiplier times the volume lies along L^-1 times
        the volume's gradient; Newton's method finds the multiplier.
        """
        x = self.rigid_step(x)
        push = np.zeros_like(x)
        push[self._free] = self._factor.solve(volume_gradient(x, self._faces)[self._free])
        multiplier = 0.0
        for _ in range(5):
            moved = x + multiplier * push
            slope = float((volume_gradient(moved, self._faces) * push).sum())
            if not slope > 0.0:  # a sheet has no volume to keep
                break
            multiplier -= (volume(moved, self._faces) - self._volume) / slope
        return x + multiplier * push

    def rigid_energy(self, x: Floats) -> float:
        """Return the energy with the best rotations. Sorkine and Alexa 2007, eq. (7)."""
        return self.energy(x, self.rigid_cells(x))

    def _summed(self, terms: Floats) -> Floats:
        flat: Floats = self._sum @ terms.reshape(len(terms), -1)
        return flat.reshape(-1, *terms.shape[1:])

    def rigid_cells(self, x: Floats) -> Floats:
        """Return each vertex's best rotation (N, 3, 3). Sorkine and Alexa 2007, eq. (6)."""
        moved = self._weights[:, None] * (x[self._tails] - x[self._heads])
        S = self._summed(moved[:, :, None] * self._edges[:, None, :])
        U, _, Vt = np.linalg.svd(S)
        U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
        R: Floats = U @ Vt
        return R

    def scaled_cells(self, x: Floats) -> Floats:
        """Return each vertex's best rotation and scale (N, 3, 3). Celikcan et al., eqs. (5-7)."""
        R = self.rigid_cells(x)
        return self._scales(x, R)[:, None, None] * R

    def _scales(self, x: Floats, R: Floats) -> Floats:
        turned = np.einsum("eij,ej->ei", R[self._tails], self._edges)
        moved = x[self._tails] - x[self._heads]
        above = self._summed(self._weights * np.einsum("ei,ei->e", moved, turned))
        below = self._summed(self._weights * np.einsum("ei,ei->e", turned, turned))
        return above / np.maximum(below, 1e-300)

    def global_step(self, x: Floats, matrices: Floats) -> Floats:
        """Return the surface (N, 3) that suits the cells' matrices best. Eq. (9) of both papers."""
        mean = 0.5 * (matrices[self._tails] + matrices[self._heads])
        pull = self._weights[:, None] * np.einsum("eij,ej->ei", mean, self._edges)
        moved = x.copy()
        b = self._summed(pull)[self._free] - self._coupling @ x[self._handles]
        moved[self._free] = self._factor.solve(b)
        return moved

    def energy(self, x: Floats, matrices: Floats) -> float:
        """Return the energy with the cells' matrices (N, 3, 3). Celikcan et al. 2015, eq. (4)."""
        shaped = np.einsum("eij,ej->ei", matrices[self._tails], self._edges)
        error = x[self._tails] - x[self._heads] - shaped
        return float(self._weights @ np.einsum("ei,ei->e", error, error))


def volume(vertices: Floats, faces: Ints) -> float:
    """Return the volume inside a closed surface: vertices (N, 3), faces (F, 3)."""
    a, b, c = (vertices[faces[:, corner]] - vertices[0] for corner in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c))) / 6.0


def volume_gradient(vertices: Floats, faces: Ints) -> Floats:
    """Return the gradient (N, 3) of the volume with respect to each vertex."""
    gradient = np.zeros_like(vertices)
    corners = [vertices[faces[:, corner]] - vertices[0] for corner in range(3)]
    for corner in range(3):
        across = np.cross(corners[(corner + 1) % 3], corners[(corner + 2) % 3])
        np.add.at(gradient, faces[:, corner], across / 6.0)
    return gradient
