"""Feet that stand are told from feet that step, at any rate of frames, and with noise."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.retarget.foot_contacts import FootContacts
from tests.runtime.snapshots import digest, leaves

LEG = 0.85
STANDING = np.array([[0.09, 0.02], [0.09, 0.02]])
STEP = 0.6  # [s] in the air, and as long on the floor


def walk(times: np.ndarray, floors: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Feet (T, 2, 2, 3) that step in turn: 0.7 m forward and 0.12 m high; the left one first."""
    out = np.zeros((len(times), 2, 2, 3))
    for foot in range(2):
        phase = times / STEP - foot
        steps = np.floor(phase / 2.0)
        share = np.clip(phase - 2.0 * steps, 0.0, 1.0)
        eased = share * share * (3.0 - 2.0 * share)
        out[:, foot, :, 2] = (0.7 * (steps + eased))[:, None] + (0.0, 0.15)
        up = 0.12 * np.sin(np.pi * share) ** 2
        out[:, foot, :, 1] = up[:, None] + STANDING[foot] + floors[foot]
        out[:, foot, :, 0] = 0.1 - 0.2 * foot
    return out


def truth(times: np.ndarray, margin: float) -> np.ndarray:
    """(T, 2) 1 where a foot stands, 0 where it steps, -1 within `margin` [s] of a change."""
    out = np.empty((len(times), 2))
    for foot in range(2):
        phase = (times / STEP - foot) % 2.0
        out[:, foot] = phase >= 1.0
        for edge in (0.0, 1.0, 2.0):
            out[np.abs(phase - edge) < margin / STEP, foot] = -1
    return out


def told(points: np.ndarray, times: np.ndarray) -> np.ndarray:
    contacts = FootContacts(STANDING, LEG)
    return np.array([contacts.update(p, t).copy() for p, t in zip(points, times, strict=True)])


def irregular(rate: float, rng: np.random.Generator) -> np.ndarray:
    return np.cumsum(rng.uniform(0.6, 1.4, int(12 * rate)) / rate)


