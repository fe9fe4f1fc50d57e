"""Time goes forward, whatever packets and clocks do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.skeleton import SkeletonFrame
from runtime.conditioning.timeline import JUMP, MOST_PERFORMERS, Timeline
from tests.thorough import examples

STEP = 1 / 30


def frame(time: float, performer: int = 0, arrival: float = math.nan) -> SkeletonFrame:
    # The place tells one moment from another.
    return SkeletonFrame(time, np.full((2, 3), time), None, np.ones(2), performer, arrival)


def times(timeline: Timeline, *frames: SkeletonFrame) -> list[float]:
    admitted = (timeline.admit(each) for each in frames)
    return [each.time for each in admitted if each is not None]


def test_a_clean_stream_passes_as_it_is() -> None:
    timeline = Timeline()
    for index in range(50):
        for performer in (1, 2):
            each = frame(index * STEP, performer)
            assert timeline.admit(each) is each
    assert (timeline.late, timeline.duplicates, timeline.jumps) == (0, 0, 0)


def test_duplicates_and_late_ones_are_dropped() -> None:
    timeline = Timeline()
    order = [0, 1, 1, 2, 4, 3, 5, 5, 5, 6]
    assert times(timeline, *(frame(i * STEP) for i in order)) == [
        i * STEP for i in (0, 1, 2, 4, 5, 6)
    ]
    assert (timeline.late, timeline.duplicates) == (1, 3)


def test_two_of_one_time_that_differ_are_no_duplicates() -> None:
    timeline = Timeline()
    first = frame(0.0)
    other = SkeletonFrame(0.0, np.ones((2, 3)), None, np.ones(2))
    assert timeline.admit(first) is first
    assert timeline.admit(other) is other


def test_unseen_joints_do_not_hide_a_duplicate() -> None:
    hidden = SkeletonFrame(0.0, np.full((2, 3), np.nan), None, np.zeros(2))
    timeline = Timeline()
    assert timeline.admit(hidden) is hidden
    assert timeline.admit(hidden) is None


@pytest.mark.parametrize("back", [1000.0, 0.6, 0.3])
def test_a_clock_set_back_goes_on_from_where_the_show_was(back: float) -> None:
    timeline = Timeline()
    before = [frame(1000.0 + i * STEP) for i in range(30)]
    after = [frame(1001.0 - back + i * STEP) for i in range(30)]
    shown = times(timeline, *before, *after)
    assert timeline.jumps == 1
    assert len(shown) >= 58, "at most two frames are lost"
    steps = np.diff(shown)
    assert (steps > 0).all()
    assert steps.max() < 1.1 * STEP


def test_a_clock_that_leaps_ahead_of_the_arrivals_is_not_followed() -> None:
    timeline = Timeline()
    frames = [frame(i * STEP + (1e6 if i >= 10 else 0.0), arrival=i * STEP) for i in range(20)]
    np.testing.assert_allclose(times(timeline, *frames), np.arange(20) * STEP)
    away = [frame(1e6 + 60.0, arrival=60.0)]
    assert times(timeline, *away)[0] == pytest.approx(60.0), "who was away really was"


def test_a_time_that_is_no_number_is_dropped() -> None:
    timeline = Timeline()
    assert times(timeline, frame(math.nan), frame(math.inf), frame(1.0)) == [1.0]


def test_all_performers_go_on_after_a_jump() -> None:
    timeline = Timeline()
    shown = times(timeline, *(frame(100.0 + i * STEP, k) for i in range(5) for k in (1, 2, 3)))
    again = times(timeline, *(frame(i * STEP, k) for i in range(5) for k in (3, 1, 2)))
    assert len(again) == 15
    assert min(again) > max(shown)
    assert timeline.jumps == 1


@settings(max_examples=examples(100), deadline=None)
@given(
    st.lists(
        st.tuples(
            st.floats(-1e9, 1e9) | st.floats(0.0, 2.0), st.integers(0, 3), st.floats(0.0, 1.0)
        ),
        max_size=40,
    )
)
def test_each_performers_time_never_falls(packets: list[tuple[float, int, float]]) -> None:
    timeline, newest, arrival = Timeline(), {}, 0.0
    for time, performer, gap in packets:
        arrival += gap
        out = timeline.admit(frame(time, performer, arrival))
        if out is not None:
            assert out.time >= newest.get(performer, -math.inf) - 1e-6
            newest[performer] = out.time


@settings(max_examples=examples(50), deadline=None)
@given(st.lists(st.integers(0, 29), max_size=30))
def test_repeating_what_came_changes_nothing(again: list[int]) -> None:
    clean, repeated = Timeline(), Timeline()
    frames = [frame(i * STEP) for i in range(30)]
    doubled = [f for i, f in enumerate(frames) for f in [f] * (1 + again.count(i))]
    assert times(clean, *frames) == times(repeated, *doubled)
    assert repeated.duplicates == len(again)


def test_numbers_without_end_are_forgotten() -> None:
    timeline = Timeline()
    for index in range(5 * MOST_PERFORMERS):
        timeline.admit(frame(index * 0.001, performer=index))
    assert len(timeline._newest) == MOST_PERFORMERS
    assert JUMP > STEP
