"""Deformation under hostile input: broken meshes, absurd handles, and recovery from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.arap import ENERGIES, ArapSolver
from solvers.squash_stretch import SquashStretchSolver
from tests.solvers.bars import bar, bent, ends, stretch

Targets = Iterator[np.ndarray]

SOFT = [False, True]
KINDS = [*ENERGIES, "stiff", "squash"]
FRAMES = 10  # that an inverted triangle may survive


def make(
    kind: str,
    vertices: np.ndarray,
    faces: np.ndarray,
    handles: np.ndarray,
    groups: np.ndarray,
    weights: np.ndarray | None = None,
) -> ArapSolver:
    if kind == "squash":
        return SquashStretchSolver(vertices, faces, handles, groups=groups, weights=weights)
    energy = "spokes" if kind == "stiff" else kind
    solver = ArapSolver(vertices, faces, handles, energy=energy, groups=groups, weights=weights)
    if kind == "stiff":
        axis = np.ptp(vertices, axis=0).argmax()
        middle = np.median(vertices[:, axis])
        gap = abs(vertices[:, axis] - middle) / np.ptp(vertices[:, axis])
        solver.stiffen((vertices[:, axis] > middle).astype(int), np.clip(8.0 * gap, 0.0, 1.0))
        solver.stiffness = 0.7
    return solver


def some_soft(groups: np.ndarray, soft: bool) -> np.ndarray | None:
    """Every second handle on a spring."""
    return np.where(np.arange(len(groups)) % 2 == 1, 2.0, np.inf) if soft else None


def held_in_places(vertices: np.ndarray, places: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Groups of up to a dozen handles around points that lie far from each other."""
    chosen = [int(np.argmax(np.linalg.norm(vertices - vertices.mean(axis=0), axis=1)))]
    while len(chosen) < places:
        gap = np.linalg.norm(vertices[:, None] - vertices[chosen], axis=2).min(axis=1)
        chosen.append(int(np.argmax(gap)))
    near = np.linalg.norm(vertices[:, None] - vertices[chosen], axis=2)
    group = near.argmin(axis=1)
    rank = np.empty(len(vertices), dtype=int)
    for name in range(places):
        own = np.flatnonzero(group == name)
        rank[own[np.argsort(near[own, name], kind="stable")]] = np.arange(len(own))
    handles = np.flatnonzero(rank < 12)
    return handles, group[handles]


def inverted(vertices: np.ndarray, faces: np.ndarray, solver: ArapSolver, answer: np.ndarray):
    """Which faces point against their rest normals, turned as the cells of their corners are."""

    def cross(points: np.ndarray) -> np.ndarray:
        a, b, c = (points[faces[:, corner]] for corner in range(3))
        return np.cross(b - a, c - a)

    def is_sound(points: np.ndarray) -> np.ndarray:
        corners = points[faces]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        return np.linalg.norm(cross(points), axis=1) > 0.02 * longest**2

    turned = np.einsum("fcij,fj->fi", solver.rotations()[faces], cross(vertices))
    against = np.einsum("fi,fi->f", turned, cross(answer)) < 0.0
    return against & is_sound(vertices) & is_sound(answer)


def group_turns(rest: np.ndarray, groups: np.ndarray, odd: Rotation) -> np.ndarray:
    """Every second group turned about its own centre."""
    targets = rest.copy()
    for name in np.unique(groups)[1::2]:
        own = groups == name
        centre = rest[own].mean(axis=0)
        targets[own] = odd.apply(rest[own] - centre) + centre
    return targets


def slow_full_twist(rest: np.ndarray, groups: np.ndarray, _: np.random.Generator) -> Targets:
    """No frame turns far, and at the end all handles are where they were; not so the surface."""
    for angle in np.linspace(0.0, 2.0 * np.pi, 50):
        yield group_turns(rest, groups, Rotation.from_rotvec([0.0, angle, 0.0]))


def half_turns(rest: np.ndarray, groups: np.ndarray, _: np.random.Generator) -> Targets:
    for axis in np.eye(3):
        yield group_turns(rest, groups, Rotation.from_rotvec(np.pi * axis))


def jumps(rest: np.ndarray, _: np.ndarray, rng: np.random.Generator) -> Targets:
    for _frame in range(6):
        yield rest + rng.normal(0.0, 0.5 * np.ptp(rest), rest.shape)
    yield rest + 1e6 * np.ptp(rest)


def one_point(rest: np.ndarray, _: np.ndarray, __: np.random.Generator) -> Targets:
    """All handles shrink into one point, as slowly as they can, and stay there."""
    centre = rest.mean(axis=0)
    for share in [*np.linspace(1.0, 0.0, 40), 0.0, 0.0]:
        yield centre + share * (rest - centre)


