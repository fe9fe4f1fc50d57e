"""Squash and stretch beside the paper's equations, written out with dense matrices."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.linear.laplacian import cotangent_edges, graph_laplacian
from solvers.squash_stretch import SquashStretchSolver
from tests.solvers.press import SHAPES, Press, cylinder, pear, revolved

ENERGIES = ["spokes", "spokes-and-rims"]


class Plain:
    """Equations (4) to (13) as they are written, with dense matrices, from a cold start."""

    def __init__(self, press: Press) -> None:
        self.rest, self.faces = press.vertices, press.faces
        edges = cotangent_edges(press.vertices, press.faces)
        self.L = graph_laplacian(edges, len(press.vertices)).toarray()
        i, j = edges.pairs.T
        self.i, self.j = np.concatenate([i, j]), np.concatenate([j, i])
        self.w = np.tile(edges.weights, 2)
        self.e = self.rest[self.i] - self.rest[self.j]
        self.free = np.ones(len(self.rest), dtype=bool)
        self.free[press.handles] = False

    def summed(self, terms: np.ndarray) -> np.ndarray:
        out = np.zeros((len(self.rest), *terms.shape[1:]))
        np.add.at(out, self.i, terms)
        return out

    def rotations(self, x: np.ndarray) -> np.ndarray:
        """Eqs. (5) and (6)."""
        M = self.summed(np.einsum("e,ei,ej->eij", self.w, self.e, x[self.i] - x[self.j]))
        U, _, Vt = np.linalg.svd(M)
        R = np.swapaxes(U @ Vt, 1, 2)
        U[:, :, 2] *= np.sign(np.linalg.det(R))[:, None]
        return np.swapaxes(U @ Vt, 1, 2)

    def scales(self, x: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Eq. (8)."""
        turned = np.einsum("eij,ej->ei", R[self.i], self.e)
        above = self.summed(self.w * np.einsum("ei,ei->e", x[self.i] - x[self.j], turned))
        return above / self.summed(self.w * np.einsum("ei,ei->e", turned, turned))

    def surface(self, x: np.ndarray, T: np.ndarray) -> np.ndarray:
        """Eq. (9), or (13) with V R in place of s R."""
        both = 0.5 * (T[self.i] + T[self.j])
        b = self.summed(np.einsum("e,eij,ej->ei", self.w, both, self.e))
        free, moved = self.free, x.copy()
        b = (b - self.L[:, ~free] @ x[~free])[free]
        moved[free] = np.linalg.solve(self.L[np.ix_(free, free)], b)
        return moved

    def shape_step(self, x: np.ndarray) -> np.ndarray:
        R = self.rotations(x)
        return self.surface(x, self.scales(x, R)[:, None, None] * R)

    def energy(self, x: np.ndarray) -> float:
        """Eq. (4)."""
        R = self.rotations(x)
        T = self.scales(x, R)[self.i, None, None] * R[self.i]
        error = x[self.i] - x[self.j] - np.einsum("eij,ej->ei", T, self.e)
        return float((self.w * (error**2).sum(axis=1)).sum())

    def axes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Eq. (11): the primary axis of each vertex, and how much it stands out."""
        R = self.rotations(x)
        error = x[self.i] - x[self.j] - np.einsum("eij,ej->ei", R[self.i], self.e)
        values, vectors = np.linalg.eigh(
            self.summed(np.einsum("e,ei,ej->eij", self.w, error, error))
        )
        return vectors[:, :, 2], values[:, 1] / values[:, 2]


def start(press: Press, ratio: float) -> np.ndarray:
    """Where both begin: the surface moved along with the handles."""
    solver = press.solver()
    return solver.solve(press.targets(ratio), 0)


@pytest.mark.parametrize("ratio", [0.7, 1.3])
@pytest.mark.parametrize("name", ["capsule", "tall box"])
def test_the_shape_state_is_equations_4_to_9(name: str, ratio: float):
    press = Press.on(*SHAPES[name])
    plain, solver, x = Plain(press), press.solver(), start(press, ratio)
    for _ in range(6):
        solver.solve(press.targets(ratio), 2)  # one of each state
        x = plain.shape_step(x)
        assert solver.energy == pytest.approx(plain.energy(x), rel=1e-4)


@pytest.mark.parametrize("ratio", [0.7, 1.3])
@pytest.mark.parametrize("name", ["capsule", "tall box"])
def test_without_volume_the_pose_is_the_intermediary_rotated_but_not_scaled(
    name: str, ratio: float
):
    press = Press.on(*SHAPES[name])
    plain, solver, x = Plain(press), press.solver(volume_gain=0.0), start(press, ratio)
    for _ in range(4):
        answer = solver.solve(press.targets(ratio), 2)
        x = plain.shape_step(x)
        expected = plain.surface(x, plain.rotations(x))
        assert abs(answer - expected).max() < 2e-5
    matrices = solver.cell_matrices()
    identity = matrices @ np.swapaxes(matrices, 1, 2)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-12)


def test_a_cell_is_scaled_as_equations_8_10_and_12_say():
    """All vertices are handles of a tube stretched along its axis: everything is known."""
    vertices, faces = cylinder()
    inside = (vertices[:, 1] > 0.3) & (vertices[:, 1] < 1.7)
    for stretch, gain in [(1.4, 1.0), (0.6, 1.0), (1.4, 0.5), (0.6, 1.5), (0.4, 1.0)]:
        solver = SquashStretchSolver(vertices, faces, np.arange(len(vertices)), volume_gain=gain)
        solver.solve(vertices * [1.0, stretch, 1.0], 2)
        np.testing.assert_allclose(solver.scales[inside], stretch, rtol=2e-3)
        g = 1.0 + gain * (stretch - 1.0)
        expected = np.diag([g**-0.5, g, g**-0.5])
        np.testing.assert_allclose(
            solver.cell_matrices()[inside],
            np.broadcast_to(expected, (inside.sum(), 3, 3)),
            atol=5e-3,
        )


def test_the_axis_is_that_of_equation_11_where_a_cell_is_stretched():
    vertices, faces = pear()
    press = Press.on(vertices, faces)
    x = vertices * [1.0, 1.3, 1.0] + 0.2 * vertices[:, 1:2] ** 2 * [1.0, 0.0, 0.0]
    axis, spread = Plain(press).axes(x)
    solver = SquashStretchSolver(vertices, faces, np.arange(len(vertices)))
    solver.solve(x, 2)
    V = solver.cell_matrices() @ np.swapaxes(Plain(press).rotations(x), 1, 2)
    _, vectors = np.linalg.eigh(0.5 * (V + np.swapaxes(V, 1, 2)))
    ours = np.where((solver.scales > 1.0)[:, None], vectors[:, :, 2], vectors[:, :, 0])
    clear = (spread < 0.1) & (abs(solver.scales - 1.0) > 0.05)
    assert clear.sum() > 0.5 * len(vertices)
    along = abs(np.einsum("ni,ni->n", ours, axis))[clear]
    assert np.quantile(along, 0.05) > 0.95


@pytest.mark.parametrize("energy", ENERGIES)
def test_cells_keep_their_volume_whatever_happens(energy: str):
    press = Press.on(*pear())
    rng = np.random.default_rng(4)
    for gain in (0.3, 1.0, 2.0):
        solver = press.solver(volume_gain=gain, energy=energy)
        targets = press.targets(0.6) + rng.normal(0, 0.1, (len(press.handles), 3))
        solver.solve(targets, 3)
        np.testing.assert_allclose(np.linalg.det(solver.cell_matrices()), 1.0, rtol=1e-9)


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("scale", [0.5, 0.8, 1.3, 2.0])
def test_a_sphere_scaled_by_all_its_handles_scales_every_cell(energy: str, scale: float):
    angle = np.linspace(0.15, np.pi - 0.15, 14)
    vertices, faces = revolved(np.sin(angle), -np.cos(angle), 18)
    handles = np.arange(0, len(vertices), 3)
    everything = SquashStretchSolver(vertices, faces, np.arange(len(vertices)), energy=energy)
    everything.solve(scale * vertices, 2)
    np.testing.assert_allclose(everything.scales, scale, rtol=1e-5)
    assert everything.energy < 1e-18 * len(vertices)
    solver = SquashStretchSolver(vertices, faces, handles, energy=energy)
    for _ in range(60):
        solver.solve(scale * vertices[handles], 2)
    assert solver.energy < 1e-8 * len(vertices)
    np.testing.assert_allclose(solver.scales, scale, rtol=1e-3)
