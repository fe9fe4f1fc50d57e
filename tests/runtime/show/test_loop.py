"""The loop, frame by frame: what is performed, kept, dropped and drawn."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Self

import moderngl
import numpy as np
import pytest

from devices.skeleton import SkeletonFrame
from replay.player import EveryFrame, Player, RealTime
from replay.recorded_stream import RecordedStream
from replay.recording import Recording
from runtime.conditioning.switches import Conditioning, filled_only, for_live
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.puppet_match import Choices
from runtime.output.output import PerformedFrame
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import Act
from runtime.show.loop import FrameLoop
from runtime.show.scene import Scene
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    NODES,
    T_POSE,
    make_figure,
    pose,
    record,
    waving,
)
from tests.runtime.stick_figures import frame as captured

SIZE = (48, 27)


class Kept:
    """An output that keeps all in memory."""

    def __init__(self, pictures_a_second: float = 0.0, log: list[str] | None = None) -> None:
        self.pictures_a_second = pictures_a_second
        self.frames: list[PerformedFrame] = []
        self.log = log if log is not None else []

    def write(self, frame: PerformedFrame) -> None:
        self.frames.append(replace(frame, vertices=frame.vertices.copy()))
        self.log.append(f"{id(self)}:{frame.index}")

    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None: ...

    @property
    def pictured(self) -> list[float]:
        return [frame.time for frame in self.frames if frame.picture is not None]


class Tape:
    """A recorder in memory."""

    def __init__(self) -> None:
        self.frames: list[SkeletonFrame] = []

    def write(self, frame: SkeletonFrame) -> None:
        self.frames.append(frame)


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(make_figure())


def loop_of(  # what every show needs, with what a test cares for
    player: Player | Wire,
    puppets: list[Puppet],
    outputs: list[list[Kept]],
    *,
    report: Report | None = None,
    scene: Scene | None = None,
    recorder: Tape | None = None,
    conditioning: Conditioning | None = None,
    shown: bool = False,
    clock: Callable[[], float] = time.monotonic,
) -> FrameLoop:
    for puppet in puppets:
        puppet.rest()
        puppet.surface.reset()
    performer = Performer(BODY)
    hands = [Mapping(ARMS)] * len(puppets)
    match_session = MatchSession(performer, puppets, lambda: FRONT_VIEW, Choices(), hands)
    return FrameLoop(
        player if recorder is None else RecordedStream(player, recorder.write),
        [Act(performer, puppets, match_session)],
        report=report or Report(None),
        scene=scene,
        outputs=outputs,
        conditioning=conditioning,
        shown=shown,
        clock=clock,
    )


def play(loop: FrameLoop, player: Player | Wire) -> int:
    ticks = 0
    while not player.ended:
        ticks += loop.tick()
    return ticks


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


def two_performers(count: int) -> Recording:
    """A performer who waves and a second one who stands, frame by frame in turn."""
    poses = [still for moving in waving(count) for still in (moving, pose())]
    return record(poses, rate=20.0, performers=[4, 9] * count)


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


@pytest.mark.parametrize("asked", [(0.0,), (3.0,), (2.0, 7.0), (20.0,), (60.0,), (math.inf, 1.0)])
def test_pictures_come_as_often_as_asked_for(
    puppet: Puppet, context: moderngl.Context, asked: tuple[float, ...]
) -> None:
    """Of 20 frames a second, unevenly spaced; whoever asks for most sets the pace for all."""
    scene = Scene(context, SIZE, [puppet], BODY)
    kept = [Kept(rate) for rate in asked]
    recording = record([pose()] * 20, rate=20.0)
    recording.times[1:-1] += np.random.default_rng(0).uniform(-0.005, 0.005, 18)
    player = Player(recording, EveryFrame())
    play(loop_of(player, [puppet], [kept], scene=scene), player)
    scene.close()
    assert kept[0].pictured == kept[-1].pictured
    assert len(kept[0].frames) == 20
    gaps = np.diff(kept[0].pictured)
    if max(asked) == 0.0:
        assert kept[0].pictured == []
    elif max(asked) >= 20.0:
        assert len(gaps) == 19, "there are no more frames than there are"
    else:
        assert kept[0].pictured[0] == 0.0
        assert len(kept[0].pictured) >= int(0.95 * max(asked)), "never fewer than asked for"
        assert gaps.max() < 1.0 / max(asked) + 1.0 / 20.0
        assert gaps.min() > 0.7 / max(asked), "and hardly more"
    for frame in kept[0].frames:
        assert frame.picture is None or frame.picture.shape == (27, 48, 4)


def test_a_picture_shows_its_own_frame(puppet: Puppet, context: moderngl.Context) -> None:
    scene = Scene(context, SIZE, [puppet], BODY)
    kept = Kept(math.inf)
    player = Player(record([*waving(7)[:4], *waving(7)[:4]]), EveryFrame())
    play(loop_of(player, [puppet], [[kept]], scene=scene), player)
    scene.close()
    pictures = [frame.picture.astype(int) for frame in kept.frames]
    assert np.abs(pictures[3] - pictures[0]).max() > 40, "the arm went up"
    assert np.abs(pictures[7] - pictures[3]).mean() < np.abs(pictures[3] - pictures[0]).mean()


def test_who_looks_sees_every_tick(puppet: Puppet, context: moderngl.Context) -> None:
    """Also those without a frame: the camera may have moved."""
    scene = Scene(context, SIZE, [puppet], BODY)
    now = [0.0]
    player = Player(record(waving(3)), RealTime(clock=lambda: now[0]))
    loop = loop_of(player, [puppet], [[Kept()]], scene=scene, shown=True)
    assert loop.tick()
    before = scene.picture()
    scene.camera = scene.camera.orbit(0.8, 0.2)
    assert not loop.tick()
    assert np.abs(scene.picture().astype(int) - before).max() > 40
    scene.close()


class Shown(Kept):
    """A screen somewhere else."""

    def __init__(self, pictures_a_second: float) -> None:
        super().__init__(pictures_a_second)
        self.pictures: list[np.ndarray] = []

    def show(self, picture: np.ndarray) -> None:
        self.pictures.append(picture)


def test_a_screen_goes_on_while_nobody_is_seen_and_files_do_not(
    puppet: Puppet, context: moderngl.Context
) -> None:
    """Also without a performer the light goes out where the audience is."""
    now = [0.0]
    scene = Scene(context, SIZE, [puppet], BODY, clock=lambda: now[0])
    screen, file = Shown(20.0), Kept(20.0)
    wire = Wire([captured(pose(), 0.0)])
    loop = loop_of(wire, [puppet], [[screen, file]], scene=scene, clock=lambda: now[0])
    assert loop.tick()
    scene.blackout.to(1.0)
    for _ in range(120):  # two seconds
        now[0] += 1.0 / 60.0
        assert not loop.tick()
    scene.close()
    assert 38 <= len(screen.pictures) <= 2.0 * 20.0 / 0.75 + 1
    assert screen.pictures[0].max() > 0
    assert not screen.pictures[-1][..., :3].any()
    assert len(screen.frames) == len(file.frames) == 1, "no frame, and so none in a file"


def test_a_frozen_loop_publishes_every_frame_with_the_characters_as_they_were(
    puppet: Puppet,
) -> None:
    player, kept, tape = Player(record(waving(9)), EveryFrame()), Kept(), Tape()
    loop = loop_of(player, [puppet], [[kept]], recorder=tape)
    for _ in range(3):
        loop.tick()
    loop.frozen = True
    for _ in range(3):
        loop.tick()
    loop.frozen = False
    play(loop, player)
    shapes = [frame.vertices for frame in kept.frames]
    assert len(tape.frames) == len(shapes) == 9
    for shape in shapes[3:6]:
        np.testing.assert_array_equal(shape, shapes[2])
    assert np.abs(shapes[6] - shapes[5]).max() > 1e-3
    assert [frame.index for frame in kept.frames] == list(range(9))


def test_each_performer_drives_a_character_of_their_own(puppet: Puppet) -> None:
    """The first waves, the second stands; each has a character."""
    other = Puppet(make_figure())
    player, kept = Player(two_performers(5), EveryFrame()), [[Kept()], [Kept()]]
    hands = [Mapping(ARMS)]
    acts = []
    for one in (puppet, other):
        one.rest()
        performer = Performer(BODY)
        match_session = MatchSession(performer, [one], lambda: FRONT_VIEW, Choices(), hands)
        acts.append(Act(performer, [one], match_session))
    report = Report(None)
    loop = FrameLoop(
        player,
        acts,
        report=report,
        scene=None,
        outputs=kept,
    )
    play(loop, player)
    moved = [np.ptp([frame.vertices[:, 1].max() for frame in output.frames]) for (output,) in kept]
    assert moved[0] > 0.2
    assert moved[1] < 0.02
    assert loop.received == loop.frames == 10
    assert report.dropped == 0


class Wire:
    """A live source that gives these frames, one a poll, as they are."""

    skeleton = BODY

    def __init__(self, frames: list[SkeletonFrame]) -> None:
        self._frames = frames

    @property
    def ended(self) -> bool:
        return not self._frames

    def poll(self) -> list[SkeletonFrame]:
        return [self._frames.pop(0)] if self._frames else []

    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None: ...


def test_a_stream_is_put_in_order_and_recorded_as_it_came(puppet: Puppet) -> None:
    """Every frame comes twice, and half way the sender starts again with another number."""
    clocks = [i / 10.0 + (100.0 if i < 5 else 0.0) for i in range(10)]
    frames = [
        captured(place, time, performer=3 if time >= 100.0 else 8)
        for place, time in zip(waving(10), clocks, strict=True)
        for _ in range(2)
    ]
    wire, kept, tape, report = Wire(list(frames)), Kept(), Tape(), Report(None)
    loop = loop_of(wire, [puppet], [[kept]], report=report, recorder=tape, conditioning=for_live())
    assert play(loop, wire) == 10
    assert all(ours is theirs for ours, theirs in zip(tape.frames, frames, strict=True))
    assert (loop.received, report.dropped) == (20, 10)
    steps = np.diff([each.time for each in kept.frames])
    assert (steps > 0.0).all()
    assert steps.max() < 0.11
    tops = [each.nodes.positions[:, 1].max() for each in kept.frames]
    assert max(tops) > tops[0] + 0.2, "who came back goes on"


def test_a_mirror_that_is_switched_turns_the_character_over(puppet: Puppet) -> None:
    """As a character whose arms are alike stands the same on both sides, so it moves."""
    switches = filled_only()
    performer, tops = Performer(BODY, conditioning=switches), []
    puppet.rest()
    match_session = MatchSession(
        performer, [puppet], lambda: FRONT_VIEW, Choices(), [Mapping(ARMS)]
    )
    names = list(NODES)
    left, right = names.index("wrist.L"), names.index("wrist.R")
    raised = pose(T_POSE | {"ShoulderLeft": (0.0, 0.0, 1.6)})
    for index, (place, mirror) in enumerate(
        [(pose(T_POSE), False), (raised, False), (raised, True), (raised, False)]
    ):
        switches.mirror = mirror
        performer.follow(captured(place, index * 0.1))
        match_session.direct(captured(place, index * 0.1))
        puppet.follow(performer.pose)
        nodes = puppet.deform().nodes.positions
        tops.append((nodes[left, 1], nodes[right, 1]))
    assert tops[1][0] > tops[0][0] + 0.3
    np.testing.assert_allclose(tops[2], tops[1][::-1], atol=0.03)
    np.testing.assert_allclose(tops[3], tops[1], atol=1e-9)


def test_a_pose_that_is_held_becomes_the_rest_state_without_a_hand_free(puppet: Puppet) -> None:
    switches = filled_only()
    switches.recalibrate = True
    puppet.rest()
    performer = Performer(BODY, conditioning=switches)
    match_session = MatchSession(
        performer, [puppet], lambda: FRONT_VIEW, Choices(), [Mapping(ARMS)]
    )
    bent = {"ElbowLeft": (0.0, 0.0, 1.5), "ElbowRight": (0.0, 1.5, 0.0)}
    wire = Wire([captured(pose(bent if i == 0 else T_POSE), i / 10.0) for i in range(14)])
    kept = Kept()
    loop = FrameLoop(
        wire,
        [Act(performer, [puppet], match_session)],
        report=Report(None),
        scene=None,
        outputs=[[kept]],
    )
    play(loop, wire)
    off = [np.abs(each.vertices - puppet.character.vertices).max() for each in kept.frames]
    assert min(off[2:10]) > 0.1, "driven from the bent pose"
    assert off[-1] < 0.01, "and then from the T"
