"""Squash and stretch: the paper's equations written out, closed forms, volumes, broken meshes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.arap import ArapSolver
from solvers.linear.laplacian import cotangent_edges, graph_laplacian
from solvers.squash_stretch import SquashStretchSolver

ENERGIES = ["spokes", "spokes-and-rims"]


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


# --- the equations, dense, in the order of the paper -----------------------------------------


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


# --- what it keeps ---------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.7, 0.85, 1.3])
@pytest.mark.parametrize("name", SHAPES)
def test_the_volume_of_a_squashed_part_stays(name: str, ratio: float):
    press = Press.on(*SHAPES[name])
    kept = [press.kept(press.pressed(press.solver(volume_gain=g), ratio)) for g in (0, 0.5, 1, 1.5)]
    assert kept[2] == pytest.approx(1.0, abs=0.05)
    assert (np.sign(1.0 - ratio) * np.diff(kept) > 0.01).all()


@pytest.mark.parametrize("name", ["teddy.obj", "cow.off", "camel_b.obj", "cgal_cactus.off"])
def test_the_volume_of_real_characters_stays(shared: Path, name: str):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.load(shared / "mesh" / name, process=True, force="mesh")
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    press = Press.on(vertices, faces, int(np.ptp(vertices, axis=0).argmax()))
    for ratio in (0.7, 1.3):
        answer = press.pressed(press.solver(), ratio, 10)
        assert press.kept(answer) == pytest.approx(1.0, abs=0.1)


def test_what_is_not_squashed_stays_as_it_is():
    """The first half of a long bar is squashed; the free tail beyond only rides along."""
    vertices, faces = cylinder(4.0)
    y = vertices[:, 1]
    handles = np.flatnonzero((y < 0.3) | (abs(y - 1.9) < 0.3))
    groups = (y[handles] > 1.0).astype(int)
    solver = SquashStretchSolver(vertices, faces, handles, groups=groups)
    for share in np.linspace(0.0, 1.0, 40):
        targets = vertices[handles] - share * 0.4 * groups[:, None] * [0.0, 1.0, 0.0]
        answer = solver.solve(targets, 3)
    tail = y > 2.3
    np.testing.assert_allclose(answer[tail], vertices[tail] - [0.0, 0.4, 0.0], atol=2e-3)
    middle = (y > 0.6) & (y < 1.3)
    assert np.linalg.norm(answer[middle][:, [0, 2]], axis=1).min() > 0.53
    assert volume(answer, faces) == pytest.approx(volume(vertices, faces), rel=0.01)


@pytest.mark.parametrize("energy", ENERGIES)
def test_rigid_is_the_rigid_solver_to_the_last_bit(energy: str):
    press = Press.on(*capsule())
    rigid = ArapSolver(*capsule(), press.handles, groups=press.groups, energy=energy)
    solver = press.solver(cartoon=0.0, energy=energy)
    for ratio in (0.9, 0.8, 1.4):
        for iterations in (0, 1, 3):
            expected = rigid.solve(press.targets(ratio), iterations)
            assert (solver.solve(press.targets(ratio), iterations) == expected).all()
    assert solver.energy == rigid.energy


@pytest.mark.parametrize("energy", [*ENERGIES, "smooth-rotations"])
def test_rigid_with_stiff_parts_is_the_rigid_solver_to_the_last_bit(energy: str):
    press = Press.on(*capsule())
    rigid = ArapSolver(*capsule(), press.handles, groups=press.groups, energy=energy)
    solver = press.solver(cartoon=0.0, energy=energy)
    upper = (press.vertices[:, 1] > 0.2).astype(int)
    for one in (rigid, solver):
        one.stiffen(upper, np.where(abs(press.vertices[:, 1]) > 0.4, 1.0, 0.0))
        one.stiffness = 0.7
    for ratio in (0.9, 1.4):
        expected = rigid.solve(press.targets(ratio), 3)
        assert (solver.solve(press.targets(ratio), 3) == expected).all()
        assert solver.energy == rigid.energy


def test_stiff_parts_turn_as_one_while_they_squash():
    vertices, faces = cylinder(4.0)
    y = vertices[:, 1]
    handles = np.flatnonzero((y < 0.3) | (y > 3.7))
    groups = (y[handles] > 2.0).astype(int)
    turn = Rotation.from_rotvec([0.0, 0.0, 1.2])
    middle = np.array([0.0, 2.0, 0.0])
    targets = vertices[handles].copy()
    targets[groups == 1] = turn.apply(0.8 * (targets[groups == 1] - middle)) + middle
    inside = (y > 0.6) & (y < 1.5)

    def spread(stiffness: float) -> float:
        solver = SquashStretchSolver(vertices, faces, handles, groups=groups)
        solver.stiffen((y > 2.0).astype(int), np.clip(4.0 * (abs(y - 2.0) - 0.2), 0.0, 1.0))
        solver.stiffness = stiffness
        for _ in range(60):
            answer = solver.solve(targets, 3)
        assert np.isfinite(answer).all()
        assert volume(answer, faces) == pytest.approx(volume(vertices, faces), rel=0.1)
        R = solver.rotations()[inside]
        np.testing.assert_allclose(
            R @ np.swapaxes(R, 1, 2), np.tile(np.eye(3), (len(R), 1, 1)), atol=1e-9
        )
        return float(np.linalg.norm(R - R.mean(axis=0), axis=(1, 2)).mean())

    assert spread(0.95) < 0.6 * spread(0.0)


def test_from_rigid_to_cartoon_without_a_step():
    press = Press.on(*capsule())
    answers = []
    for cartoon in (0.0, 1e-6, 0.25, 0.5, 0.75, 1.0):
        solver = press.solver(cartoon=cartoon)
        for _ in range(60):
            answer = solver.solve(press.targets(0.8), 3)
        answers.append(answer)
    assert abs(answers[1] - answers[0]).max() < 1e-3
    volumes = [press.kept(answer) for answer in answers]
    assert (np.diff(volumes[1:]) > 0.01).all()


def test_gain_and_cartoon_change_while_it_performs():
    press = Press.on(*capsule())
    solver, other = press.solver(), press.solver(volume_gain=0.0, cartoon=0.5)
    press.pressed(solver, 0.8)
    solver.volume_gain, solver.cartoon = 0.0, 0.5
    for _ in range(120):
        answer = solver.solve(press.targets(0.8), 3)
        expected = other.solve(press.targets(0.8), 3)
    np.testing.assert_allclose(answer, expected, atol=1e-4)


@pytest.mark.parametrize("energy", ENERGIES)
def test_rest_is_rest(energy: str):
    press = Press.on(*pear())
    solver = press.solver(energy=energy, volume_gain=1.5)
    for _ in range(5):
        answer = solver.solve(press.targets(1.0), 3)
    np.testing.assert_allclose(answer, press.vertices, atol=1e-12)
    assert solver.energy < 1e-24


def test_long_waiting_does_not_drift_and_the_way_back_ends_at_rest():
    press = Press.on(*capsule())
    solver = press.solver()
    settled = press.pressed(solver, 0.7, 60)
    for _ in range(300):
        answer = solver.solve(press.targets(0.7), 3)
    assert abs(answer - settled).max() < 5e-3
    for _ in range(60):
        answer = solver.solve(press.targets(1.0), 3)
    np.testing.assert_allclose(answer, press.vertices, atol=1e-4)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=6, deadline=None)
def test_a_rigid_motion_of_all_handles_is_met_at_once(seed: int):
    press = Press.on(*capsule())
    rng = np.random.default_rng(seed)
    solver = press.solver()
    for _ in range(3):
        turn, shift = Rotation.random(rng=rng), rng.normal(0, 5, 3)
        answer = solver.solve(turn.apply(press.targets(1.0)) + shift, 2)
        np.testing.assert_allclose(answer, turn.apply(press.vertices) + shift, atol=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_answer_turns_shifts_scales_and_renumbers_with_the_input(scale: float):
    press = Press.on(*SHAPES["tall box"])
    rng = np.random.default_rng(5)
    turn, other = Rotation.random(rng=rng), Rotation.random(rng=rng)
    name = rng.permutation(len(press.vertices))
    renamed = np.empty_like(press.vertices)
    renamed[name] = scale * turn.apply(press.vertices) + scale * 7.0
    order = rng.permutation(len(press.handles))
    solver = SquashStretchSolver(
        renamed,
        np.roll(name[press.faces], 1, axis=1)[rng.permutation(len(press.faces))],
        name[press.handles[order]],
        groups=press.groups[order],
    )
    plain = press.solver()
    for ratio in (0.9, 0.8):
        expected = scale * other.apply(plain.solve(press.targets(ratio), 4)) - scale * 2.0
        targets = scale * other.apply(press.targets(ratio)[order]) - scale * 2.0
        answer = solver.solve(targets, 4)
        assert abs(answer[name] - expected).max() < 1e-5 * scale


def test_two_runs_agree_to_the_last_bit():
    press = Press.on(*capsule())
    first, second = press.solver(), press.solver()
    for ratio in (0.9, 0.5, 1.2):
        one, two = (s.solve(press.targets(ratio), 3).tobytes() for s in (first, second))
        assert one == two


def test_handles_come_go_and_soften():
    press = Press.on(*capsule())
    solver = press.solver()
    press.pressed(solver, 0.8, 10)
    solver.weigh(np.where(press.groups == 1, 0.5, np.inf))
    soft = solver.solve(press.targets(0.5), 3)
    assert abs(soft[press.handles] - press.targets(0.5)).max() > 1e-3
    solver.hold(press.handles[press.groups == 0])
    rest = press.vertices[press.handles[press.groups == 0]]
    for _ in range(200):
        answer = solver.solve(rest, 3)
    np.testing.assert_allclose(answer, press.vertices, atol=0.03)


# --- what is thrown at it --------------------------------------------------------------------


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_degenerate_meshes_stay_finite_and_follow(energy: str, scale: float):
    rng = np.random.default_rng(7)
    vertices, faces = cylinder()
    count = len(vertices)
    extra = [vertices[0], (vertices[10] + vertices[11]) / 2, [0.0, 0.0, 9.0]]
    points = scale * np.vstack([vertices, extra])
    odd = [[0, count, 6], [10, 11, count + 1], [3, 3, 4], [0, 1, 20], [0, 1, 30], [0, 1, 40]]
    broken = np.concatenate([faces[:-30], faces[:5], faces[5:9, ::-1], odd])
    handles = np.array([0, 5, 30, 60, count, count + 1])
    solver = SquashStretchSolver(points, broken, handles, energy=energy, volume_gain=1.5)
    for spread in [1.0, 0.1] * 8:
        targets = points[handles] + scale * rng.normal(0, spread, (len(handles), 3))
        answer = solver.solve(targets, 3)
        assert np.isfinite(answer).all()
        assert np.isfinite(solver.energy)
    solver.solve(np.zeros((len(handles), 3)), 3)  # all in one point
    for _ in range(10):
        answer = solver.solve(points[handles], 3)
    assert np.isfinite(answer).all()
    solver.reset()
    np.testing.assert_allclose(solver.solve(points[handles], 3), points, atol=1e-9 * scale)


@pytest.mark.parametrize(
    ("points", "triangles", "handles"),
    [
        ([[0.0, 0, 0]], np.zeros((0, 3), int), [0]),
        ([[0.0, 0, 0]] * 5, [[0, 1, 2], [2, 3, 4]], [0, 4]),
        ([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], [0]),
        ([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0, 1, 2]),
    ],
)
def test_the_smallest_meshes_work(points: object, triangles: object, handles: object):
    vertices = np.asarray(points, dtype=float)
    solver = SquashStretchSolver(vertices, triangles, handles)
    shift = np.array([1.0, 2.0, 3.0])
    answer = solver.solve(vertices[handles] + shift, 3)
    np.testing.assert_allclose(answer, vertices + shift, rtol=1e-9, atol=1e-9)


def test_a_sheet_has_no_volume_to_keep_and_stays_flat():
    x, y = (a.ravel() for a in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    a = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 10], 1), np.stack([a, a + 10, a + 9], 1)])
    sheet = np.stack([x, y, np.zeros_like(x)], axis=1)
    solver = SquashStretchSolver(sheet, faces, np.flatnonzero((x == 0) | (x == 8)))
    for _ in range(30):
        answer = solver.solve(sheet[(x == 0) | (x == 8)] * [1.3, 1.0, 1.0], 3)
    np.testing.assert_allclose(answer[:, 2], 0.0, atol=1e-6)


@pytest.mark.parametrize("angle", [3.0, np.pi])
def test_a_jump_and_back_leaves_nothing_behind(angle: float):
    press = Press.on(*capsule())
    solver = press.solver()
    far = press.targets(0.5)
    turn = Rotation.from_rotvec([0.0, 0.3 * angle, angle])
    far[press.groups == 1] = turn.apply(far[press.groups == 1]) + np.array([3, -5, 2])
    solver.solve(far, 3)
    for _ in range(10):
        answer = solver.solve(press.targets(1.0), 3)
    np.testing.assert_allclose(answer, press.vertices, atol=1e-3)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"volume_gain": -0.1}, r"volume_gain in \[0, 10\], got -0.1"),
        ({"volume_gain": np.nan}, r"got nan"),
        ({"cartoon": 1.5}, r"cartoon in \[0, 1\], got 1.5"),
        ({"cartoon": np.nan}, r"got nan"),
        ({"energy": "none"}, "unknown energy"),
    ],
)
def test_bad_options_are_refused(options: dict, text: str):
    press = Press.on(*capsule())
    with pytest.raises(ValueError, match=text):
        press.solver(**options)
    if "energy" not in options:
        solver = press.solver()
        with pytest.raises(ValueError, match=text):
            setattr(solver, *next(iter(options.items())))
