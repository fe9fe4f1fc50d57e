"""As-rigid-as-possible deformation: closed forms, invariants, broken meshes, libigl beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.arap import ArapSolver
from solvers.linear.laplacian import graph_laplacian, half_cotangents, sum_over_faces
from tests.solvers.bars import bar, bent, ends, stretch

ENERGIES = ["spokes", "spokes-and-rims"]


@pytest.mark.parametrize("energy", ENERGIES)
def test_rest_handles_give_the_rest_pose(energy: str):
    vertices, faces = bar()
    handles, _ = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, energy=energy)
    np.testing.assert_allclose(solver.solve(vertices[handles]), vertices, atol=1e-13)
    assert solver.energy < 1e-25


def test_one_free_vertex_of_a_flat_fan_meets_the_closed_form():
    """Four right triangles around a centre, rim pulled out: the spokes stretch by half."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    solver = ArapSolver(vertices, faces, [1, 2, 3, 4])
    stretched = 1.5 * vertices[1:]
    np.testing.assert_allclose(solver.solve(stretched, 50)[0], [0, 0, 0], atol=1e-12)
    # Each spoke weighs one, is half too long, and lies in two cells, whose rotation is the
    # identity; a rim edge opposite right angles weighs (almost) nothing.
    assert solver.energy == pytest.approx(4 * 2 * 0.5**2, rel=1e-5)


@pytest.mark.parametrize("energy", ENERGIES)
@given(seed=st.integers(0, 10_000), spread=st.sampled_from([0.01, 1.0, 100.0]))
@settings(max_examples=8, deadline=None)
def test_rigid_motion_of_all_handles_is_met_at_once(energy: str, seed: int, spread: float):
    vertices, faces = bar(20, 9)
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, energy=energy, groups=groups)
    rng = np.random.default_rng(seed)
    for _ in range(3):
        turn = Rotation.random(rng=rng)
        shift = rng.normal(0, spread, 3)
        answer = solver.solve(turn.apply(vertices[handles]) + shift)
        error = abs(answer - turn.apply(vertices) - shift).max()
        assert error < 1e-9 * max(4.0, spread)


@pytest.mark.parametrize("energy", ENERGIES)
def test_handles_are_met_to_the_last_bit(energy: str):
    vertices, faces = bar()
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, energy=energy, groups=groups)
    targets = bent(vertices, handles, groups, 1.0) * 1.0000001 + 1 / 3
    assert (solver.solve(targets, 2)[handles] == targets).all()


@pytest.mark.parametrize("energy", ENERGIES)
@given(seed=st.integers(0, 10_000))
@settings(max_examples=6, deadline=None)
def test_energy_never_rises(energy: str, seed: int):
    vertices, faces = bar(24, 10)
    rng = np.random.default_rng(seed)
    vertices = vertices + rng.normal(0, 0.03, vertices.shape)  # obtuse angles, negative cotangents
    handles = rng.choice(len(vertices), 12, replace=False)
    solver = ArapSolver(vertices, faces, handles, energy=energy)
    targets = vertices[handles] + rng.normal(0, 0.7, (12, 3))
    solver.solve(targets, 0)
    last = solver.energy
    for _ in range(25):
        solver.solve(targets, 1)
        now = solver.energy
        assert now <= last * (1 + 1e-12)
        last = now


