"""VMC's frames: put together from datagrams that are lost, late or sent twice."""

from __future__ import annotations

import numpy as np
import pytest

from devices.bodies.humanoid_kernels import INFERRED, UNSURE
from devices.osc.vmc_decoder import VmcDecoder
from devices.skeleton import SkeletonFrame
from tests.devices.osc.vmc_frames import CORE, STEP, bare, fed, joint, official, waving
from tests.devices.vmc_sender import at, bones, bundle, expected, message, ok, slime


def test_a_bundle_a_frame_gives_each_frame_as_it_comes() -> None:
    decoder = VmcDecoder()
    assert decoder.feed(slime(0.0, waving(0)), 100.0) == []  # nobody knows yet that it is whole
    for k in range(1, 30):
        frames = decoder.feed(slime(k * STEP, waving(k)), 100.0 + k * STEP)
        newest = frames[-1]
        assert len(frames) == (2 if k == 1 else 1)
        assert newest.positions == pytest.approx(expected(waving(k)), abs=1e-6)
        assert newest.arrival == 100.0 + k * STEP
        assert newest.time == pytest.approx(newest.arrival, abs=1e-4)
        assert (newest.confidence == 1.0).all()
    assert decoder.refused == 0


@pytest.mark.parametrize("cycle", [official, bare])
def test_a_frame_in_many_datagrams_is_put_together(cycle: object) -> None:
    assert callable(cycle)
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(30):
        begin = 50.0 + k * STEP
        for number, data in enumerate(cycle(k, waving(k))):
            frames += decoder.feed(data, begin + number * 2e-5)
    assert len(frames) == 30
    for k, frame in enumerate(frames):
        assert frame.positions == pytest.approx(expected(waving(k)), abs=1e-6)
        assert 0.0 <= frame.arrival - (50.0 + k * STEP) < 0.003
    times = np.diff([frame.time for frame in frames[3:]])
    assert times == pytest.approx(STEP, abs=0.002)
    assert decoder.refused == 0


def test_joining_in_the_middle_of_a_frame_sets_itself_right() -> None:
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(10):
        datagrams = [bundle(bones(waving(k))[part : part + 11]) for part in range(0, 55, 11)]
        for number, data in enumerate(datagrams):
            if k > 0 or number > 2:
                frames += decoder.feed(data, 50.0 + k * STEP + number * 1e-4)
    settled = [frame for frame in frames if frame.arrival > 50.0 + 4 * STEP]
    assert len(settled) == 6
    for k, frame in enumerate(settled, start=4):
        assert frame.positions == pytest.approx(expected(waving(k)), abs=1e-6)


@pytest.mark.parametrize("before", [0, 20], ids=["at the start", "in the midst"])
def test_frames_that_waited_in_a_queue_tear_none_after_them(before: int) -> None:
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    now = 50.0
    for k in range(before + 40):
        waited = before <= k < before + 12
        now += 0.0 if waited else STEP
        for part in (slice(0, 20), slice(20, 40), slice(40, 55)):
            said = bones(waving(k))[part] + (
                [ok(1, 3, 0, 1), at(k * STEP)] if part.start == 40 else []
            )
            frames += decoder.feed(bundle(said), now)
            now += 3e-5 if waited else 2e-4
    assert len(frames) == before + 40
    for k, frame in enumerate(frames):
        assert frame.positions == pytest.approx(expected(waving(k)), abs=1e-6)


def test_a_lost_datagram_leaves_its_bones_as_they_were_and_no_later_frame_torn() -> None:
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(12):
        for number, part in enumerate((slice(0, 30), slice(30, 55))):
            if not (k == 6 and number == 1):
                data = bundle(bones(waving(k))[part])
                frames += decoder.feed(data, 50.0 + k * STEP + number * 1e-4)
    assert len(frames) == 12
    assert set(frames[6].confidence[30:]) == {UNSURE}
    for k in (5, 7, 8, 11):
        assert frames[k].positions == pytest.approx(expected(waving(k)), abs=1e-6)


