"""Soles are flat while the performer's are, tilt as theirs tilt, and stay above the floor."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.retarget.sole_pitch import SolePitch, sole_depths
from tests.runtime.snapshots import digest, leaves

REST = np.array([[0.0, -0.08, 0.16]])  # of the character: down by 27 degrees
THEIRS = np.array([[0.03, -0.05, 0.2]])  # of the performer: down by 14, a little outward
LEFT = np.array([1.0, 0.0, 0.0])
SOLE = np.array([[0.0, -0.08, 0.16], [0.0, -0.08, -0.05]])  # toes and heel
DEPTHS = sole_depths(SOLE, REST[0])[None]
HIGH, FLAT = np.array([1.0]), np.zeros(1)
STANDS, STEPS = np.array([True]), np.array([False])


def pitched(foot: np.ndarray, degrees: float) -> np.ndarray:
    """A foot (1, 3) with its toes raised about its own left."""
    left = np.cross([0.0, 1.0, 0.0], foot[0])
    turn = Rotation.from_rotvec(-np.radians(degrees) * left / np.linalg.norm(left))
    return turn.apply(foot)


def sole(toes: bool = True) -> SolePitch:
    return SolePitch(REST, THEIRS, np.array([toes]), DEPTHS)


def up(turns: np.ndarray) -> np.ndarray:
    """Where the normal of the sole points."""
    return Rotation.from_quat(turns).apply([0.0, 1.0, 0.0])[0]


def test_a_foot_that_stands_is_flat_and_points_where_the_performers_points() -> None:
    turns = sole().turns(THEIRS, LEFT, FLAT, STANDS, 0.0)
    np.testing.assert_allclose(up(turns), [0.0, 1.0, 0.0], atol=1e-12)
    ahead = Rotation.from_quat(turns).apply(REST)[0]
    assert np.arctan2(ahead[0], ahead[2]) == pytest.approx(np.arctan2(0.03, 0.2))


@pytest.mark.parametrize("degrees", [-50.0, -10.0, 15.0, 40.0])
@pytest.mark.parametrize("yaw", [-2.0, 0.0, 3.0])
def test_it_tilts_by_as_much_as_the_performers(degrees: float, yaw: float) -> None:
    body = Rotation.from_rotvec([0.0, yaw, 0.0])
    pitch = sole()
    pitch.turns(body.apply(THEIRS), body.apply(LEFT), FLAT, STANDS, 0.0)
    turns = pitch.turns(body.apply(pitched(THEIRS, degrees)), body.apply(LEFT), HIGH, STEPS, 0.1)
    assert np.degrees(np.arccos(up(turns)[1])) == pytest.approx(abs(degrees), abs=4.0)
    ahead = Rotation.from_quat(turns).apply(body.apply([0.0, 0.0, 1.0]) * 0 + [0.0, 0.0, 1.0])[
        1 - 1
    ]
    assert np.sign(ahead[1]) == np.sign(degrees)


def test_what_flat_is_is_learned_from_the_foot_that_stands() -> None:
    """A skeleton whose rest pose has the foot level, and a performer who stands on sloping ones."""
    pitch = SolePitch(REST, np.array([[0.0, 0.0, 0.2]]), np.array([True]), DEPTHS)
    for i in range(120):
        turns = pitch.turns(THEIRS, LEFT, FLAT + 1.0, STANDS, i / 30.0)
    assert up(turns)[1] > 0.9999


def test_it_is_learned_from_standing_feet_only() -> None:
    pitch = sole()
    pitch.turns(THEIRS, LEFT, FLAT, STANDS, 0.0)
    for i in range(60):
        turns = pitch.turns(pitched(THEIRS, -30.0), LEFT, HIGH, STEPS, i / 30.0)
    assert np.degrees(np.arccos(up(turns)[1])) > 25.0


def test_toes_do_not_reach_into_the_floor() -> None:
    pitch = sole()
    pitch.turns(THEIRS, LEFT, FLAT, STANDS, 0.0)
    turns = pitch.turns(pitched(THEIRS, -40.0), LEFT, FLAT, STANDS, 0.0)
    np.testing.assert_allclose(up(turns), [0.0, 1.0, 0.0], atol=1e-12)
    low = np.array([0.05])  # the toes may sink by as much
    turns = pitch.turns(pitched(THEIRS, -60.0), LEFT, low, STEPS, 0.0)
    toes = Rotation.from_quat(turns).apply(SOLE)[:, 1].min()
    assert toes == pytest.approx(-0.13, abs=1e-3)
    assert pitch.above[0] == pytest.approx(0.0, abs=1e-5)


def test_the_sole_of_a_foot_in_the_air_is_as_high_as_it_looks() -> None:
    pitch = sole()
    pitch.turns(THEIRS, LEFT, FLAT, STANDS, 0.0)
    turns = pitch.turns(pitched(THEIRS, -30.0), LEFT, HIGH, STEPS, 0.0)
    lowest = 0.08 + HIGH[0] + Rotation.from_quat(turns).apply(SOLE)[:, 1].min()
    assert pitch.above[0] == pytest.approx(lowest, abs=1e-3)


def test_a_long_foot_tilts_less() -> None:
    twice = sole_depths(SOLE * (1.0, 1.0, 2.0), REST[0])[None]
    angles = []
    for depths in (DEPTHS, twice):
        pitch = SolePitch(REST, THEIRS, np.array([True]), depths)
        pitch.turns(THEIRS, LEFT, FLAT, STANDS, 0.0)
        turns = pitch.turns(pitched(THEIRS, -50.0), LEFT, np.array([0.05]), STEPS, 0.0)
        angles.append(np.degrees(np.arccos(up(turns)[1])))
    assert 5.0 < angles[1] < 0.6 * angles[0]


def test_a_foot_without_toes_is_level_while_it_stands_and_else_follows_the_shin() -> None:
    pitch = SolePitch(REST, REST, np.array([False]), DEPTHS)
    tilted = pitched(REST, 25.0)
    turns = pitch.turns(tilted, LEFT, FLAT, STANDS, 0.0)
    np.testing.assert_allclose(up(turns), [0.0, 1.0, 0.0], atol=1e-12)
    angles = []
    for i in range(1, 40):
        turns = pitch.turns(tilted, LEFT, HIGH, STEPS, i / 60.0)
        angles.append(np.degrees(np.arccos(min(up(turns)[1], 1.0))))
    assert angles[-1] == pytest.approx(25.0, abs=0.1)
    assert np.diff(angles, prepend=0.0).max() < 7.0  # by and by


def test_a_foot_that_points_straight_down_or_nowhere_is_finite() -> None:
    pitch = sole()
    for foot in ([0.0, -0.2, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.0]):
        for left in (LEFT, np.zeros(3)):
            turns = pitch.turns(np.array([foot]), left, HIGH, STEPS, 0.0)
            assert np.isfinite(turns).all()
            assert np.linalg.norm(turns) == pytest.approx(1.0)
    down = pitch.turns(np.array([[0.0, -0.2, 0.0]]), LEFT, HIGH, STEPS, 0.0)
    np.testing.assert_allclose(Rotation.from_quat(down).apply(LEFT)[0], LEFT, atol=1e-9)


def test_a_frame_on_its_own_has_no_time() -> None:
    pitch, fresh = sole(), sole()
    pitch.turns(pitched(THEIRS, 20.0), LEFT, FLAT, STANDS, 0.0)
    pitch.turns(pitched(THEIRS, 20.0), LEFT, FLAT, STANDS, 3.0)
    expected = fresh.turns(THEIRS, LEFT, HIGH, STEPS, 0.0)
    for time in (np.nan, np.nan, 5.0):
        turns = pitch.turns(THEIRS, LEFT, HIGH, STEPS, time)
        np.testing.assert_allclose(turns, expected, atol=1e-12)


def test_going_on_from_a_snapshot_gives_the_same_turns() -> None:
    pitch = sole()
    for i in range(10):
        pitch.turns(pitched(THEIRS, i), LEFT, HIGH, STANDS, i / 30.0)
    state = pitch.snapshot()
    before = digest(state)
    assert list(leaves(state))

    def go_on() -> bytes:
        return b"".join(
            pitch.turns(pitched(THEIRS, -i), LEFT, HIGH, STANDS, (10 + i) / 30.0).tobytes()
            for i in range(10)
        )

    first = go_on()
    assert digest(state) == before
    pitch.reset()
    pitch.restore(state)
    assert go_on() == first
