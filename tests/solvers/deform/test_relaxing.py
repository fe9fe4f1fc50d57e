"""A surface that starts at targets of all its vertices becomes more even, whatever came before."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.arap import ENERGIES
from solvers.squash_stretch import SquashStretchSolver
from tests.solvers.bars import bar, bent, ends, stretch

VERTICES, FACES = bar()
EVERY = np.arange(len(VERTICES))
AWAY = np.array([3.0, 1.0, -2.0])
SOFT = np.full(len(VERTICES), 0.05)


def make(energy: str = "spokes") -> SquashStretchSolver:
    return SquashStretchSolver(
        VERTICES, FACES, EVERY, energy=energy, weights=SOFT, cartoon=0.0, volume_gain=1.0
    )


def kinked(angle: float) -> np.ndarray:
    """The bar with its second half turned, and nothing between the halves."""
    return bent(VERTICES, EVERY, (VERTICES[:, 0] > 2.0).astype(int), angle)


@pytest.mark.parametrize("energy", ENERGIES)
def test_rest_and_rigid_motions_stay(energy: str) -> None:
    solver = make(energy)
    turn = Rotation.from_rotvec([0.4, 2.0, -1.0])
    for moved in (VERTICES, turn.apply(VERTICES) - AWAY):
        np.testing.assert_allclose(solver.relax(moved, 2), moved, atol=1e-6)


def test_a_kink_is_spread() -> None:
    start = kinked(0.8)
    relaxed = make().relax(start, 1)
    before, after = (np.sort(stretch(VERTICES, FACES, x))[-40:] for x in (start, relaxed))
    assert after.max() < 0.6 * before.max()
    far = abs(VERTICES[:, 0] - 2.0) > 1.5
    np.testing.assert_allclose(relaxed[far], start[far], atol=0.02)


@pytest.mark.parametrize("cartoon", [0.0, 0.7])
@pytest.mark.parametrize("energy", ENERGIES)
def test_nothing_before_matters(energy: str, cartoon: float) -> None:
    fresh, used = make(energy), make(energy)
    for solver in (fresh, used):
        solver.cartoon = cartoon
        solver.stiffen(np.zeros(len(VERTICES), dtype=int), np.ones(len(VERTICES)))
        solver.stiffness = 0.3
    used.relax(kinked(-1.5), 3)
    used.solve(kinked(1.0) + 2.0, 2)
    np.testing.assert_array_equal(fresh.relax(kinked(0.5), 2), used.relax(kinked(0.5), 2))


def test_one_goes_over_to_handles_and_back() -> None:
    """A snapshot of either restores its handles and the same bytes."""
    solver = make()
    held, groups = ends(VERTICES)
    goals = bent(VERTICES, held, groups, 0.6)
    relaxed = solver.relax(kinked(0.5), 1)
    by_skin = solver.snapshot()
    solver.hold(held, groups=groups)
    first = solver.solve(goals, 2)
    np.testing.assert_array_equal(first[held], goals)
    by_handles = solver.snapshot()
    second = solver.solve(goals, 2)
    solver.restore(by_skin)
    np.testing.assert_array_equal(solver.relax(kinked(0.5), 1), relaxed)
    solver.restore(by_handles)
    np.testing.assert_array_equal(solver.solve(goals, 2), second)


def test_handles_that_are_missing_or_hard_are_refused() -> None:
    solver = make()
    for handles, weight in ((EVERY[:-1], 1.0), (EVERY, np.inf)):
        solver.hold(handles, weights=np.full(len(handles), weight))
        with pytest.raises(ValueError, match="every vertex to be a soft handle"):
            solver.relax(VERTICES)
    solver.hold(EVERY, weights=SOFT)
    with pytest.raises(ValueError, match="iterations must not be negative"):
        solver.relax(VERTICES, -1)
    with pytest.raises(ValueError, match="targets of shape"):
        solver.relax(VERTICES[:5])