def _textbook_iteration(
    vertices: np.ndarray, faces: np.ndarray, answer: np.ndarray, free: np.ndarray, energy: str
) -> np.ndarray:
    """One local and one global step as the papers write them, with dense double precision."""
    halves = half_cotangents(vertices, faces)
    S = np.zeros((len(vertices), 3, 3))
    terms = []
    for corner in range(3):
        a, b = faces[:, (corner + 1) % 3], faces[:, (corner + 2) % 3]
        cells = [a, b] if energy == "spokes" else [a, b, faces[:, corner]]
        terms += [(c, a, b, halves[:, corner], len(cells)) for c in cells]
    for c, a, b, w, _ in terms:
        edges = np.einsum("e,ei,ej->eij", w, answer[a] - answer[b], vertices[a] - vertices[b])
        np.add.at(S, c, edges)
    U, _, Vt = np.linalg.svd(S)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    R = U @ Vt
    b_side = np.zeros_like(vertices)
    for c, a, b, w, sharing in terms:
        pull = np.einsum("e,eij,ej->ei", w / sharing, R[c], vertices[a] - vertices[b])
        np.add.at(b_side, a, pull)
        np.add.at(b_side, b, -pull)
    edges = sum_over_faces(faces, halves, len(vertices))
    L = graph_laplacian(edges, len(vertices)).toarray()
    moved = answer.copy()
    b_side -= L[:, ~free] @ answer[~free]
    moved[free] = np.linalg.solve(L[np.ix_(free, free)], b_side[free])
    return moved


@pytest.mark.parametrize("energy", ENERGIES)
def test_iterations_are_the_textbooks(energy: str):
    vertices, faces = bar(30, 12)
    handles, groups = ends(vertices)
    free = np.ones(len(vertices), dtype=bool)
    free[handles] = False
    targets = bent(vertices, handles, groups, 1.5)
    solver = ArapSolver(vertices, faces, handles, energy=energy, groups=groups)
    expected = solver.solve(targets, 0)
    for _ in range(5):
        expected = _textbook_iteration(vertices, faces, expected, free, energy)
        np.testing.assert_allclose(solver.solve(targets, 1), expected, atol=3e-6)


@pytest.mark.parametrize("energy", ENERGIES)
def test_energy_after_equal_iterations_is_no_higher_than_libigls(energy: str):
    igl = pytest.importorskip("igl")
    vertices, faces = bar(60, 24)
    handles, groups = ends(vertices)
    targets = bent(vertices, handles, groups, 1.5)
    ours = ArapSolver(vertices, faces, handles, energy=energy, groups=groups)
    theirs = ours.solve(targets, 0)
    judge = ArapSolver(vertices, faces, np.arange(len(vertices)), energy=energy)
    data = igl.ARAPData()
    data.energy = {
        "spokes": igl.ARAP_ENERGY_TYPE_SPOKES,
        "spokes-and-rims": igl.ARAP_ENERGY_TYPE_SPOKES_AND_RIMS,
    }[energy]
    data.max_iter = 1
    igl.arap_precomputation(vertices, faces.astype(np.int64), 3, handles.astype(np.int32), data)
    # Not more: libigl fits rotations in single precision, and its path parts from the exact one, to
    # either side, by 1e-7 of the energy an iteration.
    for _ in range(5):
        answer = ours.solve(targets, 1)
        theirs = igl.arap_solve(targets, data, theirs)
        judge.solve(theirs, 0)
        limit = judge.energy
        judge.solve(answer, 0)
        assert judge.energy <= limit * (1 + 1e-6)
    assert judge.energy == pytest.approx(ours.energy, rel=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_answer_turns_shifts_scales_and_renumbers_with_the_input(scale: float):
    vertices, faces = bar()
    handles, groups = ends(vertices)
    targets = bent(vertices, handles, groups, 1.2)
    plain = ArapSolver(vertices, faces, handles, groups=groups).solve(targets, 8)
    rng = np.random.default_rng(5)
    turn, other = Rotation.random(rng=rng), Rotation.random(rng=rng)
    new_name = rng.permutation(len(vertices))
    renamed = np.empty_like(vertices)
    renamed[new_name] = scale * turn.apply(vertices) + scale * 7.0
    order = rng.permutation(len(handles))
    solver = ArapSolver(
        renamed,
        np.roll(new_name[faces], 1, axis=1)[rng.permutation(len(faces))],
        new_name[handles[order]],
        groups=10 - 3 * groups[order],
    )
    answer = solver.solve(scale * other.apply(targets[order]) - scale * 2.0, 8)
    expected = scale * other.apply(plain) - scale * 2.0
    assert abs(answer[new_name] - expected).max() < 2e-6 * scale


def test_two_runs_agree_to_the_last_bit():
    vertices, faces = bar()
    handles, groups = ends(vertices)

    def perform() -> bytes:
        solver = ArapSolver(vertices, faces, handles, groups=groups)
        frames = [bent(vertices, handles, groups, a) for a in (0.1, 0.2, 2.5, 0.3)]
        return b"".join(solver.solve(targets, 2).tobytes() for targets in frames)

    first = perform()
    assert perform() == first


@pytest.mark.parametrize("energy", ["spokes", "spokes-and-rims", "smooth-rotations"])
def test_an_iteration_after_the_answer_counts_as_one_before_it(energy: str):
    vertices, faces = bar()
    handles, groups = ends(vertices)
    goals = bent(vertices, handles, groups, 0.3)
    waiting, early = (ArapSolver(vertices, faces, handles, energy=energy) for _ in range(2))
    wanted = waiting.solve(goals, 3)
    given = early.solve(goals, 1)
    shown = given.copy()
    early.settle(2)
    np.testing.assert_array_equal(given, shown)  # what was given out stays
    np.testing.assert_allclose(early.solve(goals, 0), wanted, rtol=0, atol=1e-12)


def test_who_settles_finds_the_way_back_to_rest_between_frames():
    vertices, faces = bar(rings=20, around=8)
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, groups=groups)
    for degrees in 29.0 * np.arange(1, 9):  # the end of a bar, over half a turn; none is a jump
        goals = vertices[handles].copy()
        turn = Rotation.from_rotvec([np.radians(degrees), 0.0, 0.0])
        goals[groups == 1] = turn.apply(goals[groups == 1])
        solver.solve(goals, 1)
    twisted = solver.energy
    solver.settle(4)
    assert solver.energy < 0.5 * twisted  # it is less far the other way round