def one_plane_one_line(rest: np.ndarray, _: np.ndarray, __: np.random.Generator) -> Targets:
    centre = rest.mean(axis=0)
    for share in np.linspace(1.0, 0.0, 25):
        yield centre + (rest - centre) * [1.0, 1.0, share]
    for share in np.linspace(1.0, 0.0, 25):
        yield centre + (rest - centre) * [share, 1.0, 0.0]


def inside_out(rest: np.ndarray, _: np.ndarray, __: np.random.Generator) -> Targets:
    """Through a plane into the mirror image, and slowly back."""
    centre = rest.mean(axis=0)
    for share in [*np.linspace(1.0, -1.0, 30), *np.linspace(-1.0, 1.0, 30)]:
        yield centre + (rest - centre) * [share, 1.0, 1.0]


def exchange(rest: np.ndarray, groups: np.ndarray, rng: np.random.Generator) -> Targets:
    """Every group goes, in a straight line, to where another is."""
    names = np.unique(groups)
    centres = np.array([rest[groups == name].mean(axis=0) for name in names])
    goal = rest + (centres[rng.permutation(len(names))] - centres)[np.searchsorted(names, groups)]
    for share in np.linspace(0.0, 1.0, 30):
        yield rest + share * (goal - rest)


ORDEALS = [
    slow_full_twist, half_turns, jumps, one_point, one_plane_one_line, inside_out, exchange,
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ordeal", ORDEALS)
def test_nothing_inverted_is_left_ten_frames_after_the_input_is_sane(
    kind: str, ordeal: Callable[..., Targets]
) -> None:
    vertices, faces = bar(30, 12)
    handles, groups = ends(vertices)
    _survive(make(kind, vertices, faces, handles, groups), vertices, faces, handles, groups, ordeal)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["decimated-knight.off", "cgal_cactus.off"])
def test_nothing_inverted_is_left_on_real_characters(shared: Path, kind: str, name: str) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.load(shared / "mesh" / name, process=True, force="mesh")
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    handles, groups = held_in_places(vertices)
    solver = make(kind, vertices, faces, handles, groups)
    for ordeal in (slow_full_twist, jumps, inside_out, exchange):
        solver.reset()
        _survive(solver, vertices, faces, handles, groups, ordeal)


def _survive(
    solver: ArapSolver,
    vertices: np.ndarray,
    faces: np.ndarray,
    handles: np.ndarray,
    groups: np.ndarray,
    ordeal: Callable[..., Targets],
) -> None:
    """Go through an ordeal and come back to rest; then no face stays inverted for long."""
    rest = vertices[handles]
    for targets in ordeal(rest, groups, np.random.default_rng(1)):
        answer = solver.solve(targets, 2)
        assert np.isfinite(answer).all()
        assert (answer[handles] == targets).all()
    runs = np.zeros(len(faces), dtype=int)
    for _ in range(FRAMES + 6):
        answer = solver.solve(rest, 2)
        runs = (runs + 1) * inverted(vertices, faces, solver, answer)
        assert runs.max() <= FRAMES
    # And it is its own shape again.
    assert stretch(vertices, faces, answer).mean() < 0.02


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("soft", SOFT)
def test_refused_input_leaves_no_trace(kind: str, soft: bool) -> None:
    vertices, faces = bar(16, 8)
    handles, groups = ends(vertices)

    def perform(disturb: bool) -> bytes:
        solver = make(kind, vertices, faces, handles, groups, some_soft(groups, soft))
        answer = solver.solve(bent(vertices, handles, groups, 0.5), 2)
        if disturb:
            for bad in (np.nan, np.inf, -np.inf, 1e300):
                targets = vertices[handles].copy()
                targets[3, 1] = bad
                with pytest.raises(ValueError, match="target 3 is not finite, or absurdly far"):
                    solver.solve(targets, 2)
            with pytest.raises(ValueError, match="weight of handle 0 is nan"):
                solver.weigh(np.full(len(handles), np.nan))
            with pytest.raises(ValueError, match="handle more than once"):
                solver.hold([1, 1])
            with pytest.raises(ValueError, match="iterations"):
                solver.solve(vertices[handles], -2)
        for angle in (0.6, 0.7):
            answer = solver.solve(bent(vertices, handles, groups, angle), 2)
        return answer.tobytes()

    assert perform(True) == perform(False)


