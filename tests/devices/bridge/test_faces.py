"""Faces over a bridge: beside the frame that they belong to, unknown to older programs."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from devices.blend_shapes import LONGEST_NAME, MOST_BLENDS
from devices.bridge.messages import (
    LOSSLESS,
    MAX_MESSAGE,
    Call,
    FaceWeights,
    Sample,
    decode,
    encode_answer,
    encode_call,
    encode_face,
    encode_sample,
)
from devices.bridge.messages import Answer as Reply
from devices.bridge.receiver import BridgeReceiver
from devices.builtin.body import builtin_skeleton
from devices.skeleton import SkeletonFrame
from runtime.output.live.bridge_subscribers import BridgeSubscribers

BODY = builtin_skeleton()


def frame(at: float, blends: dict[str, float] | None) -> SkeletonFrame:
    rest = BODY.rest_positions
    return SkeletonFrame(at, rest, None, np.ones(len(rest)), performer=2, blends=blends)


def test_a_face_comes_back_bit_for_bit() -> None:
    blends = {"喜び": 0.1, "jawOpen": 1 / 3}
    assert decode(encode_face(7, 9, blends)) == FaceWeights(7, 9, blends)


def test_the_largest_face_fits_a_message() -> None:
    letters = "𝄞" * (LONGEST_NAME - 3)
    blends = {f"{letters}{k:03}": 0.1234567890123456 for k in range(MOST_BLENDS)}
    data = encode_face(1, 1, blends)
    assert len(data) <= MAX_MESSAGE
    assert decode(data) == FaceWeights(1, 1, blends)


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[]", b"{}", b'{"a": null}', b'{"a": 1e999}', b"\xff\xfe", b"[" * 5000]
)
def test_damaged_faces_are_no_messages(body: bytes) -> None:
    head = encode_face(1, 1, {"a": 1.0})[: 8 + struct.calcsize("<QQ")]
    assert decode(head + body) is None
    assert decode(head[:-1]) is None


def test_a_sample_is_as_it_was_before_faces() -> None:
    """An older subscriber reads it, and skips the face as a message of no known kind."""
    assert encode_sample(1, 1, frame(1.0, {"a": 0.5})) == encode_sample(1, 1, frame(1.0, None))
    assert isinstance(decode(encode_sample(1, 1, frame(1.0, {"a": 0.5}))), Sample)


def test_subscribers_get_each_face_with_its_frame() -> None:
    publisher, receiver = BridgeSubscribers(BODY, lambda: 5.0), BridgeReceiver(LOSSLESS)

    def exchange(now: float) -> list[SkeletonFrame]:
        replies = publisher.read(b"route", receiver.call(now))
        sent = [*replies, *(data for _, data in publisher.due())]
        return [got for data in sent for got in receiver.feed(data, now)]

    exchange(5.0)
    faces = [{"a": 0.25}, None, {"a": 0.5, "b": 1.0}, {}]
    for k, face in enumerate(faces):
        publisher.publish(frame(5.0 + k / 100, face))
    got = exchange(5.1)
    assert [one.blends for one in got] == [{"a": 0.25}, None, {"a": 0.5, "b": 1.0}, None]
    assert receiver.refused == 0


def test_a_face_of_another_frame_or_session_is_not_taken() -> None:
    receiver = BridgeReceiver(LOSSLESS)
    publisher = BridgeSubscribers(BODY, lambda: 5.0)
    for reply in publisher.read(b"route", receiver.call(5.0)):
        receiver.feed(reply, 5.0)
    session = receiver.session
    for number, (of, sequence) in enumerate(((session, 9), (session + 2, 2)), start=1):
        receiver.feed(encode_face(of, sequence, {"a": 1.0}), 5.0)
        (got,) = receiver.feed(encode_sample(session, number, frame(5.0, None)), 5.0)
        assert got.blends is None


def test_a_publisher_takes_no_face_for_a_call() -> None:
    publisher = BridgeSubscribers(BODY, lambda: 5.0)
    assert publisher.read(b"x", encode_face(1, 1, {"a": 1.0})) == []
    assert publisher.refused == 1
    assert isinstance(decode(encode_call(Call(1, 0, 0, 0.0, 5, LOSSLESS))), Call)
    assert isinstance(decode(encode_answer(Reply(1, 0, 0.0, 0.0, 0.0))), Reply)
