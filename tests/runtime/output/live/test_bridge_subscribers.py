"""Both ends of a bridge joined by hand, without sockets, threads or a real clock."""

from __future__ import annotations

import random

import numpy as np
import pytest

from devices.bridge.messages import (
    LATEST,
    LOSSLESS,
    MAX_CREDIT,
    VERSION,
    Call,
    Sample,
    decode,
    encode_announcement,
    encode_answer,
    encode_call,
    encode_sample,
)
from devices.bridge.messages import Answer as AnswerMessage
from devices.bridge.receiver import BEAT, CREDIT, BridgeReceiver
from devices.builtin.body import builtin_skeleton
from devices.skeleton import SkeletonFrame
from runtime.output.live.bridge_queue import LosslessQueue, Parcel
from runtime.output.live.bridge_subscribers import (
    ANNOUNCED,
    MOST_CREDIT,
    MOST_SUBSCRIBERS,
    QUIET,
    SILENCE,
    BridgeSubscribers,
)
from tests.runtime.output.live.bridge_wire import BODY, Wire, frame, number_of


@pytest.mark.parametrize("mode", [LATEST, LOSSLESS])
def test_a_stage_that_calls_gets_skeleton_and_frames(mode: int) -> None:
    wire = Wire(mode)
    wire.subscribers.publish(frame(1))
    assert wire.exchange() == [], "what was before it came, it is not owed"
    skeleton = wire.receiver.skeleton
    assert skeleton is not None
    assert skeleton.names == BODY.names
    wire.call()
    for number in (2, 3):
        wire.subscribers.publish(frame(number))
        wire.load()
    assert [number_of(one) for one in wire.deliver()] == [2, 3]
    assert wire.receiver.lost == wire.receiver.refused == 0


def test_the_skeleton_is_told_until_it_was_heard() -> None:
    wire = Wire(LATEST)
    wire.call()
    wire.under_way = wire.under_way[:1]  # the announcement is lost
    wire.deliver()
    assert wire.receiver.skeleton is None
    wire.now += ANNOUNCED
    wire.exchange()
    assert wire.receiver.skeleton is not None
    wire.call()
    assert len(wire.under_way) == 1, "and then no more"


def test_times_are_on_the_stages_clock_whatever_the_bridges_shows() -> None:
    wire = Wire(LATEST, offset=-4321.5, there=0.002, back=0.002)
    for _ in range(3):
        wire.exchange()
    wire.call()
    truth = wire.now - 0.01
    wire.subscribers.publish(frame(5, time=truth + wire.offset))
    wire.load()
    (heard,) = wire.deliver()
    assert heard.time == pytest.approx(truth, abs=1e-6)
    assert heard.arrival == wire.now


@pytest.mark.parametrize(("there", "back"), [(0.03, 0.001), (0.001, 0.03), (0.02, 0.02)])
def test_uneven_ways_shift_times_by_half_the_difference_at_most(there: float, back: float) -> None:
    wire = Wire(LATEST, offset=77.0, there=there, back=back)
    for _ in range(5):
        wire.exchange()
    error = wire.receiver.clock.seconds - 77.0
    assert error == pytest.approx((there - back) / 2.0, abs=1e-6)
    assert abs(error) <= wire.receiver.clock.bound == pytest.approx((there + back) / 2.0, rel=0.01)
    wire.call()
    wire.subscribers.publish(frame(1, time=wire.now + 77.0))
    wire.load()
    assert wire.deliver()[0].time <= wire.now, "never after it came"


def test_the_latest_wins_for_each_performer_where_the_way_is_slow() -> None:
    wire = Wire(LATEST)
    wire.exchange()
    wire.call()
    wire.deliver()
    credit = CREDIT[LATEST]
    for number in range(1, 501):
        wire.subscribers.publish(frame(number, performer=number % 2))
        wire.load()
    first = wire.deliver()
    assert [number_of(one) for one in first] == list(range(1, credit + 1)), "as many as fit"
    wire.call()
    newest = wire.deliver()
    assert [number_of(one) for one in newest] == [499, 500], "then the newest of each"
    assert [one.performer for one in newest] == [1, 0]
    assert wire.receiver.lost == 500 - credit - 2
    assert wire.subscribers.lost == 0, "nobody was owed them"


def test_nothing_is_lost_where_nothing_may_be() -> None:
    """Ten thousand frames past a stage that takes some now and then and stands still in between."""
    rng = random.Random(2)
    wire = Wire(LOSSLESS)
    wire.exchange()
    inbox: list[SkeletonFrame] = []
    taken: list[int] = []
    published = 0
    for _ in range(2000):
        for _ in range(min(rng.randint(0, 400), 10_000 - published)):
            published += 1
            wire.subscribers.publish(frame(published))
        wire.call(waiting=len(inbox))
        inbox += wire.deliver()
        assert len(inbox) <= CREDIT[LOSSLESS], "no more comes than there is room for"
        if rng.random() < 0.2:
            taken += [number_of(one) for one in inbox]
            inbox.clear()
    assert taken == list(range(1, 10_001))
    assert wire.receiver.lost == wire.subscribers.lost == 0
    wire.exchange()
    assert wire.subscribers.settled


