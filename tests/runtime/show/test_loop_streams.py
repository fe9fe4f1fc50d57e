"""A loop's streams: performers of their own, order, left and right, calibration."""

from __future__ import annotations

import numpy as np
import pytest

from replay.player import EveryFrame, Player
from runtime.conditioning.switches import filled_only, for_live
from runtime.driving.choices import Choices
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import Act
from runtime.show.loop import FrameLoop
from tests.runtime.show.loops import Kept, Tape, Wire, loop_of, play, two_performers
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    NODES,
    T_POSE,
    make_figure,
    pose,
    waving,
)
from tests.runtime.stick_figures import frame as captured


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(make_figure())


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
        for time in index + np.arange(5) * 0.1:  # the character eases over
            performer.follow(captured(place, time))
            match_session.direct(captured(place, time))
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
    wire = Wire([captured(pose(bent if i == 0 else T_POSE), i / 10.0) for i in range(18)])
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
