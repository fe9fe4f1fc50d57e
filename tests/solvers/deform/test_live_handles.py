"""Handles that come, go and change their weight while a surface is performing."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.arap import ArapSolver
from solvers.deform.handles import group_targets, stretched_turns
from tests.thorough import examples


def tube(rings: int = 40, around: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """An open tube along x, its vertices ring by ring."""
    angle = np.arange(around) * 2.0 * np.pi / around
    ring = np.stack([np.zeros(around), np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([np.add(ring, [0.35 * k, 0.0, 0.0]) for k in range(rings)])
    k, a = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    i, j = (k * around + a).ravel(), (k * around + (a + 1) % around).ravel()
    faces = np.concatenate(
        [np.stack([i, i + around, j], 1), np.stack([j, i + around, j + around], 1)]
    )
    return points, faces


POINTS, FACES = tube()
RINGS = np.arange(len(POINTS)).reshape(40, 16)
ENDS = np.concatenate([RINGS[0], RINGS[-1]])
GROUPS = np.repeat([0, 1], 16)


def bent(angle: float, rings: np.ndarray = RINGS[-1]) -> np.ndarray:
    """The end ring turned about the start."""
    return Rotation.from_rotvec([0.0, 0.0, angle]).apply(POINTS[rings])


def test_handles_that_were_always_there_and_those_that_came_give_the_same_surface():
    middle = RINGS[20]
    targets = np.concatenate([POINTS[RINGS[0]], bent(0.5), np.add(POINTS[middle], [0.0, 0.8, 0.0])])
    always = ArapSolver(POINTS, FACES, np.append(ENDS, middle), groups=np.repeat([0, 1, 2], 16))
    came = ArapSolver(POINTS, FACES, ENDS, groups=GROUPS)
    came.solve(targets[:32], 3)
    came.hold(np.append(ENDS, middle), groups=np.repeat([0, 1, 2], 16))
    expected = always.solve(targets, 300)
    np.testing.assert_allclose(came.solve(targets, 300), expected, atol=2e-3)
    assert came.energy == pytest.approx(always.energy, rel=1e-3)


def test_handles_that_went_leave_nothing_behind():
    middle = RINGS[20]
    solver = ArapSolver(POINTS, FACES, np.append(ENDS, middle), groups=np.repeat([0, 1, 2], 16))
    solver.solve(POINTS[np.append(ENDS, middle)] + np.repeat([[0.0], [0.0], [1.5]], 16, axis=0), 5)
    solver.hold(ENDS, groups=GROUPS)
    np.testing.assert_allclose(solver.solve(POINTS[ENDS], 400), POINTS, atol=1e-3)


def test_nothing_moves_when_a_handle_comes_where_the_surface_is():
    solver = ArapSolver(POINTS, FACES, ENDS, groups=GROUPS)
    for _ in range(60):
        before = solver.solve(np.concatenate([POINTS[RINGS[0]], bent(0.7)]), 10)
    held = np.append(ENDS, RINGS[20])
    solver.hold(held, groups=np.repeat([0, 1, 2], 16))
    after = solver.solve(before[held], 2)
    np.testing.assert_allclose(after, before, atol=5e-4)


def test_a_soft_handle_rests_where_its_spring_and_the_surface_agree():
    """On a flat strip of two triangles, moved along z, the energy is a quadratic: known in full."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    unit = ArapSolver(points, faces, [0])._unit
    for weight in (0.1, 1.0, 10.0):
        solver = ArapSolver(points, faces, [0, 1, 2, 3], weights=[np.inf, np.inf, np.inf, weight])
        # The corner lies on the strip's axis of symmetry, and is pulled along it.
        goal = points + np.array([[0.0] * 3] * 3 + [[0.2, 0.2, 0.0]])
        answer = solver.solve(goal, 200)
        share = (answer[3] - points[3])[0] / 0.2
        pull = weight * unit * (0.2 - share * 0.2)
        # The spring's pull is balanced by the surface's, found from the energy by differences.
        step = 1e-5
        energies = []
        for sign in (-1.0, 1.0):
            hard = ArapSolver(points, faces, [0, 1, 2, 3])
            moved = answer.copy()
            moved[3, :2] += sign * step
            hard.solve(moved, 1)
            energies.append(hard.energy)
        slope = (energies[1] - energies[0]) / (4.0 * step)  # along x and y at once
        # Every edge counts in two cells, and a square's slope is twice its root: four pulls.
        assert 0.25 * slope == pytest.approx(pull, rel=1e-3)


def test_a_handle_lets_go_smoothly_as_its_weight_falls():
    """From firmly held to let go the tip goes monotonically back, without a jump."""
    solver = ArapSolver(POINTS, FACES, ENDS, groups=GROUPS)
    targets = np.concatenate([POINTS[RINGS[0]], np.add(POINTS[RINGS[-1]], [2.0, 0.0, 0.0])])
    solver.solve(targets, 100)
    pulled = []
    for weight in [np.inf, *np.geomspace(1e3, 1e-5, 40)]:
        solver.weigh(np.repeat([np.inf, weight], 16))
        answer = solver.solve(targets, 30)
        pulled.append((answer[RINGS[-1]] - POINTS[RINGS[-1]])[:, 0].mean())
    steps = np.diff(pulled)
    assert pulled[0] == pytest.approx(2.0)
    assert (steps < 1e-3).all()
    assert steps.min() > -0.35
    assert abs(pulled[-1]) < 0.1