@pytest.mark.parametrize("rate", [15.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("noise", [0.0, 0.004])
def test_steps_are_found_at_every_rate(rate: float, noise: float) -> None:
    rng = np.random.default_rng(1)
    times = irregular(rate, rng)
    points = walk(times)
    points += rng.normal(scale=noise, size=points.shape)
    stands, known = told(points, times), truth(times, 0.17)
    for part in range(2):
        sure = known >= 0
        wrong = (stands[..., part] != known) & sure
        assert wrong.sum() <= 0.01 * sure.sum()


def test_each_step_begins_and_ends_one_contact() -> None:
    rng = np.random.default_rng(2)
    times = irregular(30.0, rng)
    points = walk(times) + rng.normal(scale=0.006, size=(len(times), 2, 2, 3))
    stands = told(points, times)
    changes = (np.diff(stands[:, 0, 0].astype(int)) != 0).sum()
    assert changes == pytest.approx(times[-1] / STEP, abs=1)


def test_a_foot_that_is_seen_too_high_stands_nevertheless() -> None:
    """A recording whose floor is off by 8 cm, and a camera that sees one foot 4 cm higher."""
    times = np.arange(0.0, 12.0, 1.0 / 30.0)
    stands, known = told(walk(times, (0.08, 0.12)), times), truth(times, 0.17)
    late = times > 3.0
    sure = (known >= 0) & late[:, None]
    assert (stands[..., 0] == known)[sure].mean() > 0.99


@pytest.mark.parametrize("rate", [30.0, 120.0])
def test_noise_of_a_centimetre_does_not_hide_a_foot_that_stands(rate: float) -> None:
    rng = np.random.default_rng(3)
    times = irregular(rate, rng)
    points = walk(times)
    points += rng.normal(scale=0.01, size=points.shape)
    stands, known = told(points, times), truth(times, 0.17)
    sure = (known >= 0) & (times > 2.0)[:, None]
    assert (stands[..., 1] == known)[sure].mean() > 0.93


def test_the_rest_pose_need_not_stand() -> None:
    """Some files have the first frame as their rest pose: here one foot is far above the other."""
    times = np.arange(0.0, 6.0, 1.0 / 30.0)
    points = walk(times)
    lifted = FootContacts(STANDING + np.array([[0.3], [0.0]]), LEG)
    for p, t, stands in zip(points, times, told(points, times), strict=True):
        np.testing.assert_array_equal(lifted.update(p, t), stands)


@pytest.mark.parametrize("rises", [0.25, 0.6])
def test_who_stays_up_stands_on_something(rises: float) -> None:
    """Up on a box, which a jump's time later is the floor; and down again."""
    times = np.arange(0.0, 6.0, 1.0 / 60.0)
    up = rises * (np.clip((times - 1.0) / 0.3, 0.0, 1.0) - np.clip((times - 4.0) / 0.3, 0.0, 1.0))
    contacts, heights = FootContacts(STANDING, LEG), []
    for time, height in zip(times, up, strict=True):
        points = np.zeros((2, 2, 3))
        points[..., 1] = STANDING + height
        contacts.update(points, time)
        heights.append(contacts.heights.min())
    heights = np.array(heights)
    assert heights[(times > 1.4) & (times < 1.7)] == pytest.approx(rises, abs=0.05)
    assert heights[(times > 3.5) & (times < 4.0)].max() < 0.04
    assert np.diff(heights)[(times > 1.4)[1:] & (times < 4.0)[1:]].min() > -0.1 * rises
    assert np.abs(heights[times > 5.5]).max() < 0.01


def test_tiptoe_stands_on_the_toes_alone() -> None:
    times = np.arange(0.0, 3.0, 1.0 / 60.0)
    points = np.zeros((len(times), 2, 2, 3))
    points[..., 1] = STANDING
    points[:, :, 0, 1] += 0.12 * np.clip((times - 0.5) / 0.5, 0.0, 1.0)[:, None]
    stands = told(points, times)
    assert stands[..., 1].all()
    assert stands[20, :, 0].all()
    assert not stands[-1, :, 0].any()


def test_a_raised_foot_does_not_become_the_floor() -> None:
    times = np.arange(0.0, 20.0, 1.0 / 30.0)
    points = np.zeros((len(times), 2, 2, 3))
    points[..., 1] = STANDING
    points[:, 1, :, 1] += 0.3 * np.clip(times - 1.0, 0.0, 1.0)[:, None]
    stands = told(points, times)
    assert stands[:, 0].all()
    assert not stands[60:, 1].any()


def test_a_jump_leaves_the_floor_where_it_is() -> None:
    times = np.arange(0.0, 2.0, 1.0 / 60.0)
    up = np.maximum(0.0, 2.5 * (times - 1.0) - 4.905 * (times - 1.0) ** 2) * (times > 1.0)
    contacts = FootContacts(STANDING, LEG)
    for time, height in zip(times, up, strict=True):
        points = np.zeros((2, 2, 3))
        points[..., 1] = STANDING + height
        contacts.update(points, time)
        assert contacts.heights.min() == pytest.approx(height, abs=0.01)
        if height > 0.2:
            assert not contacts.stands.any()


def test_time_that_stands_steps_back_or_leaps() -> None:
    contacts = FootContacts(STANDING, LEG)
    points = np.zeros((2, 2, 3))
    points[..., 1] = STANDING
    contacts.update(points, 5.0)
    contacts.update(points + 1.0, 5.0)
    assert contacts.stands.all()
    for time in (0.0, 100.0):  # elsewhere in the recording: no speed can be told
        points[..., 0] += 3.0
        assert contacts.update(points, time).all()


def test_a_frame_on_its_own_has_no_time() -> None:
    contacts = FootContacts(STANDING, LEG)
    points = np.zeros((2, 2, 3))
    points[..., 1] = STANDING
    for time in (np.nan, 0.0, np.nan, np.nan):
        points += 0.7
        assert contacts.update(points, time).all()
        np.testing.assert_allclose(contacts.heights, 0.0, atol=1e-12)


def test_going_on_from_a_snapshot_tells_the_same() -> None:
    times = np.arange(0.0, 4.0, 1.0 / 30.0)
    points = walk(times)
    contacts = FootContacts(STANDING, LEG)
    for p, t in zip(points[:50], times, strict=False):
        contacts.update(p, t)
    state = contacts.snapshot()
    before = digest(state)
    assert list(leaves(state))

    def go_on() -> str:
        for p, t in zip(points[50:], times[50:], strict=True):
            contacts.update(p, t)
        return digest((contacts.snapshot(), contacts.heights.copy()))

    first = go_on()
    contacts.restore(state)
    assert go_on() == first
    contacts.reset()
    contacts.restore(state)
    assert go_on() == first
    assert digest(state) == before
