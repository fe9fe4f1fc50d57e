"""The loop, frame by frame: what is performed, kept, dropped and drawn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from replay.player import EveryFrame, Player, RealTime
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.show.loop import FrameLoop
from tests.runtime.show.loops import Kept, Tape, Wire, loop_of, play, two_performers
from tests.runtime.stick_figures import frame as captured
from tests.runtime.stick_figures import (
    make_figure,
    record,
    waving,
)


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(make_figure())


def test_every_frame_is_performed_exactly_once(puppet: Puppet) -> None:
    player = Player(record(waving(9)), EveryFrame())
    kept, tape, report = Kept(), Tape(), Report(None)
    loop = loop_of(player, [puppet], [[kept]], report=report, recorder=tape)
    assert play(loop, player) == loop.frames == 9
    assert not loop.tick(), "and nothing after the end"
    assert [frame.index for frame in kept.frames] == list(range(9))
    np.testing.assert_allclose([frame.time for frame in kept.frames], np.arange(9) / 10.0)
    assert loop.seconds == pytest.approx(0.8)
    assert report.dropped == 0
    for index, frame in enumerate(tape.frames):
        np.testing.assert_array_equal(frame.positions, player.recording.positions[index])
    heights = np.array([frame.vertices[:, 1].max() for frame in kept.frames])
    assert heights[4] > heights[0] + 0.2, "the arm is up in the middle"
    assert heights[8] == pytest.approx(heights[0], abs=0.02)
    assert all(frame.picture is None for frame in kept.frames)


def test_all_stages_are_timed_once_a_frame(puppet: Puppet) -> None:
    player = Player(record(waving(5)), EveryFrame())
    report = Report(None)
    loop = loop_of(player, [puppet], [[Kept()]], report=report)
    play(loop, player)
    loop.tick()
    stages = {name: int(counts.sum()) for name, counts in report.times._counts.items()}
    assert stages.pop("latency") == 0  # nobody knows when the frames of a file arrived
    assert stages == dict.fromkeys(
        ("poll", "match", "retarget", "deform", "render", "publish", "frame", "settle"), 5
    )


def test_latency_is_told_from_arrival_on(puppet: Puppet) -> None:
    frames = [replace(captured(waving(1)[0]), arrival=12.0)]
    report = Report(None)
    loop = loop_of(Wire(frames), [puppet], [[Kept()]], report=report, clock=lambda: 12.004)
    loop.tick()
    assert loop.latency == pytest.approx(0.004)
    assert report.times.summary()["latency"]["max"] == pytest.approx(4.0)


def test_outputs_are_called_in_order_each_with_its_own_puppet(puppet: Puppet) -> None:
    other = Puppet(make_figure(((-0.24, 0.32, -0.16), (0.24, 0.72, 0.16))))
    log: list[str] = []
    outputs = [[Kept(log=log), Kept(log=log)], [Kept(log=log)]]
    player = Player(record(waving(3)), EveryFrame())
    play(loop_of(player, [puppet, other], outputs), player)
    order = [id(output) for kept in outputs for output in kept]
    assert log == [f"{number}:{index}" for index in range(3) for number in order]
    first, second, third = (output.frames[-1] for kept in outputs for output in kept)
    np.testing.assert_array_equal(first.vertices, second.vertices)
    assert len(first.vertices) == len(puppet.character.vertices)
    assert len(third.vertices) == len(other.character.vertices) != len(first.vertices)


def test_two_replays_are_the_same_to_the_last_bit(puppet: Puppet) -> None:
    runs = []
    for _ in range(2):
        kept = Kept()
        player = Player(record(waving(5)), EveryFrame())
        play(loop_of(player, [puppet], [[kept]]), player)
        runs.append(np.array([frame.vertices for frame in kept.frames]))
    np.testing.assert_array_equal(*runs)


def test_a_loop_goes_on_from_a_snapshot_as_it_did_the_first_time(puppet: Puppet) -> None:
    """Shown or not, settled or not, and after frames that are forgotten again."""
    player, kept = Player(record(waving(12)), EveryFrame()), Kept(math.inf)
    loop = loop_of(player, [puppet], [[kept]])
    for _ in range(4):
        loop.tick()
    states = player.snapshot(), loop.snapshot()
    play(loop, player)
    for go_on in (FrameLoop.tick, FrameLoop.advance):
        player.restore(states[0])
        loop.restore(states[1])
        np.testing.assert_array_equal(loop.motions[0].vertices, kept.frames[3].vertices)
        assert (loop.frames, loop.received) == (4, 4)
        loop.settle()
        shapes = []
        while not player.ended:
            go_on(loop)
            shapes.append(loop.motions[0].vertices.copy())
        wanted = [frame.vertices for frame in kept.frames[4:12]]
        np.testing.assert_array_equal(shapes, wanted)
        assert loop.seconds == pytest.approx(1.1)
    assert len(kept.frames) == 12 + 8, "what is only advanced is not published"


def test_it_does_not_matter_to_what_is_shown_who_settles_and_when(puppet: Puppet) -> None:
    shown = []
    for settles in (True, False):
        player, kept = Player(record(waving(9)), EveryFrame()), Kept()
        loop = loop_of(player, [puppet], [[kept]])
        while not player.ended:
            loop.tick()
            if settles:
                loop.settle()
                loop.settle()  # once is enough
        shown.append(np.array([frame.vertices for frame in kept.frames]))
    np.testing.assert_array_equal(*shown)


def test_a_hurried_show_goes_on_from_what_was_shown(puppet: Puppet) -> None:
    shown = []
    for leave in (FrameLoop.settle, FrameLoop.hurry):
        player, kept = Player(record(waving(9)), EveryFrame()), Kept()
        loop = loop_of(player, [puppet], [[kept]])
        while not player.ended:
            loop.tick()
            leave(loop)
        shown.append(np.array([frame.vertices for frame in kept.frames]))
    patient, hurried = shown
    np.testing.assert_array_equal(hurried[0], patient[0])
    gaps = np.abs(hurried - patient).max(axis=(1, 2))
    assert 0.0 < gaps.max() < 0.02 * np.ptp(patient)


def test_what_a_slow_loop_skips_is_counted_and_recorded(puppet: Puppet) -> None:
    now = [50.0]
    player = Player(record(waving(10)), RealTime(clock=lambda: now[0]))
    kept, tape, report = Kept(), Tape(), Report(None)
    loop = loop_of(player, [puppet], [[kept]], report=report, recorder=tape)
    performed = []
    for step in (0.0, 0.05, 0.06, 0.35, 0.001, 1.0):
        now[0] += step
        performed.append(loop.tick())
    # Due by then: frame 0, none, 1, 2 to 4, none, 5 to 9.
    assert performed == [True, False, True, True, False, True]
    assert report.dropped == 2 + 4
    assert loop.frames + report.dropped == len(tape.frames) == 10
    np.testing.assert_allclose([f.time - 50.0 for f in kept.frames], [0.0, 0.1, 0.4, 0.9])


def test_a_bystanders_frames_are_counted_and_move_nothing(puppet: Puppet) -> None:
    recording = two_performers(5)
    player = Player(recording, EveryFrame())
    kept, tape, report = Kept(), Tape(), Report(None)
    loop = loop_of(player, [puppet], [[kept]], report=report, recorder=tape)
    assert play(loop, player) == len(recording)
    assert [frame.performer for frame in tape.frames] == [4, 9] * 5
    for first, second in zip(kept.frames[::2], kept.frames[1::2], strict=True):
        np.testing.assert_array_equal(first.nodes.positions, second.nodes.positions)
    assert kept.frames[4].nodes.positions[:, 1].max() > kept.frames[0].nodes.positions[:, 1].max()

    now = [0.0]
    player = Player(recording, RealTime(clock=lambda: now[0]))
    loop = loop_of(player, [puppet], [[Kept()]], report=report)
    while not player.ended:
        loop.tick()
        now[0] += 0.3
    assert loop.frames + report.dropped == len(recording), "each performed or dropped"
