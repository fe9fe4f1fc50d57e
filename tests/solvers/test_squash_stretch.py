"""Squash and stretch: closed forms, volumes, settings, and broken meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.arap import ArapSolver
from solvers.squash_stretch import SquashStretchSolver
from tests.solvers.press import SHAPES, Press, capsule, cylinder, pear, volume

ENERGIES = ["spokes", "spokes-and-rims"]


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
