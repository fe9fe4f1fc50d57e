"""A restored solver goes on with the same bytes as after the snapshot, whatever it did since."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.arap import ENERGIES, ArapSolver
from solvers.squash_stretch import SquashStretchSolver
from tests.solvers.deform.test_live_handles import tube

RINGS, AROUND = 14, 8
POINTS, FACES = tube(RINGS, AROUND)
RING = np.arange(len(POINTS)).reshape(RINGS, AROUND)
SPARE = np.add(POINTS, [0.0, 4.0, 0.0])  # a second tube, which may lose its handles and be carried
BOTH, BOTH_FACES = np.concatenate([POINTS, SPARE]), np.concatenate([FACES, FACES + len(POINTS)])


@dataclass(frozen=True)
class Step:
    """One frame: the handles and their weights, the elasticity, the targets and the iterations."""

    rings: tuple[int, ...]
    weights: tuple[float, ...]
    is_held_anew: bool
    cartoon: float
    stiffness: float
    turn: float
    path: float
    iterations: int
    settled: int


STEPS = st.builds(
    Step,
    rings=st.lists(st.integers(0, 2 * RINGS - 1), min_size=1, max_size=5, unique=True).map(tuple),
    weights=st.lists(
        st.sampled_from([np.inf, 10.0, 0.1, 1e-6]), min_size=5, max_size=5
    ).map(tuple),
    is_held_anew=st.sampled_from([False, False, False, True]),
    cartoon=st.sampled_from([0.0, 0.0, 0.5, 1.0]),
    stiffness=st.sampled_from([0.0, 0.0, 0.6]),
    turn=st.one_of(st.floats(-0.2, 0.2), st.sampled_from([0.0, 2.5])),
    path=st.one_of(st.floats(-0.1, 0.1), st.sampled_from([0.0, 3.0])),
    iterations=st.integers(0, 3),
    settled=st.integers(0, 2),
)  # fmt: skip


class Performance:
    """A solver, and the rings that it holds now."""

    def __init__(self, kind: type[ArapSolver], energy: str) -> None:
        self.rings = (0, RINGS - 1, RINGS, 2 * RINGS - 1)
        held, groups = self.handles()
        self.solver = kind(BOTH, BOTH_FACES, held, energy=energy, groups=groups)
        self.solver.stiffen(np.arange(len(BOTH)) // (4 * AROUND), np.ones(len(BOTH)))

    def handles(self) -> tuple[np.ndarray, np.ndarray]:
        every = np.arange(len(BOTH)).reshape(2 * RINGS, AROUND)
        return every[list(self.rings)].ravel(), np.repeat(self.rings, AROUND)

    def frame(self, step: Step) -> list[np.ndarray]:
        """Everything that a solver says of one frame."""
        solver = self.solver
        if isinstance(solver, SquashStretchSolver):
            solver.cartoon = step.cartoon
        solver.stiffness = step.stiffness
        if step.is_held_anew:
            self.rings = step.rings
        held, groups = self.handles()
        weights = np.resize(np.repeat(step.weights, AROUND), len(held))
        if step.is_held_anew:
            solver.hold(held, groups=groups, weights=weights)
        elif step.settled == 2:
            solver.weigh(weights)
        turn = Rotation.from_rotvec([0.0, step.turn, 2.0 * step.turn])
        goals = np.where(groups[:, None] % 2 == 0, BOTH[held], turn.apply(BOTH[held]) + step.path)
        answer = solver.solve(goals, step.iterations)
        flat = answer.copy()
        folded = solver.flatten_folds(flat)
        said = [answer, flat, np.array(folded), np.array(solver.energy), solver.rotations()]
        solver.settle(step.settled)
        return said


@pytest.mark.parametrize("kind", [ArapSolver, SquashStretchSolver])
@pytest.mark.parametrize("energy", ENERGIES)
@settings(max_examples=8, deadline=None)
@given(
    before=st.lists(STEPS, max_size=6),
    after=st.lists(STEPS, min_size=1, max_size=10),
    between=st.lists(STEPS, max_size=4),
    quiet=st.integers(0, 9),
)
def test_solving_on_from_a_snapshot_gives_the_same_bytes(
    kind: type[ArapSolver],
    energy: str,
    before: list[Step],
    after: list[Step],
    between: list[Step],
    quiet: int,
) -> None:
    calm = Step((), (np.inf,), False, 0.0, 0.0, 0.01 * quiet, 0.0, 1, 1)
    performance = Performance(kind, energy)
    for step in [*before, *[calm] * quiet]:  # up to the frame that tries the rest pose
        performance.frame(step)
    state, rings = performance.solver.snapshot(), performance.rings
    first = [performance.frame(step) for step in [*after, *[calm] * 9]]
    for step in between:
        performance.frame(step)
    elsewhere = Performance(kind, energy)
    for other in (performance, performance, elsewhere):
        other.solver.restore(state)
        other.rings = rings
        again = [other.frame(step) for step in [*after, *[calm] * 9]]
        for said, expected in zip(again, first, strict=True):
            for ours, theirs in zip(said, expected, strict=True):
                assert ours.tobytes() == theirs.tobytes()


def test_the_precision_of_the_factor_goes_back_with_the_state(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Handles that hold next to nothing make the factor go over to double precision for good."""
    solver = ArapSolver(POINTS, FACES, RING[[0, -1]].ravel())
    goals = POINTS[RING[[0, -1]].ravel()] + np.repeat([[0.0], [0.3]], AROUND, axis=0)
    solver.solve(goals, 2)
    state = solver.snapshot()
    single = solver.solve(goals, 2)
    # The share of an error that a solve in single precision leaves: 2e-7 here, 6e-4 held softly.
    monkeypatch.setattr("solvers.linear.block_factor._LOST_MOST", 1e-5)
    solver.weigh(np.full(2 * AROUND, 1e-6))
    solver.weigh(np.full(2 * AROUND, np.inf))
    double = solver.snapshot()
    assert (state.precision, double.precision) == (np.float32, np.float64)
    expected = solver.solve(goals, 2)
    solver.restore(state)
    assert solver.solve(goals, 2).tobytes() == single.tobytes()
    solver.restore(double)
    assert solver.solve(goals, 2).tobytes() == expected.tobytes()


def test_a_state_of_another_surface_is_refused_and_changes_nothing() -> None:
    solver = ArapSolver(POINTS, FACES, RING[[0, -1]].ravel())
    other = ArapSolver(POINTS[:-AROUND], FACES[FACES.max(axis=1) < RING[-1, 0]], RING[0])
    goals = POINTS[RING[[0, -1]].ravel()] * 1.1
    expected = solver.solve(goals, 2)
    solver.reset()
    with pytest.raises(ValueError, match="state of 112 vertices, got 104"):
        solver.restore(other.snapshot())
    np.testing.assert_array_equal(solver.solve(goals, 2), expected)
