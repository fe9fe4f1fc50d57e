"""The performers of a show for other shows: all poses, under their own numbers, in order."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from devices.bridge.messages import LOSSLESS
from devices.bridge.stream import Bridge, BridgeStream
from devices.builtin.motions import motion_clip
from devices.builtin.simulator import Simulator
from devices.skeleton import SkeletonFrame
from devices.stream import SkeletonStream
from runtime.conditioning.switches import Conditioning, for_live
from runtime.driving.choices import Choices
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer, Pose
from runtime.output.live.bridge_performer import GUESSED, BridgePerformer
from runtime.output.live.bridge_publisher import BridgePublisher, binding
from runtime.output.output import Output, PerformedFrame
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import Act
from runtime.show.loop import FrameLoop
from tests.runtime.show.loops import Kept, Wire
from tests.runtime.stick_figures import ARMS, BODY, FRONT_VIEW, T_POSE, frame, make_figure, pose
from tests.waiting import PATIENCE


@pytest.fixture
def publisher() -> Iterator[BridgePublisher]:
    with BridgePublisher(
        binding("tcp://127.0.0.1:*", None, option="--publish-keys DIR"), BODY, report=lambda _: None
    ) as opened:
        yield opened


def performed(at: float, performers: Sequence[Performer]) -> PerformedFrame:
    poses = tuple(performer.pose for performer in performers)
    return PerformedFrame(0, at, np.zeros((0, 3)), nodes=None, poses=poses)


def heard(stream: BridgeStream, count: int) -> list[SkeletonFrame]:
    frames: list[SkeletonFrame] = []
    deadline = time.monotonic() + PATIENCE
    while len(frames) < count and time.monotonic() < deadline:
        stream.wait(0.05)
        frames += stream.poll()
    return frames


def test_what_is_new_goes_out_once_the_oldest_first(publisher: BridgePublisher) -> None:
    """Whoever has no new pose is not told of again, and who takes over a part has a new number."""
    lead, other, nobody = performers = [Performer(BODY) for _ in range(3)]
    with (
        BridgePerformer(publisher, clock=lambda: 50.0) as output,
        BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as stream,
    ):
        output.write(performed(9.0, performers))  # nobody has come
        lead.follow(frame(pose(), 10.02, performer=4))
        other.follow(frame(pose(T_POSE), 10.01, performer=9))
        output.write(performed(10.02, performers))
        hidden = pose()
        hidden[3] = np.nan
        other.follow(frame(hidden, 10.04, performer=9))
        output.write(performed(10.04, performers))
        output.write(performed(10.05, performers))
        other.follow(frame(pose(), 10.06, performer=2))
        output.write(performed(10.06, performers))
        frames = heard(stream, 4)
        assert stream.traffic.dropped == 0
    assert nobody.pose is None
    assert [each.performer for each in frames] == [9, 4, 9, 2]
    assert np.diff([each.time for each in frames]) == pytest.approx([0.01, 0.02, 0.02])
    np.testing.assert_array_equal(frames[0].positions, pose(T_POSE))
    np.testing.assert_array_equal(frames[1].positions, pose())
    assert np.isfinite(frames[2].positions).all()
    assert np.flatnonzero(frames[2].confidence == GUESSED).tolist() == [3]


def two_acts(switches: Conditioning) -> list[Act]:
    """Two performers with a character each."""
    acts = []
    for _ in range(2):
        performer, puppet = Performer(BODY, conditioning=switches), Puppet(make_figure())
        hands = [Mapping(ARMS)]
        match_session = MatchSession(performer, [puppet], lambda: FRONT_VIEW, Choices(), hands)
        acts.append(Act(performer, [puppet], match_session))
    return acts


def loop_over(
    stream: SkeletonStream, acts: list[Act], outputs: Sequence[Sequence[Output]]
) -> FrameLoop:
    return FrameLoop(
        stream,
        acts,
        report=Report(None),
        scene=None,
        outputs=outputs,
        conditioning=for_live(),
    )


def test_a_second_stage_has_both_performers_as_the_first_has_them(
    publisher: BridgePublisher,
) -> None:
    now = [time.perf_counter()]
    stream = Simulator(motion_clip("wave"), lambda: now[0], performers=2)
    acts = two_acts(for_live())
    performers = [act.performer for act in acts]
    output = BridgePerformer(publisher, clock=lambda: now[0])
    loop = loop_over(stream, acts, [[output], []])
    poses: list[Pose] = []
    with output, BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as bridge:
        for _ in range(90):
            now[0] += 1.0 / 60.0
            loop.tick()
            poses += [one.pose for one in performers if one.pose is not None]
        frames = heard(bridge, len(poses))
    assert [one.performer for one in frames] == [one.performer for one in poses] == [0, 1] * 90
    for sent, came in zip(poses, frames, strict=True):
        np.testing.assert_array_equal(came.positions, sent.seen)

    switches = for_live()
    switches.filter = False  # what is smooth is not smoothed again
    again, kept = two_acts(switches), [[Kept()], [Kept()]]
    captures = Wire(frames)
    second = loop_over(captures, again, kept)
    while not captures.ended:
        second.tick()
    for number, act in enumerate(again):
        pose_there, pose_here = act.performer.pose, performers[number].pose
        assert pose_there is not None
        assert pose_here is not None
        assert pose_there.performer == number
        np.testing.assert_allclose(pose_there.seen, pose_here.seen, atol=0.01)
    turns = [np.array([one.nodes.positions for one in output.frames]) for (output,) in kept]
    assert all(np.ptp(one, axis=0).max() > 0.2 for one in turns), "both characters wave"
    assert np.abs(turns[0] - turns[1]).max() > 0.2, "each by itself, a second apart"