def test_reset_forgets():
    vertices, faces = bar()
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, groups=groups)
    targets = bent(vertices, handles, groups, 0.4)
    first = solver.solve(targets, 2)
    assert abs(solver.solve(targets, 2) - first).max() > 1e-9
    solver.reset()
    assert (solver.solve(targets, 2) == first).all()


@pytest.mark.parametrize("angle", [np.pi / 2, 3.0, np.pi])
def test_a_jump_and_back_leaves_nothing_behind(angle: float):
    vertices, faces = bar()
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, groups=groups)
    solver.solve(vertices[handles], 1)
    far = bent(vertices, handles, groups, angle)
    far[groups == 1] += [3.0, -5.0, 2.0]
    solver.solve(far, 1)
    answer = solver.solve(vertices[handles], 1)
    for _ in range(10):
        answer = solver.solve(vertices[handles], 1)
    assert abs(answer - vertices).max() < 1e-6


def test_a_jump_of_half_a_turn_of_everything_is_met_at_once():
    vertices, faces = bar()
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, groups=groups)
    targets = bent(vertices, handles, groups, 1.0)
    before = solver.solve(targets, 30)
    energy = solver.energy
    turn = Rotation.from_rotvec([0, np.pi, 0])
    after = solver.solve(turn.apply(targets), 1)
    assert solver.energy <= energy * (1 + 1e-9)
    assert abs(after - turn.apply(before)).max() < 1e-2


def test_a_component_without_handles_is_carried_rigidly_by_the_nearest_group():
    vertices, faces = bar(20, 8)
    count = len(vertices)
    near_right = 0.1 * vertices + [4.5, 0.0, 0.0]
    both = np.vstack([vertices, near_right, [-0.5, 0, 0]])  # and a vertex without a face
    handles, groups = ends(vertices)
    solver = ArapSolver(both, np.concatenate([faces, faces + count]), handles, groups=groups)
    targets = bent(vertices, handles, groups, 1.3)
    alone = ArapSolver(vertices, faces, handles, groups=groups)
    for _ in range(4):
        answer = solver.solve(targets, 2)
        np.testing.assert_allclose(answer[:count], alone.solve(targets, 2), atol=1e-5)
    turn = Rotation.from_rotvec([0.0, 0.26, 1.3])
    pivot = np.array([2.0, 0, 0])
    carried = turn.apply(near_right - pivot) + pivot
    np.testing.assert_allclose(answer[count:-1], carried, atol=1e-12)
    np.testing.assert_allclose(answer[-1], [-0.5, 0, 0], atol=1e-12)


