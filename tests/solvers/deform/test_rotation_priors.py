"""Smooth rotations and stiff segments: their energies never rise."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.arap import ArapSolver
from solvers.deform.arap_cells import SPOKES, SPOKES_AND_RIMS, build_cells
from solvers.deform.rotation_priors import HALF, RotationPriors
from tests.solvers.bars import bar, bent, ends


def limbs_of(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The bar as an upper and a lower arm, rigid but for a radius about the elbow in its middle."""
    gap = abs(vertices[:, 0] - 2.0) / 0.5
    return (vertices[:, 0] > 2.0).astype(int) * 7 - 3, np.clip(gap, 0.0, 1.0)


def make(
    energy: str, stiffness: float, rings: int = 24, around: int = 10
) -> tuple[ArapSolver, np.ndarray, np.ndarray, np.ndarray]:
    vertices, faces = bar(rings, around)
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, energy=energy, groups=groups)
    solver.stiffen(*limbs_of(vertices))
    solver.stiffness = stiffness
    return solver, vertices, handles, groups


TIED = [
    ("smooth-rotations", 0.0),
    ("spokes", 0.5),
    ("spokes", 0.95),
    ("spokes-and-rims", 0.8),
    ("smooth-rotations", 0.9),
]


@pytest.mark.parametrize(("energy", "stiffness"), TIED)
@given(seed=st.integers(0, 10_000))
@settings(max_examples=4, deadline=None)
def test_energy_never_rises(energy: str, stiffness: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = bar(24, 10)
    vertices = vertices + rng.normal(0, 0.03, vertices.shape)  # obtuse angles, negative cotangents
    handles = rng.choice(len(vertices), 12, replace=False)
    solver = ArapSolver(vertices, faces, handles, energy=energy)
    solver.stiffen(*limbs_of(vertices))
    solver.stiffness = stiffness
    targets = vertices[handles] + rng.normal(0, 0.7, (12, 3))
    solver.solve(targets, 0)
    last = solver.energy
    for _ in range(25):
        solver.solve(targets, 1)
        now = solver.energy
        assert now <= last * (1 + 1e-12)
        last = now


@pytest.mark.parametrize("name", [SPOKES, SPOKES_AND_RIMS])
def test_the_terms_are_those_of_the_papers(name: str) -> None:
    vertices, faces = bar(12, 8)
    mesh = build_cells(vertices, faces, name)
    rng = np.random.default_rng(3)
    R = Rotation.random(len(vertices), rng=rng).as_matrix()
    priors = RotationPriors(mesh, vertices, 0.7)
    region_of, rigidity = limbs_of(vertices)
    L = mesh.laplacian.toarray()
    smooth = sum(
        max(-L[k, j], 0.0) * ((R[k] - R[j]) ** 2).sum()
        for k in range(len(L))
        for j in np.flatnonzero(L[k])
        if j != k
    )
    assert priors.energy(R.reshape(-1, 9)) == pytest.approx(0.7 * smooth)

    terms = mesh.terms
    squares = ((vertices[terms.tails] - vertices[terms.heads]) ** 2).sum(axis=1)
    masses = np.bincount(terms.cells, terms.weights * squares, minlength=len(vertices)) * rigidity
    stiff = 0.0
    for region in np.unique(region_of):
        own = region_of == region
        U, _, Vt = np.linalg.svd(np.einsum("n,nij->ij", masses[own], R[own]))
        Q = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
        stiff += float(masses[own] @ ((R[own] - Q) ** 2).sum(axis=(1, 2)))
    priors = RotationPriors(mesh, vertices, 0.0)
    priors.stiffen(region_of, rigidity)
    priors.stiffness = 0.75
    assert priors.energy(R.reshape(-1, 9)) == pytest.approx(HALF * 3.0 * stiff)


def test_no_stiffness_is_plain_arap_to_the_last_bit() -> None:
    solver, vertices, handles, groups = make("spokes", 0.0)
    plain = ArapSolver(vertices, bar(24, 10)[1], handles, groups=groups)
    for angle in (0.3, 0.6, 2.5, 0.1):
        targets = bent(vertices, handles, groups, angle)
        assert (solver.solve(targets, 2) == plain.solve(targets, 2)).all()


def test_stiff_limbs_stay_straight_and_the_joint_bends() -> None:
    def spread(stiffness: float) -> float:
        """How far the rotations within a limb lie apart, the mean over both limbs [rad]."""
        solver, vertices, handles, groups = make("spokes", stiffness)
        for angle in np.linspace(0.0, 1.5, 10):
            solver.solve(bent(vertices, handles, groups, angle), 2)
        for _ in range(60):
            solver.solve(bent(vertices, handles, groups, 1.5), 2)
        region_of, rigidity = limbs_of(vertices)
        turns = Rotation.from_matrix(solver.rotations())
        parts = [turns[(region_of == name) & (rigidity == 1.0)] for name in np.unique(region_of)]
        return float(np.mean([(part.mean().inv() * part).magnitude().mean() for part in parts]))

    bending = [spread(stiffness) for stiffness in (0.0, 0.5, 0.95)]
    assert bending[0] > 0.09  # the plain bar bends all along
    assert 0.3 * bending[0] < bending[1] < 0.8 * bending[0]
    assert bending[2] < 0.2 * bending[0]


def test_smooth_rotations_bend_evenly_where_handles_are_few() -> None:
    def unevenness(energy: str) -> float:
        """The largest turn between neighbouring rings over the mean one."""
        rings, around = 60, 24
        vertices, faces = bar(rings, around)
        handles = np.flatnonzero((vertices[:, 0] <= 0.0) | (vertices[:, 0] >= 4.0))
        groups = (vertices[handles, 0] > 2.0).astype(int)
        solver = ArapSolver(vertices, faces, handles, energy=energy, groups=groups)
        for angle in np.linspace(0.0, 2.0, 10):
            solver.solve(bent(vertices, handles, groups, angle), 4)
        for _ in range(100):
            solver.solve(bent(vertices, handles, groups, 2.0), 4)
        turned = solver.rotations()[: rings * around].reshape(rings, around, 3, 3)
        turns = Rotation.from_matrix(turned.mean(axis=1))
        between = (turns[:-1].inv() * turns[1:]).magnitude()
        return float(between.max() / between.mean())

    assert unevenness("smooth-rotations") < 0.5 * unevenness("spokes-and-rims")


@pytest.mark.parametrize(("energy", "stiffness"), TIED)
def test_a_rigid_motion_of_all_handles_is_met_at_once(energy: str, stiffness: float) -> None:
    solver, vertices, handles, _ = make(energy, stiffness)
    rng = np.random.default_rng(1)
    for _ in range(4):
        turn, shift = Rotation.random(rng=rng), rng.normal(0, 3, 3)
        answer = solver.solve(turn.apply(vertices[handles]) + shift, 2)
        assert abs(answer - turn.apply(vertices) - shift).max() < 1e-8


@pytest.mark.parametrize(("energy", "stiffness"), TIED)
def test_reading_the_energy_changes_nothing(energy: str, stiffness: float) -> None:
    def perform(look: bool) -> bytes:
        solver, vertices, handles, groups = make(energy, stiffness)
        answer = np.empty(0)
        for angle in (0.2, 0.4, 1.5, 0.1):
            answer = solver.solve(bent(vertices, handles, groups, angle), 2)
            if look:
                assert np.isfinite(solver.energy)
        return answer.tobytes()

    assert perform(True) == perform(False)


@pytest.mark.parametrize(("energy", "stiffness"), TIED)
def test_any_number_of_threads_gives_the_same_bits(energy: str, stiffness: float) -> None:
    def perform(threads: int) -> bytes:
        before = numba.get_num_threads()
        numba.set_num_threads(min(threads, before))
        try:
            solver, vertices, handles, groups = make(energy, stiffness, rings=300, around=16)
            for angle in (0.2, 0.4, 1.5):
                answer = solver.solve(bent(vertices, handles, groups, angle), 2)
            return answer.tobytes()
        finally:
            numba.set_num_threads(before)

    assert perform(1) == perform(2)


def test_stiffness_may_be_turned_up_while_bent() -> None:
    solver, vertices, handles, groups = make("spokes", 0.0)
    targets = bent(vertices, handles, groups, 1.2)
    for _ in range(30):
        before = solver.solve(targets, 2)
    solver.stiffness = 0.9
    last = np.inf
    for _ in range(10):
        answer = solver.solve(targets, 2)
        assert solver.energy <= last * (1 + 1e-12)
        last = solver.energy
    assert abs(answer - before).max() > 1e-3
    solver.stiffness = 0.0
    for _ in range(200):
        answer = solver.solve(targets, 2)
    np.testing.assert_allclose(answer, before, atol=2e-2)


@pytest.mark.parametrize(
    ("region_of", "rigidity", "message"),
    [
        (np.zeros(4, int), np.ones(3), r"regions of shape \(3,\), got \(4,\)"),
        (np.zeros(3), np.ones(3), "integer regions"),
        (np.zeros(3, int), np.ones(2), r"rigidity of shape \(3,\), got \(2,\)"),
        (np.zeros(3, int), [0.0, 1.5, 0.0], r"rigidity in \[0, 1\]"),
        (np.zeros(3, int), [0.0, np.nan, 0.0], r"rigidity in \[0, 1\]"),
    ],
)
def test_bad_regions_are_named(region_of: object, rigidity: object, message: str) -> None:
    solver = ArapSolver(np.eye(3), [[0, 1, 2]], [0])
    with pytest.raises(ValueError, match=message):
        solver.stiffen(region_of, rigidity)


@pytest.mark.parametrize("stiffness", [-0.1, 1.0, np.nan])
def test_bad_stiffness_is_named(stiffness: float) -> None:
    solver = ArapSolver(np.eye(3), [[0, 1, 2]], [0])
    with pytest.raises(ValueError, match=r"stiffness in \[0, 1\)"):
        solver.stiffness = stiffness
    assert solver.stiffness == 0.0
