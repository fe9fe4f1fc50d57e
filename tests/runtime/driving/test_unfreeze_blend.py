"""Characters that were frozen ease to where their performer is by then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from replay.player import EveryFrame, Player
from runtime.driving.choices import Choices
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer, Pose
from runtime.driving.unfreeze_blend import SECONDS, UnfreezeBlend, shortest_turns
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import Act
from runtime.show.loop import FrameLoop
from tests.runtime.show.loops import Kept
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    LEGS,
    T_POSE,
    make_figure,
    pose,
    record,
)
from tests.runtime.stick_figures import frame as captured

RATE = 60.0
UP = {"ShoulderLeft": (0.0, 0.0, 1.5), "ElbowRight": (0.0, 1.2, 0.0)}
STEPS = round(SECONDS * RATE)


def followed(positions: np.ndarray, time: float = 0.0) -> Pose:
    return Performer(BODY).follow(captured(positions, time))


def bones_of(seen: np.ndarray) -> np.ndarray:
    inner = BODY.parents >= 0
    return seen[inner] - seen[BODY.parents[inner]]


def let_go(
    held: Pose, target: Pose, times: Sequence[float], blend: UnfreezeBlend | None = None
) -> list[Pose]:
    """What is followed at `times` after a hold of two seconds that ends at 2.0 s."""
    blend = blend or UnfreezeBlend(BODY)
    blend.follow(held, 0.0, [None])
    blend.freeze(1.0)
    blend.freeze(2.0)
    return [blend.follow(target, time, [None]) for time in times]


def test_the_shortest_turn_takes_one_direction_to_the_other() -> None:
    x, y, z, none = *np.eye(3), np.zeros(3)
    bones = np.array([x, 2.0 * y, x, z, x, none, y])
    wanted = np.array([y, z, -3.0 * x, -z, x, x, none])
    turns = shortest_turns(bones, wanted)
    quarter, half = np.pi / 2.0, np.pi
    np.testing.assert_allclose(turns[:2], [quarter * z, quarter * x])
    np.testing.assert_allclose(np.linalg.norm(turns[2:4], axis=1), half)
    on_the_way = Rotation.from_rotvec(0.5 * turns[2:4]).apply(bones[2:4])
    np.testing.assert_allclose(on_the_way, [z, y], atol=1e-12, err_msg="front, and over the top")
    assert not turns[4:].any()
    random = np.random.default_rng(0).normal(size=(2, 50, 3))
    there = Rotation.from_rotvec(shortest_turns(*random)).apply(random[0])
    np.testing.assert_allclose(np.cross(there, random[1]), 0.0, atol=1e-12)
    assert ((there * random[1]).sum(axis=1) > 0.0).all()


def test_it_departs_from_the_pose_held_and_arrives_exactly() -> None:
    held = followed(pose(UP, heading=0.9, moved=(0.4, -0.1, 0.3)))
    target = followed(pose(T_POSE, heading=-0.5, moved=(-1.0, 0.2, 0.0)))
    first, *_, late, last, after = let_go(
        held, target, 2.0 + np.array([0.0, 0.1, 0.2, 0.2999, 0.3001, 0.4])
    )
    np.testing.assert_allclose(first.seen, held.seen, atol=1e-12)
    np.testing.assert_allclose(first.hips, held.hips, atol=1e-12)
    assert first.heading == pytest.approx(held.heading)
    np.testing.assert_allclose(late.seen, target.seen, atol=1e-4)
    assert last.seen is after.seen is target.seen
    assert (last.heading, last.hips) == (target.heading, target.hips)


def test_every_bone_nears_its_place_and_keeps_its_length() -> None:
    """An arm from up to down goes round, not through a point."""
    held, target = followed(pose(UP)), followed(pose({"ShoulderLeft": (0.0, 0.0, -1.6)}))
    way = let_go(held, target, 2.0 + np.arange(STEPS + 2) / RATE)
    lengths = np.linalg.norm(bones_of(target.seen), axis=1)
    wanted = bones_of(target.seen) / lengths[:, None]
    cosines = []
    for each in way:
        bones = bones_of(each.seen)
        np.testing.assert_allclose(np.linalg.norm(bones, axis=1), lengths, atol=1e-9)
        cosines.append((bones / lengths[:, None] * wanted).sum(axis=1))
    assert min(cosines[0]) < -0.9, "one goes nearly all the way round"
    assert (np.diff(cosines, axis=0) > -1e-12).all(), "and none ever back"
    angles = np.arccos(np.clip(cosines, -1.0, 1.0))
    assert angles[STEPS // 2].max() == pytest.approx(angles[0].max() / 2.0, abs=1e-6)


def test_rotations_ease_with_the_bones() -> None:
    """A head that was turned while the characters were frozen does not snap."""
    held, target = followed(pose(heading=0.4)), followed(pose(heading=-0.3))
    turns = Rotation.from_rotvec([[0.0, 1.2, 0.0]] * len(BODY.names))
    held = replace(held, rotations=(Rotation.from_rotvec([0.0, 0.4, 0.0]) * turns).as_quat())
    own = Rotation.from_rotvec([[0.0, -0.3, 0.0]] * len(BODY.names)).as_quat()
    own[3] = np.nan
    target = replace(target, rotations=own)
    times = 2.0 + np.linspace(0.0, SECONDS, STEPS + 1)
    eased = let_go(held, target, times)
    yaws = []
    for each in eased:
        assert each.rotations is not None
        assert np.isnan(each.rotations[3]).all()
        yaws.append(Rotation.from_quat(each.rotations[0]).as_rotvec()[1])
    assert yaws[0] == pytest.approx(1.6, abs=0.02)
    assert yaws[-1] == pytest.approx(-0.3, abs=1e-9)
    assert np.abs(np.diff(yaws)).max() < 3.0 * 1.9 / STEPS
    assert (np.diff(yaws) < 0.0).all()


@pytest.mark.parametrize(("start", "end"), [(3.0, -3.0), (-2.5, 2.9), (0.4, 1.9), (7.0, 0.2)])
def test_a_body_turns_the_short_way(start: float, end: float) -> None:
    held, target = (followed(pose(T_POSE, heading=angle)) for angle in (start, end))
    way = let_go(held, target, 2.0 + np.arange(STEPS + 1) / RATE)
    turns = np.unwrap([each.heading for each in way])
    short = abs((start - end + np.pi) % (2.0 * np.pi) - np.pi)
    assert np.ptp(turns) == pytest.approx(short)
    steps = np.diff(turns)
    assert (steps >= 0.0).all() or (steps <= 0.0).all()
    assert np.abs(steps).max() < 1.51 * short / STEPS
    for each in way:
        measured = followed(each.seen).heading
        assert np.cos(measured - each.heading) == pytest.approx(1.0), "what it says it does"


def test_a_second_hold_on_the_way_departs_from_there() -> None:
    blend = UnfreezeBlend(BODY)
    held, target = followed(pose(UP, heading=0.5)), followed(pose(T_POSE, heading=2.5))
    *_, halfway = let_go(held, target, [2.05, 2.1, 2.15], blend)
    blend.freeze(2.3)
    again = blend.follow(followed(pose(heading=-2.0)), 2.3, [None])
    np.testing.assert_allclose(again.seen, halfway.seen, atol=1e-12)
    assert np.cos(again.heading - halfway.heading) == pytest.approx(1.0)


def test_a_rest_state_that_is_taken_meanwhile_is_there_at_once() -> None:
    blend, target = UnfreezeBlend(BODY), followed(pose(T_POSE))
    let_go(followed(pose(UP)), target, [2.05], blend)
    assert blend.follow(target, 2.1, [object()]).seen is target.seen


def test_who_is_lost_on_the_way_goes_on_from_there() -> None:
    """Also who is lost while held: another performer's frames are the show's time."""
    target = followed(pose(T_POSE))
    way = let_go(followed(pose(UP)), target, [2.1, 9.0, 9.1, 9.2, 9.3])
    shares = [np.abs(each.seen - target.seen).max() for each in way]
    assert shares[0] > shares[1] > shares[2] > shares[4] == 0.0


def test_a_gap_in_the_frames_is_eased_over_like_a_freeze() -> None:
    held, target = followed(pose(T_POSE)), followed(pose(UP, moved=(0.7, 0.0, 0.3)))
    blend = UnfreezeBlend(BODY)
    for step in range(3):
        blend.follow(held, step / RATE, [None])
    times = 6.0 + np.arange(STEPS + 10) / RATE
    seen = [blend.follow(replace(target, time=time), time, [None]) for time in times]
    steps = [np.linalg.norm(a.hips - b.hips) for a, b in zip([held, *seen], seen, strict=False)]
    assert max(steps) < 3.0 * np.linalg.norm(target.hips - held.hips) / STEPS
    np.testing.assert_array_equal(seen[-1].seen, target.seen)
    assert seen[0].time < 0.2, "what drives by time has not waited"


def test_slow_streams_are_shown_as_they_come() -> None:
    blend = UnfreezeBlend(BODY)
    for second in range(4):
        given = followed(pose(UP, moved=(0.2 * second, 0.0, 0.0)))
        np.testing.assert_array_equal(blend.follow(given, float(second), [None]).seen, given.seen)


def test_the_time_of_what_is_held_stands_still() -> None:
    blend = UnfreezeBlend(BODY)
    blend.freeze(100.0)  # before anybody came: nothing to hold
    times = []
    for time in (100.0, 100.1, 100.2, 103.0, 103.1, 103.6):
        if time in (100.2, 103.0):
            blend.freeze(time)
        else:
            followed_at = blend.follow(followed(pose(UP), time), time, [None])
            times.append(followed_at.time)
    np.testing.assert_allclose(times, [100.0, 100.1, 100.2, 100.7])


# -- In a show -------------------------------------------------------------------------------------


FREEZE, CHANGE, LET_GO, END = 20, 80, 140, 200  # frames: two seconds held still
FASTEST = 12.0  # [m/s] of any vertex; a hand goes 8 m/s half round in 0.3 s, and the body turns too


def poses_of(part: int) -> list[np.ndarray]:
    """Still in one pose until the midst of the freeze, from then on in quite another."""
    sides = T_POSE if part == 0 else UP
    before = pose(sides, heading=2.8)
    legs = {"HipLeft": (-0.9, 0.0, 0.0), "KneeRight": (0.6, 0.0, 0.0)}
    arms = {"ShoulderLeft": (0.0, 0.0, -1.2), "ShoulderRight": (0.5, 0.0, 1.1)}
    after = pose(arms | legs, heading=-2.6, moved=(0.5, 0.1, 0.0))
    return [before] * CHANGE + [after] * (END - CHANGE)


def frozen_show(parts: int, *, freeze: bool = True) -> np.ndarray:
    """Vertices (parts, T, N, 3) of a show that is frozen for two seconds."""
    tracks = [poses_of(part) for part in range(parts)]
    poses = [each for together in zip(*tracks, strict=True) for each in together]
    recording = record(poses, rate=RATE * parts, performers=list(range(parts)) * len(tracks[0]))
    player, acts = Player(recording, EveryFrame()), []
    for _ in range(parts):
        performer, puppet = Performer(BODY), Puppet(make_figure())
        hands = [Mapping(ARMS + LEGS)]
        rest = captured(pose(), -1.0)
        match_session = MatchSession(performer, [puppet], lambda: FRONT_VIEW, Choices(), hands)
        performer.follow(rest)
        match_session.direct(rest)
        acts.append(Act(performer, [puppet], match_session))
    kept = [[Kept()] for _ in acts]
    loop = FrameLoop(
        player,
        acts,
        report=Report(None),
        scene=None,
        outputs=kept,
    )
    while not player.ended:
        loop.frozen = freeze and parts * FREEZE <= loop.frames < parts * LET_GO
        loop.tick()
        loop.settle()
    return np.array([[frame.vertices for frame in output.frames] for (output,) in kept])


def stretch_of(shapes: np.ndarray) -> np.ndarray:
    """How far (T,) the edge stretched most is, as a share of its length."""
    figure = make_figure()
    near, far = np.concatenate([figure.faces[:, [0, 1]], figure.faces[:, [1, 2]]]).T
    rest = np.linalg.norm(figure.vertices[far] - figure.vertices[near], axis=1)
    lengths = np.linalg.norm(shapes[:, far] - shapes[:, near], axis=2)
    return (lengths / rest).max(axis=1)


@pytest.mark.parametrize("parts", [1, 2])
def test_no_vertex_jumps_and_no_edge_tears_when_a_freeze_ends(parts: int) -> None:
    frozen, free = frozen_show(parts), frozen_show(parts, freeze=False)
    first, let_go_at = parts * FREEZE - 1, parts * LET_GO
    for shapes, unfrozen in zip(frozen, free, strict=True):
        assert (shapes[first:let_go_at] == shapes[first]).all(), "held still"
        change = np.abs(shapes[-1] - shapes[first]).max()
        assert change > 0.6, "there is far to go"
        steps = np.linalg.norm(np.diff(shapes[let_go_at - 1 :], axis=0), axis=2).max(axis=1)
        assert steps[0] > 0.0, "it begins at once"
        assert steps.max() < FASTEST / (RATE * parts)
        assert steps[: parts * STEPS].sum() > change
        ends = stretch_of(shapes[[first, -1]]).max()
        assert stretch_of(shapes[let_go_at:]).max() < 1.1 * ends
        np.testing.assert_allclose(shapes[-1], unfrozen[-1], atol=1e-4)


def test_a_show_that_was_frozen_is_the_same_twice() -> None:
    np.testing.assert_array_equal(frozen_show(2), frozen_show(2))
