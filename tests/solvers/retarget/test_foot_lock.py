"""Planted feet stay, let go smoothly, and slide no more than the performer's."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.retarget.foot_lock import CREEP, FARTHEST, NEAR, PLAY, PULL, FootLock
from solvers.retarget.two_bone_ik import GIVE
from tests.runtime.snapshots import digest, leaves

LEG = 0.9
RATE = 60.0
NEITHER, FLAT, TIPTOE = np.array([[False, False], [True, True], [False, True]])
HIP = np.array([[0.0, 0.95, 0.0]])


def feet(z: float, y: float = 0.1) -> np.ndarray:
    """One foot (1, 2, 3) at a place along z."""
    return np.array([[[0.0, y, z], [0.0, 0.02, z + 0.15]]])


def perform(lock: FootLock, zs: np.ndarray, stands: list, performer: np.ndarray | None = None):
    """The goals (T, 3) of a foot at `zs`."""
    theirs = np.zeros(len(zs)) if performer is None else performer
    return np.array(
        [
            lock.goals(HIP, feet(z), feet(p), s[None], i / RATE)[0]
            for i, (z, s, p) in enumerate(zip(zs, stands, theirs, strict=True))
        ]
    )


def test_a_foot_in_the_air_is_left_alone() -> None:
    zs = np.linspace(0.0, 1.0, 40)
    goals = perform(FootLock([LEG]), zs, [NEITHER] * 40)
    np.testing.assert_array_equal(goals[:, 0], 0.0)
    assert np.abs(goals[:10, 2] - zs[:10]).max() == 0.0


@pytest.mark.parametrize("stands", [FLAT, TIPTOE])
def test_a_planted_foot_stays_where_it_came_down(stands: np.ndarray) -> None:
    zs = np.linspace(0.0, 0.07, 60)
    goals = perform(FootLock([LEG]), zs, [stands] * 60)
    assert 0.0 < goals[-1, 2] <= CREEP * LEG * 59 / RATE + 1e-12
    assert np.abs(np.diff(goals[:, 2])).max() <= CREEP * LEG / RATE + 1e-12
    assert np.abs(goals[:, 1] - 0.1).max() < GIVE * LEG  # its height is left alone
    assert (goals[:30, 1] == 0.1).all()  # and wholly so while the leg is bent


def test_a_planted_foot_creeps_home() -> None:
    """What little a foot may move while it stands brings it to where the leg would put it."""
    zs = np.r_[np.linspace(0.0, 0.03, 30), np.full(600, 0.03)]
    goals = perform(FootLock([LEG]), zs, [FLAT] * len(zs))[:, 2]
    assert goals[30] < 0.01
    assert goals[-1] == 0.03


def test_a_leg_does_not_stay_far_from_where_it_points() -> None:
    """As where wide hips turn over planted feet: the foot comes along before the leg is askew."""
    zs = np.r_[np.linspace(0.0, 0.2, 60), np.full(60, 0.2)]
    goals = perform(FootLock([LEG]), zs, [FLAT] * len(zs))[:, 2]
    assert (zs - goals).max() < 0.14
    assert zs[-1] - goals[-1] == pytest.approx(NEAR * LEG, abs=0.01)
    assert np.abs(np.diff(goals)).max() < 0.14 * PULL / RATE


def test_it_goes_back_smoothly() -> None:
    zs = np.linspace(0.0, 0.14, 121)  # 0.07 m/s
    goals = perform(FootLock([LEG]), zs, [FLAT] * 60 + [NEITHER] * 61)[:, 2]
    speeds = np.diff(goals) * RATE
    assert np.abs(speeds[:59]).max() <= CREEP * LEG + 1e-9
    gaps = zs - goals
    assert (np.diff(gaps[60:]) < 1e-4).all()  # it catches up with the free foot
    assert np.abs(gaps[60 + 8 :]).max() < 0.1 * gaps[59]


def test_its_velocity_does_not_jump_when_it_is_released() -> None:
    """Twice as many frames a second halve the largest change of velocity."""
    changes = []
    for rate in (500.0, 1000.0, 2000.0):
        lock, goals = FootLock([LEG]), []
        for i in range(int(rate)):
            time = i / rate
            stands = FLAT if time < 0.5 else NEITHER
            goals.append(lock.goals(HIP, feet(0.2 * time), feet(0.0), stands[None], time)[0, 2])
        changes.append(np.abs(np.diff(goals, 2)).max() * rate)
    assert changes[1] < 0.6 * changes[0]
    assert changes[2] < 0.6 * changes[1]


def test_rolling_from_the_whole_foot_to_the_toes_moves_nothing() -> None:
    lock = FootLock([LEG])
    out = []
    for i in range(40):
        lift = max(0.0, 0.004 * (i - 20))
        points = np.array([[[0.0, 0.1 + lift, 0.02 + 0.3 * lift], [0.0, 0.02, 0.17]]])
        stands = FLAT if i < 25 else TIPTOE
        goal = lock.goals(HIP, points, points, stands[None], i / RATE)[0]
        out.append(points[0, 1, 2] + goal[2] - points[0, 0, 2])
    np.testing.assert_allclose(out, 0.17, atol=0.012)


def test_it_goes_along_with_a_performer_who_slides_and_never_faster() -> None:
    rng = np.random.default_rng(0)
    performer = np.cumsum(np.r_[np.zeros(30), np.full(60, 0.004), rng.normal(0, 0.002, 60)])
    goals = perform(FootLock([LEG]), performer * 1.1, [FLAT] * 150, performer)[:, 2]
    steps, theirs = np.abs(np.diff(goals)), np.abs(np.diff(performer))
    assert (steps <= theirs + CREEP * LEG / RATE + 1e-12).all()
    slid = performer[89] - goals[89]
    assert 0.0 <= slid <= PLAY * LEG


def test_a_foot_that_is_too_far_off_lets_go_and_is_planted_again() -> None:
    zs = np.r_[np.zeros(5), np.linspace(0.0, 0.6, 20), np.full(100, 0.6)]
    goals = perform(FootLock([LEG]), zs, [FLAT] * len(zs))[:, 2]
    assert np.abs(goals - zs).max() <= FARTHEST * LEG + 1e-9
    assert goals[-1] > FARTHEST * LEG
    assert np.abs(np.diff(goals)).max() < 0.08  # and does not jump
    assert np.abs(np.diff(goals)[-30:]).max() <= CREEP * LEG / RATE + 1e-12  # planted


def test_a_goal_is_always_within_reach() -> None:
    lock = FootLock([LEG])
    straight = np.array([[[0.0, 0.06, 0.0], [0.0, 0.02, 0.15]]])
    lock.goals(HIP, straight, straight, FLAT[None], 0.0)
    for i in range(1, 30):
        points = straight + np.array([0.0, 0.0, 0.0024 * i])
        hips = HIP + np.array([0.0, 0.0, 0.0024 * i])
        goal = lock.goals(hips, points, straight, FLAT[None], i / RATE)
        assert 0.0 <= goal[0, 2] <= CREEP * LEG * i / RATE + 1e-12
        assert np.linalg.norm(goal - hips) <= LEG + 1e-12


@pytest.mark.parametrize("then", [-1.0, 9.0])
def test_it_starts_anew_where_time_leaps(then: float) -> None:
    lock = FootLock([LEG])
    perform(lock, np.linspace(0.0, 0.1, 10), [FLAT] * 10)
    goal = lock.goals(HIP, feet(0.3), feet(0.0), FLAT[None], then)
    assert goal[0, 2] == 0.3


def test_going_on_from_a_snapshot_gives_the_same_goals() -> None:
    lock = FootLock([LEG])
    perform(lock, np.linspace(0.0, 0.1, 30), [FLAT] * 25 + [NEITHER] * 5)
    state = lock.snapshot()
    before = digest(state)
    assert list(leaves(state))

    def go_on() -> bytes:
        return b"".join(
            lock.goals(HIP, feet(0.1 + 0.01 * i), feet(0.0), FLAT[None], (30 + i) / RATE).tobytes()
            for i in range(10)
        )

    first = go_on()
    assert digest(state) == before
    lock.reset()
    lock.restore(state)
    assert go_on() == first
