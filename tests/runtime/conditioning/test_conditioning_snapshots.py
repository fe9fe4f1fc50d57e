"""Conditioning put back to an earlier moment does the same again, to the last bit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.skeleton import SkeletonFrame
from replay.builtin import builtin_recording
from runtime.conditioning.conditioner import ConditionedFrame, Conditioner
from runtime.conditioning.reception import Reception
from runtime.conditioning.switches import SWITCHES, Conditioning
from tests.runtime.snapshots import arrays, digest
from tests.runtime.stick_figures import BODY, T_POSE, pose
from tests.thorough import examples

SHOW = builtin_recording("show")
STEP = 1 / 30
STANDING = pose(T_POSE)


def stick(time: float, performer: int, chance: np.random.Generator) -> SkeletonFrame:
    """A T pose that trembles, with joints lost, exchanged and thrown away."""
    positions = STANDING + chance.normal(0.0, 0.01, (len(BODY.names), 3))
    fault = chance.integers(6)
    if fault == 0:
        positions[chance.random(len(positions)) < 0.3] = np.nan
    elif fault == 1:
        left, right = BODY.names.index("WristLeft"), BODY.names.index("WristRight")
        positions[[left, right]] = positions[[right, left]]
    elif fault == 2:
        positions[chance.integers(len(positions))] += 2.0
    seen = np.isfinite(positions).all(axis=1).astype(float)
    arrival = time + chance.uniform(0.0, 0.01)
    return SkeletonFrame(time, positions, None, seen, performer, arrival)


def faulty_frames(seed: int, count: int) -> list[SkeletonFrame]:
    """Two performers, with duplicates, late frames, clocks that jump and changing numbers."""
    chance = np.random.default_rng(seed)
    frames: list[SkeletonFrame] = []
    shift, numbers = 0.0, [0, 1]
    for step in range(count):
        if chance.random() < 0.05:
            shift += chance.choice([-3.0, 3.0, -0.1])
        if chance.random() < 0.05:
            numbers[chance.integers(2)] = int(chance.integers(5))
        for number in numbers:
            frames.append(stick(1.0 + step * STEP + shift, number, chance))
        if chance.random() < 0.1:
            frames.append(frames[int(chance.integers(len(frames)))])
    return frames


def said(frames: Sequence[ConditionedFrame | SkeletonFrame]) -> list[str]:
    return [digest(frame) for frame in frames]


SWITCHED = st.fixed_dictionaries({name: st.booleans() for name in SWITCHES})


@settings(max_examples=examples(25), deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 30), st.integers(0, 30), SWITCHED, SWITCHED)
def test_a_conditioner_put_back_does_the_same_again(
    seed: int, before: int, after: int, first: dict[str, bool], then: dict[str, bool]
) -> None:
    frames = faulty_frames(seed, before + after)
    switches = Conditioning(**first)
    conditioner = Conditioner(BODY, switches)
    for frame in frames[:before]:
        conditioner.condition(frame)
    for name, on in then.items():
        switches.switch(name, on)
    state = conditioner.snapshot()
    kept = digest(state)
    once = said([conditioner.condition(frame) for frame in frames[before:]])
    ended = digest(conditioner.snapshot())
    another = Conditioner(BODY, switches)
    another.condition(frames[0])
    for each in (conditioner, another):
        each.restore(state)
        assert digest(each.snapshot()) == kept
        assert said([each.condition(frame) for frame in frames[before:]]) == once
        assert digest(each.snapshot()) == ended
        assert digest(state) == kept, "nothing writes into a state"


@settings(max_examples=examples(25), deadline=None)
@given(st.integers(0, 2**32), st.integers(0, 40), st.integers(0, 40), st.booleans(), st.booleans())
def test_a_reception_put_back_does_the_same_again(
    seed: int, before: int, after: int, order: bool, identities: bool
) -> None:
    frames = faulty_frames(seed, before + after)
    switches = replace(Conditioning(), order=order, identities=identities)
    reception = Reception(BODY, switches)
    reception.receive(frames[:before])
    state = reception.snapshot()
    kept = digest(state)
    once = said(reception.receive(frames[before:]))
    counts = reception.timeline.late, reception.timeline.duplicates, reception.timeline.jumps
    another = Reception(BODY, switches)
    for each in (reception, another):
        each.restore(state)
        assert said(each.receive(frames[before:])) == once
        timeline = each.timeline
        assert (timeline.late, timeline.duplicates, timeline.jumps) == counts
        assert digest(state) == kept, "nothing writes into a state"


def test_the_floor_and_sizes_that_were_learned_are_put_back() -> None:
    conditioner = Conditioner(SHOW.skeleton, Conditioning())
    for index in range(0, 120, 2):
        frame = SHOW.frame(index)
        conditioner.condition(replace(frame, positions=1.3 * frame.positions + (0.0, -0.2, 0.0)))
    state, learned = conditioner.snapshot(), conditioner.levelling.level(np.zeros((1, 3)))
    assert abs(learned[0, 1]) > 0.1
    conditioner.recalibrate()
    for index in range(0, 120, 2):
        conditioner.condition(SHOW.frame(index))
    assert abs(conditioner.levelling.level(np.zeros((1, 3)))[0, 1] - learned[0, 1]) > 0.05
    conditioner.restore(state)
    np.testing.assert_array_equal(conditioner.levelling.level(np.zeros((1, 3))), learned)


def test_states_share_no_array_with_the_conditioner() -> None:
    conditioner = Conditioner(BODY, Conditioning(**dict.fromkeys(SWITCHES, True)))
    for frame in faulty_frames(3, 5):
        conditioner.condition(frame)
    first, second = conditioner.snapshot(), conditioner.snapshot()
    for a, b in zip(arrays(first), arrays(second), strict=True):
        assert not np.shares_memory(a, b)
    conditioner.restore(first)
    third = conditioner.snapshot()
    for a, b in zip(arrays(first), arrays(third), strict=True):
        assert not np.shares_memory(a, b)