@pytest.mark.parametrize("kind", KINDS)
def test_handles_at_one_place_and_at_one_target(kind: str) -> None:
    vertices, faces = bar(20, 8)
    twin = len(vertices)
    points = np.vstack([vertices, vertices[80:81]])  # a second vertex where vertex 80 is
    triangles = np.vstack([faces, [[twin, 80, 81], [twin, 88, 80]]])
    handles = np.array([0, 5, 80, twin, 150, 157])
    groups = np.array([0, 0, 1, 1, 2, 2])
    solver = make(kind, points, triangles, handles, groups)
    assert np.isfinite(solver.solve(points[handles], 2)).all()
    same = points[handles].copy()
    same[1:4] = same[0] + 0.3
    for _ in range(8):
        assert np.isfinite(solver.solve(same, 2)).all()
        assert np.isfinite(solver.energy)
    for _ in range(FRAMES):
        answer = solver.solve(points[handles], 2)
    assert abs(answer - points).max() < 1e-2


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("thin", [1.0 / 40.0, 40.0])
def test_needles_and_obtuse_triangles_bend(kind: str, thin: float) -> None:
    """Rings squeezed together or drawn apart until the triangles are caps or needles."""
    vertices, faces = bar(40, 16)
    points = vertices.copy()
    middle = (points[:, 0] > 0.3) & (points[:, 0] < 3.7)
    squeezed = 2.0 + (points[:, 0] - 2.0) * np.where(middle, min(thin, 1.0), 1.0)
    points[:, 0] = squeezed
    points[:, 1:] /= max(thin, 1.0)
    handles, groups = ends(vertices)
    solver = make(kind, points, faces, handles, groups)
    last = np.inf
    for angle in np.linspace(0.0, 0.6, 8):
        answer = solver.solve(bent(points, handles, groups, angle), 3)
        assert np.isfinite(answer).all()
        assert abs(answer).max() < 20.0
    for _ in range(5):
        answer = solver.solve(bent(points, handles, groups, 0.6), 3)
        if kind != "squash":
            assert solver.energy <= last * (1.0 + 1e-9)
            last = solver.energy
    for _ in range(FRAMES):
        answer = solver.solve(points[handles], 2)
    assert abs(answer - points).max() < 2e-2


MOTIONS = st.integers(0, 10_000)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("soft", SOFT)
@given(seed=MOTIONS, scale=st.sampled_from([1e-3, 1.0, 1e3]))
@settings(max_examples=3, deadline=None)
def test_answers_turn_shift_scale_and_renumber_with_the_input(
    kind: str, soft: bool, seed: int, scale: float
) -> None:
    vertices, faces = bar(20, 8)
    handles, groups = ends(vertices)
    weights = some_soft(groups, soft)
    rng = np.random.default_rng(seed)
    turn, other = Rotation.random(2, rng=rng)
    shift, offset = scale * rng.normal(0, 3, (2, 3))
    name = rng.permutation(len(vertices))
    order = rng.permutation(len(handles))
    moved = np.empty_like(vertices)
    moved[name] = scale * turn.apply(vertices) + shift
    plain = make(kind, vertices, faces, handles, groups, weights)
    if kind == "stiff":  # its regions are cut along an axis, which turns along
        renamed = ArapSolver(
            moved, name[faces], name[handles[order]], groups=groups[order],
            weights=None if weights is None else weights[order],
        )  # fmt: skip
        middle = np.median(vertices[:, 0])
        gap = abs(vertices[:, 0] - middle) / np.ptp(vertices[:, 0])
        region, rigidity = np.empty(len(name), dtype=int), np.empty(len(name))
        region[name], rigidity[name] = vertices[:, 0] > middle, np.clip(8.0 * gap, 0.0, 1.0)
        renamed.stiffen(region, rigidity)
        renamed.stiffness = 0.7
    else:
        renamed = make(
            kind, moved, name[faces], name[handles[order]], groups[order],
            None if weights is None else weights[order],
        )  # fmt: skip
    for angle in (0.3, 0.6, 0.9):
        targets = bent(vertices, handles, groups, angle)
        expected = scale * other.apply(plain.solve(targets, 3)) + offset
        answer = renamed.solve(scale * other.apply(targets[order]) + offset, 3)
        assert abs(answer[name] - expected).max() < 1e-5 * scale
    assert renamed.energy == pytest.approx(scale**2 * plain.energy, rel=1e-4)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("soft", SOFT)
def test_rest_is_answered_with_rest_again_and_again(kind: str, soft: bool) -> None:
    vertices, faces = bar(20, 8)
    handles, groups = ends(vertices)
    solver = make(kind, vertices, faces, handles, groups, some_soft(groups, soft))
    for _ in range(40):
        answer = solver.solve(vertices[handles], 2)
    assert abs(answer - vertices).max() < 1e-12
    assert solver.energy < 1e-20


@pytest.mark.parametrize("kind", ENERGIES)
@pytest.mark.parametrize("soft", SOFT)
def test_an_answer_that_has_converged_stays(kind: str, soft: bool) -> None:
    vertices, faces = bar(12, 6)
    handles, groups = ends(vertices)
    solver = make(kind, vertices, faces, handles, groups, some_soft(groups, soft))
    targets = bent(vertices, handles, groups, 0.5)
    first = solver.solve(targets, 3000)
    np.testing.assert_allclose(solver.solve(targets, 50), first, atol=1e-6)