def test_a_model_that_is_not_loaded_gives_no_frames_and_bad_tracking_is_unsure() -> None:
    decoder = VmcDecoder()
    assert fed(decoder, [(k * STEP, bundle([*bones(), ok(0)])) for k in range(5)]) == []
    assert len(fed(decoder, [(1 + k * STEP, bundle([*bones(), ok(1)])) for k in range(5)])) == 5
    unsure = fed(decoder, [(2 + k * STEP, bundle([*bones(), ok(1, 3, 0, 0)])) for k in range(3)])
    assert set(unsure[-1].confidence) == {UNSURE}


def test_expressions_are_committed_together() -> None:
    decoder = VmcDecoder()
    decoder.feed(bundle([message("/VMC/Ext/Blend/Val", "喜び", 0.5)]), 0.0)
    assert decoder.expressions == {}
    decoder.feed(bundle([message("/VMC/Ext/Blend/Val", "A", 1.0)]), 0.0)
    decoder.feed(bundle([message("/VMC/Ext/Blend/Apply")]), 0.0)
    assert decoder.expressions == {"喜び": 0.5, "A": 1.0}
    for number in range(2000):
        decoder.feed(message("/VMC/Ext/Blend/Val", f"name {number}", 1.0).dgram, 0.0)
    decoder.feed(message("/VMC/Ext/Blend/Apply").dgram, 0.0)
    assert len(decoder.expressions) == 512
    assert decoder.refused == 2000 - 512


def test_duplicates_and_late_datagrams_change_nothing() -> None:
    plain, shaken = VmcDecoder(), VmcDecoder()
    data = [(10.0 + k * STEP, slime(k * STEP, waving(k))) for k in range(40)]
    wanted = fed(plain, data)
    order = []
    for k, (when, one) in enumerate(data):
        order.append((when, one))
        if k % 3 == 0:
            order.append((when + 1e-4, one))
        if k % 7 == 6:
            order.append((when + 2e-4, data[k - 2][1]))
    found = fed(shaken, order)
    assert len(found) == len(wanted)
    for a, b in zip(found, wanted, strict=True):
        assert np.array_equal(a.positions, b.positions)
        assert a.time == pytest.approx(b.time, abs=0.01)
    assert shaken.refused > 10


def test_a_sender_that_starts_again_is_followed_at_once_whatever_its_clock() -> None:
    decoder = VmcDecoder()
    before = fed(decoder, [(10 + k * STEP, slime(900 + k * STEP, waving(k))) for k in range(30)])
    smaller = [name for name in CORE if name != "Jaw"]
    after = fed(
        decoder,
        [
            (15 + k * STEP, bundle([at(k * STEP), ok(), *bones(waving(k), only=smaller)]))
            for k in range(30)
        ],
    )
    assert (len(before), len(after)) == (30, 30)
    times = [frame.time for frame in [*before, *after]]
    assert times == sorted(times)
    assert after[-1].arrival - after[-1].time < 0.01
    assert after[-1].confidence[joint("Jaw")] == INFERRED
    assert after[-1].positions[joint("LeftHand")] == pytest.approx(
        expected(waving(29))[joint("LeftHand")], abs=0.02
    )


@pytest.mark.parametrize("back", [0.1, 0.25, 100.0])
def test_a_clock_that_is_set_back_or_stands_does_not_end_the_show(back: float) -> None:
    decoder = VmcDecoder()
    fed(decoder, [(k * STEP, slime(500 + k * STEP, waving(k))) for k in range(30)])
    standing = slime(500 + 29 * STEP - back)
    frames = fed(decoder, [(1 + k * STEP, standing) for k in range(300)])
    assert len(frames) > 250
    assert frames[-1].arrival - frames[-1].time < 0.02
