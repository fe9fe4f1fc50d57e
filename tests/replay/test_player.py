"""The player: frames at their times, seeking, speed and loops."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.skeleton import Skeleton
from devices.stream import open_stream
from replay.playback import playback_of
from replay.player import EveryFrame, FrameTiming, Player, RealTime
from replay.recorded_stream import RecordedStream
from replay.recording import Recording
from tests.thorough import examples

POINT = Skeleton(("point",), np.array([-1]), np.zeros((1, 3)))


def recording(times: list[float]) -> Recording:
    """One joint whose x is the number of the frame."""
    count = len(times)
    positions = np.zeros((count, 1, 3))
    positions[:, 0, 0] = np.arange(count)
    return Recording(
        skeleton=POINT,
        times=np.array(times),
        positions=positions,
        rotations=None,
        confidence=np.ones((count, 1)),
        performers=np.zeros(count, dtype=np.int64),
        arrivals=np.full(count, math.nan),
    )


UNEVEN = [0.0, 0.1, 0.15, 0.5, 0.6]  # median step 0.1


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def polled(player: Player) -> list[int]:
    return [int(frame.positions[0, 0]) for frame in player.poll()]


def test_real_time_keeps_the_recorded_timing() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock))
    given_at = {}
    for tick in range(70):
        clock.now = 1000.0 + tick * 0.01
        for frame in player.poll():
            given_at[int(frame.positions[0, 0])] = clock.now
            assert frame.time == pytest.approx(1000.0 + UNEVEN[int(frame.positions[0, 0])])
            assert frame.arrival == clock.now
    assert player.ended
    late = np.array([given_at[i] - 1000.0 - t for i, t in enumerate(UNEVEN)])
    assert ((late > -1e-9) & (late < 0.01 + 1e-9)).all()


def test_speed_divides_the_time_between_frames() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(4.0, clock))
    player.poll()
    clock.now += 10.0
    times = [frame.time for frame in player.poll()]
    np.testing.assert_allclose(times, 1000.0 + np.array(UNEVEN[1:]) / 4.0)


def test_a_late_poll_gives_every_frame_that_was_due() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock))
    assert polled(player) == [0]
    clock.now += 0.5000001
    assert polled(player) == [1, 2, 3]
    assert polled(player) == []
    assert not player.ended


def test_every_frame_comes_exactly_once_whatever_the_clock() -> None:
    player = Player(recording(UNEVEN), EveryFrame())
    frames = []
    while not player.ended:
        polls = player.poll()
        assert len(polls) == 1
        frames += polls
    assert [frame.time for frame in frames] == UNEVEN
    assert all(math.isnan(frame.arrival) for frame in frames)
    assert player.poll() == []


def test_loops_go_on_with_rising_time() -> None:
    player = Player(recording(UNEVEN), EveryFrame(), loop=True)
    frames = [player.poll()[0] for _ in range(12)]
    assert [int(frame.positions[0, 0]) for frame in frames] == [*range(5), *range(5), 0, 1]
    steps = np.diff([frame.time for frame in frames])
    np.testing.assert_allclose(steps[4], 0.1)
    np.testing.assert_allclose(steps[5:9], np.diff(UNEVEN))
    assert not player.ended


def test_a_loop_that_was_not_polled_for_an_hour_gives_at_most_one_pass() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock), loop=True)
    player.poll()
    clock.now += 3600.0
    frames = player.poll()
    assert 0 < len(frames) <= 5
    assert clock.now - 2.0 < frames[0].time <= frames[-1].time <= clock.now


def test_a_single_frame_can_loop() -> None:
    player = Player(recording([0.0]), EveryFrame(), loop=True)
    times = [player.poll()[0].time for _ in range(3)]
    np.testing.assert_allclose(np.diff(times), 1 / 30)


@pytest.mark.parametrize(("to", "expected"), [(0.12, 2), (0.15, 2), (-5.0, 0), (99.0, 4)])
def test_seek_goes_to_the_first_frame_at_or_after(to: float, expected: int) -> None:
    clock = Clock()
    for pace in (EveryFrame(), RealTime(1.0, clock)):
        player = Player(recording(UNEVEN), pace)
        player.poll()
        player.seek(to)
        assert player.position == pytest.approx(min(max(to, 0.0), 0.6))
        clock.now += 0.05
        assert polled(player)[0] == expected
        assert player.position == UNEVEN[expected]


def test_seek_after_the_end_plays_again() -> None:
    player = Player(recording(UNEVEN), EveryFrame())
    while not player.ended:
        last = player.poll()[0].time
    player.seek(0.0)
    assert not player.ended
    assert player.poll()[0].time == pytest.approx(last + 0.1)


def test_pause_stands_still_and_resume_does_not_catch_up() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock))
    player.poll()
    clock.now += 0.12
    assert polled(player) == [1]
    player.pause()
    clock.now += 60.0
    assert player.paused
    assert polled(player) == []
    player.resume()
    assert polled(player) == []
    clock.now += 0.04
    assert polled(player) == [2]


def test_a_seek_while_paused_holds() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock))
    player.poll()
    player.pause()
    clock.now += 5.0
    player.seek(0.5)
    clock.now += 5.0
    player.resume()
    assert polled(player) == [3]
    clock.now += 0.09
    assert polled(player) == []


def test_the_paused_player_of_every_frame_gives_none() -> None:
    player = Player(recording(UNEVEN), EveryFrame())
    player.poll()
    player.pause()
    assert player.poll() == []
    player.resume()
    frames = player.poll()
    assert [frame.time for frame in frames] == [0.1]


def test_a_closed_player_has_ended() -> None:
    with Player(recording(UNEVEN), EveryFrame()) as player:
        player.poll()
    player.close()
    assert player.ended
    assert player.poll() == []


@settings(max_examples=examples(200), deadline=None)
@given(
    st.booleans(),
    st.booleans(),
    st.lists(
        st.tuples(
            st.sampled_from(["poll", "seek", "pause", "resume", "speed", "loop"]),
            st.floats(0, 2, allow_nan=False),
        ),
        max_size=40,
    ),
)
def test_time_never_falls_whatever_is_done(
    loop: bool, real: bool, acts: list[tuple[str, float]]
) -> None:
    clock = Clock()
    pace: FrameTiming = RealTime(2.0, clock) if real else EveryFrame()
    player = Player(recording(UNEVEN), pace, loop=loop)
    newest = -math.inf
    for act, amount in acts:
        clock.now += amount
        if act == "seek":
            player.seek(amount)
        elif act == "pause":
            player.pause()
        elif act == "resume":
            player.resume()
        elif act == "speed":
            player.speed = 0.01 + amount
        elif act == "loop":
            player.loop = amount < 1.0
        for frame in player.poll():
            assert frame.time >= newest - 1e-9
            assert not frame.arrival < frame.time - 1e-9
            newest = frame.time


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="speed"):
        RealTime(speed)
    for timing in (RealTime(2.0), EveryFrame()):
        player = Player(recording(UNEVEN), timing)
        before = player.speed
        with pytest.raises(ValueError, match="speed"):
            player.speed = speed
        assert player.speed == before


def test_another_speed_goes_on_from_where_playback_is() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock))
    player.poll()
    clock.now += 0.12
    player.speed = 0.1
    clock.now += 0.2  # 0.02 recorded
    (first,) = player.poll()
    assert first.time == pytest.approx(1000.1), "due before the change"
    clock.now += 0.2  # 0.16 recorded
    (second,) = player.poll()
    assert second.time == pytest.approx(1000.12 + 0.03 / 0.1)
    player.speed = 100.0
    clock.now += 0.01
    assert polled(player) == [3, 4]


def test_the_speed_is_what_it_was_set_to_before_the_first_frame() -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock))
    player.speed = 2.0
    player.poll()
    clock.now += 0.06
    assert polled(player) == [1]


@pytest.mark.parametrize("real", [False, True])
def test_a_loop_may_be_switched_while_playing(real: bool) -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock) if real else EveryFrame(), loop=True)

    def polled_later() -> list[int]:
        clock.now += 0.1000001
        return polled(player)

    played = [number for _ in range(7) for number in polled_later()]
    assert played[:5] == [0, 1, 2, 3, 4]
    player.loop = False
    for _ in range(9):
        played += polled_later()
    assert played == [0, 1, 2, 3, 4] * 2
    assert player.ended
    clock.now += 100.0
    player.loop = True
    assert not player.ended
    assert polled(player) == [0]
    assert len(polled_later()) <= 2


def test_a_loop_switched_off_at_its_last_frame_ends_there() -> None:
    player = Player(recording(UNEVEN), EveryFrame(), loop=True)
    for _ in range(5):
        player.poll()
    player.loop = False
    assert player.ended


def test_a_state_that_is_put_back_gives_the_same_frames_again() -> None:
    player = Player(recording(UNEVEN), EveryFrame(), loop=True)
    for _ in range(3):
        player.poll()
    state = player.snapshot()
    once = [player.poll()[0] for _ in range(9)]
    player.seek(0.1)
    player.poll()
    for _ in range(2):
        player.restore(state)
        assert player.position == UNEVEN[2]
        again = [player.poll()[0] for _ in range(9)]
        assert [f.time for f in again] == [f.time for f in once]
        assert [f.positions[0, 0] for f in again] == [f.positions[0, 0] for f in once]


@pytest.mark.parametrize("paused", [False, True])
def test_a_state_put_back_in_real_time_goes_on_from_there(paused: bool) -> None:
    clock = Clock()
    player = Player(recording(UNEVEN), RealTime(1.0, clock))
    player.poll()
    clock.now += 0.12
    assert polled(player) == [1]
    state = player.snapshot()
    clock.now += 50.0
    assert polled(player) == [2, 3, 4]
    if paused:
        player.pause()
    player.restore(state)
    assert player.position == 0.1
    assert player.paused == paused
    if paused:
        clock.now += 9.0
        player.resume()
    assert polled(player) == []
    clock.now += 0.0300001
    (frame,) = player.poll()
    assert (frame.positions[0, 0], frame.time) == (2.0, pytest.approx(clock.now))


def test_a_recorded_stream_hands_on_the_playback_and_a_live_one_has_none() -> None:
    player = Player(recording(UNEVEN), EveryFrame())
    playback = playback_of(RecordedStream(RecordedStream(player)))
    assert playback is player
    assert playback.duration == 0.6
    with open_stream("sim://wave") as live:
        assert playback_of(live) is None
        assert playback_of(RecordedStream(live)) is None