@settings(max_examples=examples(25), deadline=None)
@given(st.data())
def test_any_order_of_holding_and_letting_go_ends_the_same(data: st.DataObject):
    solver = ArapSolver(POINTS, FACES, ENDS, groups=GROUPS)
    for _ in range(data.draw(st.integers(0, 4))):
        rings = data.draw(st.lists(st.integers(0, 39), min_size=1, max_size=4, unique=True))
        weights = data.draw(st.lists(st.sampled_from([np.inf, 1.0, 0.01]), min_size=4, max_size=4))
        held = RINGS[rings].ravel()
        solver.hold(
            held,
            groups=np.repeat(rings, 16),
            weights=np.repeat(weights[: len(rings)], 16),
        )
        assert np.isfinite(solver.solve(POINTS[held] + 0.1 * len(rings), 1)).all()
    solver.hold(ENDS, groups=GROUPS)
    solver.reset()
    fresh = ArapSolver(POINTS, FACES, ENDS, groups=GROUPS)
    targets = np.concatenate([POINTS[RINGS[0]], bent(0.4)])
    for _ in range(30):
        ours, theirs = solver.solve(targets, 3), fresh.solve(targets, 3)
    np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_a_component_that_loses_its_last_handle_is_carried():
    points = np.concatenate([POINTS, np.add(POINTS, [0.0, 5.0, 0.0])])
    faces = np.concatenate([FACES, FACES + len(POINTS)])
    other = RINGS[3] + len(POINTS)
    solver = ArapSolver(points, faces, np.append(ENDS, other), groups=np.repeat([0, 0, 1], 16))
    solver.solve(points[np.append(ENDS, other)], 1)
    solver.hold(ENDS)
    turn = Rotation.from_rotvec([0.3, -0.2, 1.0])
    np.testing.assert_allclose(
        solver.solve(turn.apply(points[ENDS]), 1), turn.apply(points), atol=1e-9
    )


def test_a_tick_allocates_nothing_that_grows_with_the_mesh():
    peaks = []
    for rings in (40, 400):
        points, faces = tube(rings)
        ends = np.append(np.arange(16), len(points) - 1 - np.arange(16))
        solver = ArapSolver(points, faces, ends, groups=GROUPS)
        out = np.empty_like(points)
        solver.solve(points[ends] * 1.01, 2, out=out)
        tracemalloc.start()
        try:
            solver.solve(points[ends] * 1.02, 2, out=out)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    assert peaks[1] < peaks[0] + 1000


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([1.0], "weights of shape"),
        ([-1.0] * 32, "handle 0 is -1"),
        ([np.nan] * 32, "handle 0 is nan"),
    ],
)
def test_bad_weights_are_named_and_change_nothing(weights: list[float], message: str):
    solver = ArapSolver(POINTS, FACES, ENDS, groups=GROUPS)
    before = solver.solve(POINTS[ENDS] * 1.1, 3)
    solver.reset()
    with pytest.raises(ValueError, match=message):
        solver.weigh(weights)
    np.testing.assert_array_equal(solver.solve(POINTS[ENDS] * 1.1, 3), before)


def test_groups_with_a_position_and_a_rotation_take_their_handles_along():
    turn = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.4, -0.2, 1.1]])
    centres = np.stack([POINTS[RINGS[0]].mean(axis=0), POINTS[RINGS[-1]].mean(axis=0)])
    offsets = POINTS[ENDS] - centres[GROUPS]
    positions = np.add(centres, [[0.0, 0.0, 0.0], [-3.0, 2.0, 0.5]])
    targets = group_targets(offsets, GROUPS, turn.as_matrix(), positions)
    np.testing.assert_allclose(targets[:16], POINTS[RINGS[0]], atol=1e-12)
    np.testing.assert_allclose(targets[16:], turn[1].apply(offsets[16:]) + positions[1], atol=1e-12)
    answer = ArapSolver(POINTS, FACES, ENDS, groups=GROUPS).solve(targets, 1)
    np.testing.assert_array_equal(answer[ENDS], targets)


def test_what_grows_longer_grows_thinner_about_its_axis():
    turns = Rotation.random(3, random_state=5)
    axes = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # the last has none
    lengths, whole = np.array([1.0, 1.5, 0.8]), np.diag([0.9, 1.2, 0.9])
    maps = stretched_turns(3.0 * turns.as_quat(), axes, lengths, 0.5, whole)
    np.testing.assert_allclose(maps[0], whole @ turns[0].as_matrix(), atol=1e-14)
    thin = 1.5**-0.5
    along, across = np.linalg.solve(whole, maps[1])[:, :2].T
    np.testing.assert_allclose(along, turns[1].apply([1.5, 0.0, 0.0]), atol=1e-14)
    np.testing.assert_allclose(across, turns[1].apply([0.0, thin, 0.0]), atol=1e-14)
    np.testing.assert_allclose(maps[2], 0.8**-0.5 * whole @ turns[2].as_matrix(), atol=1e-14)
