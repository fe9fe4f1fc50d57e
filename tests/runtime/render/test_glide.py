"""Camera and lights glide after who travels: softly, never too late, and the same each time."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.render.glide import FASTEST, SLACK, Glide
from tests.runtime.snapshots import digest

RATE = 60


def glided(glide: Glide, ways: np.ndarray, start: int = 0, rate: int = RATE) -> np.ndarray:
    """Where it is in each frame (T, 2) [m], after one character's ways (T, 2) [m]."""
    places = []
    for number, way in enumerate(ways, start):
        glide.follow(way[None], number / rate)
        places.append(glide.places[0].copy())
    return np.array(places)


def straight(speed: float, seconds: float, rate: int = RATE) -> np.ndarray:
    """A way along x that begins after half a second."""
    times = np.arange(round(seconds * rate)) / rate
    return np.column_stack([speed * np.maximum(times - 0.5, 0.0), np.zeros(len(times))])


def test_it_starts_where_the_character_is() -> None:
    np.testing.assert_array_equal(glided(Glide(1), np.array([[7.0, -3.0]]))[0], [7.0, -3.0])


def test_swaying_moves_nothing() -> None:
    sway = SLACK * np.sin(np.arange(300) / 9.0)
    assert not glided(Glide(1), np.column_stack([sway, 0.0 * sway])).any()


@pytest.mark.parametrize(("speed", "behind"), [(1.3, 0.3), (4.0, 0.45)])
def test_who_walks_or_runs_is_never_left_behind(speed: float, behind: float) -> None:
    ways = straight(speed, 6.0)
    places = glided(Glide(1), ways)
    assert np.linalg.norm(ways - places, axis=1).max() < behind
    assert (np.diff(places[:, 0]) >= 0.0).all()


def test_it_starts_and_stops_softly_and_does_not_run_past() -> None:
    ways = straight(1.3, 3.0)
    ways = np.vstack([ways, np.repeat(ways[-1:], 200, axis=0)])
    places = glided(Glide(1), ways)
    assert places[:, 0].max() <= ways[-1, 0]
    assert np.abs(np.diff(places[:, 0], 2)).max() * RATE**2 < 12.0, "[m/s2]"
    assert ways[-1, 0] - places[-1, 0] == pytest.approx(SLACK, abs=0.03)
    np.testing.assert_array_equal(places[-1], places[-2])  # so that the backdrop can be kept


def test_nothing_is_faster_than_can_be_watched() -> None:
    ways = np.cumsum(np.full((60, 2), 0.5), axis=0)  # 42 m/s
    steps = np.linalg.norm(np.diff(glided(Glide(1), ways), axis=0), axis=1)
    assert steps.max() <= FASTEST / RATE + 1e-9


def test_who_is_put_elsewhere_is_there_at_once() -> None:
    ways = np.vstack([straight(2.0, 4.0), np.zeros((1, 2))])
    np.testing.assert_array_equal(glided(Glide(1), ways)[-1], [0.0, 0.0])


def test_it_is_about_the_same_at_every_rate() -> None:
    fine, coarse = (glided(Glide(1), straight(1.5, 4.0, rate), rate=rate) for rate in (120, 30))
    assert np.abs(fine[::4] - coarse).max() < 0.06


def test_each_character_is_followed_by_itself() -> None:
    pair, alone = Glide(2), Glide(1)
    ways = straight(2.0, 3.0)
    for number, way in enumerate(ways):
        pair.follow(np.array([[0.0, 0.0], way]), number / RATE)
    np.testing.assert_allclose(pair.places[1], glided(alone, ways)[-1], atol=1e-12)
    assert not pair.places[0].any()


def test_a_snapshot_goes_on_the_same() -> None:
    ways, glide, other = straight(2.0, 3.0), Glide(1), Glide(1)
    glided(glide, ways[:80])
    state = glide.snapshot()
    went = glided(glide, ways[80:], 80)
    other.restore(state)
    assert digest(other.snapshot()) == digest(state)
    np.testing.assert_array_equal(glided(other, ways[80:], 80), went)
    other.restore(state)
    np.testing.assert_array_equal(glided(other, ways[80:], 80), went)