def test_what_was_under_way_when_the_line_broke_is_sent_again() -> None:
    rng = random.Random(3)
    wire = Wire(LOSSLESS)
    wire.exchange()
    for number in range(1, 2001):
        wire.subscribers.publish(frame(number))
        wire.load()
        if rng.random() < 0.05:
            wire.under_way = wire.under_way[: rng.randint(0, len(wire.under_way))]
            wire.route = rng.randbytes(5)  # a new connection
            wire.deliver()
            wire.call()
        if rng.random() < 0.3:
            wire.deliver()
            wire.call()
    for _ in range(10):
        wire.exchange()
    assert [number_of(one) for one in wire.heard] == list(range(1, 2001))
    assert wire.receiver.lost == 0


def test_where_the_latest_win_a_broken_line_costs_what_was_on_it() -> None:
    wire = Wire(LATEST)
    wire.exchange()
    wire.call()
    for number in range(1, 11):
        wire.subscribers.publish(frame(number))
        wire.load()
    wire.under_way, wire.route = [], b"two"
    wire.exchange()
    wire.subscribers.publish(frame(11))
    wire.load()
    assert [number_of(one) for one in wire.deliver()] == [11]
    assert wire.receiver.lost == 10


def test_a_bridge_that_starts_anew_goes_on_with_the_show() -> None:
    wire = Wire(LOSSLESS, offset=10.0)
    wire.exchange()
    for number in range(1, 100):
        wire.subscribers.publish(frame(number))
    wire.exchange()
    first_session = wire.receiver.session
    wire.offset = -999.0  # another machine's clock
    wire.new_bridge()
    wire.exchange()
    assert wire.receiver.session != first_session
    wire.call()
    truth = wire.now
    for number in range(1, 4):
        wire.subscribers.publish(frame(number, time=truth + wire.offset))
    wire.load()
    heard = wire.deliver()
    assert [number_of(one) for one in heard] == [1, 2, 3], "its numbers start from the front"
    assert heard[0].time == pytest.approx(truth)
    assert wire.receiver.lost == wire.receiver.refused == 0


def test_another_skeleton_is_refused_and_told() -> None:
    wire = Wire(LATEST)
    wire.exchange()
    wire.subscribers = BridgeSubscribers(builtin_skeleton(), lambda: wire.now)
    wire.exchange()
    assert wire.receiver.strange
    wire.subscribers.publish(frame(1))
    assert wire.exchange() == []
    assert wire.receiver.skeleton is not None
    assert wire.receiver.skeleton.names == BODY.names
    wire.new_bridge()
    wire.exchange()
    assert not wire.receiver.strange, "the right one came back"


def test_frames_of_a_bridge_that_is_gone_are_refused() -> None:
    wire = Wire(LATEST)
    wire.exchange()
    stray = encode_sample(12345, 7, frame(7))
    assert wire.receiver.feed(stray, wire.now) == []
    assert wire.receiver.refused == 1
    assert wire.receiver.feed(encode_announcement(12345, builtin_skeleton()), wire.now) == []
    assert not wire.receiver.strange
    assert BridgeReceiver(LATEST).feed(stray, 0.0) == [], "nor any before the first word"


def test_both_sides_notice_another_version() -> None:
    wire = Wire(LATEST)
    data = bytearray(wire.receiver.call(wire.now))
    data[4] = VERSION + 1
    (reply,) = wire.subscribers.read(b"one", bytes(data))
    assert wire.subscribers.other_version == VERSION + 1
    reply = bytearray(reply)
    reply[4] = VERSION + 3  # what a bridge of that version would have said
    assert wire.receiver.feed(bytes(reply), wire.now) == []
    assert wire.receiver.other_version == VERSION + 3
    wire.exchange()
    assert wire.receiver.other_version is None, "until one of ours answers"


