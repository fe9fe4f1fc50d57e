"""What plays is a function of document and time: overrides, additions, eases, loops, solo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from runtime.driving.targets import Placement, PosedNodes
from runtime.session import edits
from runtime.session.document import Session, Take
from runtime.session.performance import PerformanceRecorder
from runtime.session.playing import ActorPlayer, blended
from solvers.skeleton.layers import LayeredNodes
from tests.runtime.session.sessions import chain, session, take

TREE = chain().tree


def angle(session: Session, time: float, node: int = 1) -> float:
    """[rad] about z that a node has turned in its parent."""
    player = ActorPlayer(1, TREE)
    player.play(session, time)
    return float(Rotation.from_quat(player.layered.turns[node]).as_rotvec()[2])


def uneased(session: Session) -> Session:
    for clip in session.clips:
        session = edits.eased(session, clip.id, 0.0, 0.0)
    return session


def test_a_clip_plays_its_take_and_rests_outside_of_it() -> None:
    one = uneased(session(take(1.0), start=3.0))
    assert angle(one, 4.0) == pytest.approx(0.5, abs=1e-6)
    assert angle(one, 5.0) == pytest.approx(1.0, abs=1e-6)
    assert angle(one, 2.9) == angle(one, 5.1) == 0.0
    assert ActorPlayer(1, TREE).play(one, 4.0).placement.travel[0] == pytest.approx(0.5)


def test_the_latest_take_wins_where_both_move_a_node() -> None:
    both = uneased(session(take(1.0, (1, 2)), take(-0.4, (2, 3))))
    assert angle(both, 1.0, 1) == pytest.approx(0.5, abs=1e-6)
    assert angle(both, 1.0, 2) == pytest.approx(-0.2, abs=1e-6)
    assert angle(both, 1.0, 3) == pytest.approx(-0.2, abs=1e-6)
    lowered = edits.raised(both, 2, -1)
    assert angle(lowered, 1.0, 2) == pytest.approx(0.5, abs=1e-6)


def test_weight_and_addition() -> None:
    both = uneased(session(take(1.0), take(-0.4)))
    assert angle(edits.weighted(both, 2, 0.25), 2.0) == pytest.approx(0.65, abs=1e-6)
    more = edits.made_additive(both, 2, True)
    assert angle(more, 2.0) == pytest.approx(0.6, abs=1e-6)
    assert angle(edits.weighted(more, 2, 0.5), 2.0) == pytest.approx(0.8, abs=1e-6)


def test_mute_and_solo() -> None:
    both = uneased(session(take(1.0), take(-0.4)))
    assert angle(edits.muted(both, 2, True), 2.0) == pytest.approx(1.0, abs=1e-6)
    assert angle(edits.soloed(both, 1, True), 2.0) == pytest.approx(1.0, abs=1e-6)


def test_speed_and_passes() -> None:
    one = uneased(session(take(1.0)))
    fast = edits.paced(one, 1, 2.0)
    assert fast.duration == pytest.approx(1.0)
    assert angle(fast, 0.5) == pytest.approx(0.5, abs=1e-6)
    looped = edits.looped(one, 1, 2.5)
    assert looped.duration == pytest.approx(5.0)
    assert angle(looped, 3.0) == pytest.approx(0.5, abs=1e-6)
    assert angle(looped, 5.0) == pytest.approx(0.5, abs=1e-6)
    assert angle(edits.looped(one, 1, 2.0), 4.0) == pytest.approx(1.0, abs=1e-6)


def test_a_clip_comes_and_goes_softly() -> None:
    one = edits.eased(session(take(1.0)), 1, 0.5, 0.5)
    angles = [angle(one, time) for time in np.linspace(0.0, 2.0, 400)]
    assert angles[0] == angles[-1] == 0.0
    assert np.abs(np.diff(angles)).max() < 0.02


@given(at=st.floats(0.01, 1.99), times=st.lists(st.floats(0.0, 2.0), min_size=1, max_size=8))
def test_two_halves_play_what_the_whole_did(at: float, times: list[float]) -> None:
    one = uneased(session(take(1.0)))
    cut = uneased(edits.split(one, 1, at))
    for time in times:
        assert angle(cut, time) == pytest.approx(angle(one, time), abs=1e-6)


@given(start=st.floats(0.0, 0.9), end=st.floats(1.1, 2.0))
def test_what_a_trim_leaves_stays_where_it_is(start: float, end: float) -> None:
    one = uneased(session(take(1.0), start=0.5))
    cut = uneased(edits.trimmed(one, 1, start + 0.5, end + 0.5))
    clip = cut.clip(1)
    assert (clip.start, clip.end) == pytest.approx((start + 0.5, end + 0.5))
    for time in np.linspace(clip.start, clip.end, 5):
        assert angle(cut, float(time)) == pytest.approx(angle(one, float(time)), abs=1e-6)


def test_only_some_nodes() -> None:
    one = uneased(edits.limited(session(take(1.0)), 1, (2,)))
    assert angle(one, 1.0, 1) == 0.0
    assert angle(one, 1.0, 2) == pytest.approx(0.5, abs=1e-6)
    assert ActorPlayer(1, TREE).play(one, 1.0).placement == Placement()


def test_any_order_of_times_gives_the_same_bytes() -> None:
    both = session(take(1.0), take(-0.4, (2, 3)))
    player, times = ActorPlayer(1, TREE), np.linspace(-0.5, 2.5, 31).tolist()
    forward = [player.play(both, time).nodes for time in times]
    backward = [player.play(both, time).nodes for time in reversed(times)]
    for there, back in zip(forward, reversed(backward), strict=True):
        assert_array_equal(there.positions, back.positions)
        assert_array_equal(there.rotations, back.rotations)


def test_a_recorder_keeps_what_moved_and_plays_it_again() -> None:
    layered, random = LayeredNodes(TREE), np.random.default_rng(2)
    recorder = PerformanceRecorder(layered, frozenset({4}))
    wanted = []
    for frame in range(10):
        layered.clear()
        layered.turns[2] = Rotation.from_rotvec([0.0, 0.0, 0.1 * frame]).as_quat()
        layered.shifts[0] = random.normal(size=3)
        positions, rotations = layered.world()

        nodes = PosedNodes(positions, rotations)
        recorder.add(5.0 + 0.1 * frame, nodes, Placement(turn=0.1 * frame), np.zeros(0))
        wanted.append(nodes)
    made = recorder.performance()
    assert made is not None
    assert made.nodes.tolist() == [0, 2, 4]
    played = uneased(session())

    played = uneased(edits.with_take(played, Take(0, "", 1, made), 0.0))
    player = ActorPlayer(1, TREE)
    for frame, nodes in enumerate(wanted):
        shown = player.play(played, float(made.times[frame]))
        assert_allclose(shown.nodes.positions, nodes.positions, atol=1e-6)
        assert shown.placement.turn == pytest.approx(0.1 * frame, abs=1e-6)


def test_placements_blend_by_the_shorter_turn() -> None:
    half = blended(Placement(turn=3.0), Placement(turn=-3.0, travel=(2.0, 0.0)), 0.5)
    assert math.cos(half.turn) == pytest.approx(-1.0)
    assert half.travel == (1.0, 0.0)
    assert blended(Placement(), Placement(clearance=0.4), 0.5).clearance == pytest.approx(0.2)