@pytest.mark.parametrize("energy", ENERGIES)
def test_degenerate_meshes_stay_finite_and_follow(energy: str):
    rng = np.random.default_rng(7)
    vertices, faces = bar(12, 6)
    count = len(vertices)
    extra = np.concatenate(
        [
            vertices[:1],  # a duplicate of vertex 0
            (vertices[10:11] + vertices[11:12]) / 2,  # on an edge
            [[0.0, 0.0, 9.0]],  # without a face
        ]
    )
    broken = np.concatenate(
        [
            faces,
            faces[:5],  # twice
            faces[5:9, ::-1],  # wound the other way
            [[0, count, 6]],  # a needle of no width
            [[10, 11, count + 1]],  # a cap of no height
            [[3, 3, 4]],  # a corner twice
            [[0, 1, 20], [0, 1, 30], [0, 1, 40]],  # five faces on an edge
        ]
    )
    points = np.concatenate([vertices, extra])
    handles = np.array([0, 5, 30, 60, count, count + 1])
    solver = ArapSolver(points, broken, handles, energy=energy)
    for _ in range(20):
        targets = points[handles] + rng.normal(0, 1.0, (len(handles), 3))
        answer = solver.solve(targets, 2)
        assert np.isfinite(answer).all()
        assert np.isfinite(solver.energy)
    turn = Rotation.random(rng=rng)
    solver.reset()
    answer = solver.solve(turn.apply(points[handles]) + 1.0)
    assert abs(answer - turn.apply(points) - 1.0).max() < 1e-8


@pytest.mark.parametrize(
    ("points", "triangles", "handles"),
    [
        ([[0.0, 0, 0]], np.zeros((0, 3), int), [0]),
        ([[0.0, 0, 0]] * 5, [[0, 1, 2], [2, 3, 4]], [0, 4]),
        ([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], [0]),
        ([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0, 1, 2]),
        ([[1e6, 0, 0], [1e6 + 1e-3, 0, 0], [1e6, 1e-3, 0]], [[0, 1, 2]], [1]),
    ],
)
def test_the_smallest_meshes_work(points: object, triangles: object, handles: object):
    vertices = np.asarray(points, dtype=float)
    solver = ArapSolver(vertices, triangles, handles)
    shift = np.array([1.0, 2.0, 3.0])
    answer = solver.solve(vertices[handles] + shift, 3)
    np.testing.assert_allclose(answer, vertices + shift, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", ["truck.obj", "cgal_degtri_sliding.off", "beetle.off"])
def test_real_broken_meshes_bend_without_a_nan(shared: Path, name: str):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.load(shared / "mesh" / "bad" / name, process=False, force="mesh")
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    rng = np.random.default_rng(0)
    handles = rng.choice(len(vertices), max(6, len(vertices) // 50), replace=False)
    size = np.ptp(vertices, axis=0).max()
    for energy in ENERGIES:
        solver = ArapSolver(vertices, faces, handles, energy=energy)
        for _ in range(5):
            targets = vertices[handles] + rng.normal(0, 0.05 * size, (len(handles), 3))
            answer = solver.solve(targets, 2)
            assert np.isfinite(answer).all()
            assert abs(answer - vertices).max() < 10 * size
        turn = Rotation.random(rng=rng)
        solver.reset()
        moved = solver.solve(turn.apply(vertices[handles]))
        assert abs(moved - turn.apply(vertices)).max() < 1e-8 * size


def test_an_arm_bends_over_many_frames_without_tearing():
    vertices, faces = bar(60, 20)
    handles, groups = ends(vertices)
    solver = ArapSolver(vertices, faces, handles, groups=groups)
    for angle in np.linspace(0.0, 1.5, 16):
        answer = solver.solve(bent(vertices, handles, groups, angle), 3)
    assert np.percentile(stretch(vertices, faces, answer), 99) < 0.5