def test_a_stage_calls_in_a_steady_beat_and_before_it_runs_dry() -> None:
    wire = Wire(LOSSLESS)
    assert wire.receiver.call_due(wire.now)
    wire.exchange()
    wire.call()
    assert not wire.receiver.call_due(wire.now + BEAT * 0.9)
    assert wire.receiver.call_due(wire.now + BEAT)
    for number in range(1, CREDIT[LOSSLESS] // 4):
        wire.subscribers.publish(frame(number))
    wire.load()
    wire.deliver()
    assert not wire.receiver.call_due(wire.now)
    wire.subscribers.publish(frame(0))
    wire.load()
    wire.deliver()
    assert wire.receiver.call_due(wire.now)
    assert not wire.receiver.call_due(wire.now, waiting=1), "there is no room for more"


def test_invented_subscribers_shut_out_no_honest_stage() -> None:
    """A connection has one place, and who has fallen silent gives way where all are taken."""
    wire = Wire(LATEST)
    for client in range(1, 41):
        wire.subscribers.read(b"one", encode_call(Call(client, 0, 0, 0.0, 4, LATEST)))
    assert wire.subscribers.count == 1
    for client in range(1, 41):
        wire.subscribers.read(b"r%d" % client, encode_call(Call(client, 0, 0, 0.0, 4, LATEST)))
    assert wire.subscribers.count == MOST_SUBSCRIBERS
    wire.now += QUIET
    wire.exchange()
    wire.subscribers.publish(frame(5))
    assert [number_of(heard) for heard in wire.exchange()] == [5]


def test_who_never_reads_is_sent_no_more_than_its_credit_and_one_announcement() -> None:
    wire = Wire(LATEST)
    call = Call(7, 0, 0, 0.0, MAX_CREDIT, LOSSLESS)
    replies = [wire.subscribers.read(b"deaf", encode_call(call)) for _ in range(1000)]
    assert [len(each) for each in replies] == [2] + [1] * 999
    for index in range(2 * MOST_CREDIT):
        wire.subscribers.publish(frame(index))
    assert len(list(wire.subscribers.due())) == MOST_CREDIT


def test_silent_stages_are_forgotten_and_places_are_few() -> None:
    wire = Wire(LATEST)
    for client in range(1, MOST_SUBSCRIBERS + 5):
        wire.subscribers.read(b"r%d" % client, encode_call(Call(client, 0, 0, 0.0, 4, LATEST)))
    assert wire.subscribers.count == MOST_SUBSCRIBERS
    assert wire.subscribers.refused == 4
    assert wire.subscribers.forget() == 0
    wire.now += SILENCE[True] + 1.0
    assert wire.subscribers.forget() == MOST_SUBSCRIBERS
    wire.exchange()
    assert wire.subscribers.count == 1
    wire.subscribers.read(b"one", wire.receiver.farewell(wire.now))
    assert wire.subscribers.count == 0
    wire.exchange()
    assert wire.subscribers.count == 1, "who calls again is there again"


def test_a_stage_that_was_forgotten_counts_what_it_missed() -> None:
    wire = Wire(LOSSLESS)
    wire.exchange()
    wire.now += SILENCE[False] + 1.0
    assert wire.subscribers.forget() == 1
    for number in range(1, 51):
        wire.subscribers.publish(frame(number))
    wire.exchange()
    wire.subscribers.publish(frame(51))
    wire.load()
    assert [number_of(one) for one in wire.deliver()] == [51]
    assert wire.receiver.lost == 50


def test_a_full_buffer_drops_the_oldest_and_counts() -> None:
    queue = LosslessQueue(0, limit=1000)
    for number in range(1, 101):
        queue.offer(Parcel(number, 0, bytes(100)))
    assert queue.dropped == 90
    drawn = [queue.draw(credit=4) for _ in range(5)]
    assert [one.sequence for one in drawn if one] == [91, 92, 93, 94]
    queue.received(92)
    queue.offer(Parcel(101, 0, bytes(100)))
    queue.offer(Parcel(102, 0, bytes(100)))
    assert queue.dropped == 90, "what has arrived made room"
    queue.reconnect(93)
    rest = [one.sequence for _ in range(20) if (one := queue.draw(credit=50))]
    assert rest == list(range(94, 103))
    assert not queue.empty
    queue.received(102)
    assert queue.empty


def test_noise_moves_neither_side() -> None:
    """Whatever comes in between, good messages are still understood."""
    rng = random.Random(6)
    wire = Wire(LOSSLESS)
    wire.exchange()
    seeds = [
        wire.receiver.call(wire.now),
        encode_sample(wire.receiver.session, 3, frame(3)),
        encode_announcement(wire.receiver.session, BODY),
        encode_answer(AnswerMessage(wire.receiver.session, 0, wire.now, wire.now, wire.now)),
    ]
    for _ in range(3000):
        data = bytearray(rng.choice(seeds))
        for _ in range(rng.randint(1, 8)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        wire.subscribers.read(rng.randbytes(5), bytes(data))
        wire.receiver.feed(bytes(data), wire.now)
    assert wire.subscribers.count <= MOST_SUBSCRIBERS
    assert wire.subscribers.refused > 0
    assert wire.receiver.refused > 0
    for _ in range(10):
        wire.now += 1.0
        wire.exchange()
    for number in range(1, 6):
        wire.subscribers.publish(frame(number, time=wire.now))
    wire.heard.clear()
    wire.exchange()
    assert [number_of(one) for one in wire.heard] == [1, 2, 3, 4, 5]


def test_a_decoded_frame_is_what_was_published() -> None:
    wire = Wire(LATEST)
    wire.exchange()
    wire.call()
    wire.deliver()
    hidden = np.array([[np.nan] * 3, [1.0, 2.0, 3.0]])
    turns = np.array([[np.nan] * 4, [0.0, 0.6, 0.0, 0.8]])
    said = SkeletonFrame(wire.now, hidden, turns, np.array([0.0, 0.25]), performer=31)
    wire.subscribers.publish(said)
    wire.load()
    message = decode(wire.under_way[0])
    assert isinstance(message, Sample)
    (heard,) = wire.deliver()
    np.testing.assert_array_equal(heard.positions, hidden)
    np.testing.assert_array_equal(heard.rotations, turns)
    np.testing.assert_array_equal(heard.confidence, [0.0, 0.25])
    assert heard.performer == 31
