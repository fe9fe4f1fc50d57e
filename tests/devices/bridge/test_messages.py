"""The bridge's messages: what goes in comes out, and no bytes whatever do harm."""

from __future__ import annotations

import json
import os
import random
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from devices.bridge.messages import (
    LATEST,
    LEAVING,
    LOSSLESS,
    MAX_JOINTS,
    MAX_MESSAGE,
    VERSION,
    Announcement,
    Answer,
    Call,
    OtherVersion,
    Sample,
    decode,
    encode_announcement,
    encode_answer,
    encode_call,
    encode_sample,
)
from devices.builtin.body import builtin_skeleton
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame

MUTATIONS = int(os.environ.get("BUNRAKU_MUTATIONS", "3000"))
BODY = builtin_skeleton()
U64 = st.integers(0, 2**64 - 1)
TIMES = st.floats(-1e9, 1e9)


def frame(joints: int = 3, *, rotations: bool = True, performer: int = 7) -> SkeletonFrame:
    rng = np.random.default_rng(joints)
    turns = rng.normal(size=(joints, 4))
    return SkeletonFrame(
        time=12.25,
        positions=rng.normal(size=(joints, 3)),
        rotations=turns / np.linalg.norm(turns, axis=1, keepdims=True) if rotations else None,
        confidence=rng.uniform(size=joints),
        performer=performer,
    )


def sample_of(data: bytes) -> Sample:
    message = decode(data)
    assert isinstance(message, Sample)
    return message


@given(
    st.builds(
        Call,
        client=U64,
        session=U64,
        received=U64,
        called_at=TIMES,
        credit=st.integers(0, 4096),
        mode=st.sampled_from((LATEST, LOSSLESS, LEAVING)),
    )
)
def test_a_call_comes_back(call: Call) -> None:
    assert decode(encode_call(call)) == call


@given(st.builds(Answer, U64, U64, TIMES, TIMES, TIMES))
def test_an_answer_comes_back(answer: Answer) -> None:
    assert decode(encode_answer(answer)) == answer


def test_a_skeleton_comes_back() -> None:
    names = ("Hüfte", "腕", *BODY.names[2:])
    said = Skeleton(names, BODY.parents, BODY.rest_positions)
    heard = decode(encode_announcement(99, said))
    assert isinstance(heard, Announcement)
    assert (heard.session, heard.skeleton.names) == (99, names)
    np.testing.assert_array_equal(heard.skeleton.parents, BODY.parents)
    np.testing.assert_array_equal(heard.skeleton.rest_positions, BODY.rest_positions)


@settings(deadline=None)  # the first example compiles
@given(
    arrays.arrays(np.float64, (5, 3), elements=st.floats(-1e3, 1e3)),
    st.integers(0, 2**32 - 1),
    TIMES,
    U64,
    st.booleans(),
)
def test_a_frame_comes_back_bit_for_bit(
    positions: np.ndarray, performer: int, time: float, sequence: int, turned: bool
) -> None:
    said = SkeletonFrame(
        time=time,
        positions=positions,
        rotations=frame(5).rotations if turned else None,
        confidence=frame(5).confidence,
        performer=performer,
    )
    heard = sample_of(encode_sample(4, sequence, said))
    assert (heard.session, heard.sequence) == (4, sequence)
    assert (heard.time, heard.performer) == (time, performer)
    assert heard.positions.tobytes() == said.positions.tobytes()
    assert heard.confidence.tobytes() == said.confidence.tobytes()
    if said.rotations is None:
        assert heard.rotations is None
    else:
        assert heard.rotations is not None
        assert heard.rotations.tobytes() == said.rotations.tobytes()
    framed = heard.frame(1.0, 2.0)
    assert (framed.time, framed.arrival, framed.performer) == (1.0, 2.0, performer)


def test_the_layout_is_the_one_that_is_documented() -> None:
    """Put together by hand, so that a version number is changed when the layout is."""
    head = struct.pack("<4sBBH", b"BNRK", 1, 4, 0)
    fields = struct.pack("<QQdIHB", 5, 6, 1.5, 7, 1, 1)
    numbers = struct.pack("<8d", 0.1, 0.2, 0.3, 0.9, 0.0, 0.0, 0.0, 1.0)
    heard = sample_of(head + fields + numbers)
    assert (heard.session, heard.sequence, heard.time, heard.performer) == (
        5,
        6,
        1.5,
        7,
    )
    np.testing.assert_array_equal(heard.positions, [[0.1, 0.2, 0.3]])
    np.testing.assert_array_equal(heard.confidence, [0.9])
    np.testing.assert_array_equal(heard.rotations, [[0.0, 0.0, 0.0, 1.0]])
    call = Call(1, 2, 3, 4.5, 6, LOSSLESS)
    layout = struct.pack("<4sBBHQQQdHB", b"BNRK", 1, 1, 0, 1, 2, 3, 4.5, 6, 1)
    assert encode_call(call) == layout
    answer = struct.pack("<4sBBHQQddd", b"BNRK", 1, 2, 0, 1, 2, 3.5, 4.5, 5.5)
    assert encode_answer(Answer(1, 2, 3.5, 4.5, 5.5)) == answer


def test_what_was_not_seen_and_what_no_sensor_says() -> None:
    positions = np.array([[np.nan] * 3, [0.0, np.inf, 0.0], [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    said = SkeletonFrame(
        time=0.0,
        positions=positions,
        rotations=np.array([[np.nan] * 4, [0.0] * 4, [0.0, 0.0, 0.0, 2.0], [0.5, 0.5, 0.5, 0.5]]),
        confidence=np.array([0.5, 0.5, 7.0, np.nan]),
    )
    heard = sample_of(encode_sample(1, 1, said))
    np.testing.assert_array_equal(heard.positions[:2], np.full((2, 3), np.nan))
    np.testing.assert_array_equal(heard.positions[2:], positions[2:])
    np.testing.assert_array_equal(heard.confidence, [0.0, 0.0, 1.0, 0.0])
    assert heard.rotations is not None
    assert np.isnan(heard.rotations[:2]).all()
    np.testing.assert_array_equal(heard.rotations[2:], [[0, 0, 0, 1], [0.5, 0.5, 0.5, 0.5]])


def test_another_version_is_told_from_noise() -> None:
    data = bytearray(encode_call(Call(1, 2, 3, 4.0, 5, LATEST)))
    data[4] = VERSION + 1
    assert decode(bytes(data)) == OtherVersion(VERSION + 1)
    assert decode(bytes(data[:8])) == OtherVersion(VERSION + 1)
    assert decode(b"BNRK") is None
    assert decode(b"") is None
    assert decode(b"BNRQ" + bytes(data[4:])) is None


def announced(**fields: object) -> bytes:
    content = {"names": ["a", "b"], "parents": [-1, 0], "rest_positions": [[0, 0, 0], [0, 1, 0]]}
    text = json.dumps({**content, **fields}).encode()
    return struct.pack("<4sBBHQ", b"BNRK", VERSION, 3, 0, 1) + text


def test_a_good_announcement_made_by_hand_is_read() -> None:
    assert isinstance(decode(announced()), Announcement)


@pytest.mark.parametrize(
    "fields",
    [
        {"names": 3},
        {"names": ["a", "a"]},
        {"names": ["a", 1]},
        {"names": [f"j{i}" for i in range(MAX_JOINTS + 1)]},
        {"names": []},
        {"parents": [1, 0]},
        {"parents": [-1, 7]},
        {"parents": [-1, -1]},
        {"parents": [-1, 1e400]},
        {"parents": [-1, 2**80]},
        {"parents": [-1]},
        {"parents": {"a": 1}},
        {"rest_positions": [[0, 0, 0], [0, 1e9, 0]]},
        {"rest_positions": [[0, 0, 0], [0, float("nan"), 0]]},
        {"rest_positions": [[0, 0, 0]]},
        {"rest_positions": [[0, 0, 0], [0, 0]]},
        {"rest_positions": "far"},
    ],
)
def test_a_damaged_skeleton_is_refused(fields: dict[str, object]) -> None:
    assert decode(announced(**fields)) is None


def test_json_that_nests_without_end_is_refused() -> None:
    head = struct.pack("<4sBBHQ", b"BNRK", VERSION, 3, 0, 1)
    assert decode(head + b"[" * 200_000) is None
    assert decode(head + b'{"names":' * 20_000) is None
    assert decode(head + b"\xff\xfe") is None
    assert decode(head[:-1]) is None


def test_sizes_are_not_believed() -> None:
    good = encode_sample(1, 1, frame(3))
    for wrong in (good[:-1], good + b"\0", good[:20]):
        assert decode(wrong) is None
    at = 8 + struct.calcsize("<QQdI")  # the number of joints
    for joints in (0, 2, 4, 65535):
        assert decode(good[:at] + struct.pack("<H", joints) + good[at + 2 :]) is None
    assert decode(good + bytes(MAX_MESSAGE)) is None
    assert decode(encode_call(Call(1, 2, 3, float("nan"), 5, LATEST))) is None
    assert decode(encode_call(Call(1, 2, 3, 4.0, 65535, LATEST))) is None
    assert decode(encode_call(Call(1, 2, 3, 4.0, 5, 9))) is None
    assert decode(encode_answer(Answer(1, 2, 3.0, float("inf"), 5.0))) is None
    late = SkeletonFrame(float("nan"), np.zeros((1, 3)), None, np.ones(1))
    assert decode(encode_sample(1, 1, late)) is None


def test_the_largest_frame_fits_and_a_larger_skeleton_is_told() -> None:
    assert isinstance(decode(encode_sample(1, 1, frame(MAX_JOINTS))), Sample)
    count = MAX_JOINTS + 1
    names = tuple(f"joint {number}" for number in range(count))
    many = Skeleton(names, np.arange(count) - 1, np.zeros((count, 3)))
    with pytest.raises(InputError, match="1025 joints is too large"):
        encode_announcement(1, many)


def test_mutated_messages_never_raise() -> None:
    """`BUNRAKU_MUTATIONS=200000` for the long run."""
    rng = random.Random(4)
    seeds = [
        encode_call(Call(1, 2, 3, 4.0, 5, LATEST)),
        encode_answer(Answer(1, 2, 3.0, 4.0, 5.0)),
        encode_announcement(1, BODY),
        encode_sample(1, 2, frame(19)),
        encode_sample(1, 2, frame(2, rotations=False)),
    ]
    understood = 0
    for _ in range(MUTATIONS):
        data = bytearray(rng.choice(seeds))
        for _ in range(rng.randint(1, 6)):
            at = rng.randrange(len(data))
            match rng.randrange(5):
                case 0:
                    data[at] ^= 1 << rng.randrange(8)
                case 1:
                    data[at : at + 8] = rng.randbytes(8)
                case 2:
                    del data[at + 1 :]
                case 3:
                    data += data[at : at + 40]
                case 4:
                    data[at : at + 8] = struct.pack("<d", rng.choice((np.nan, np.inf, 1e308)))
        message = decode(bytes(data))
        understood += message is not None
        if isinstance(message, Sample):
            one = message
            seen = np.isfinite(one.positions).all(axis=1)
            np.testing.assert_array_equal(one.confidence[~seen], 0.0)
            assert np.isnan(one.positions[~seen]).all()
            assert ((one.confidence >= 0.0) & (one.confidence <= 1.0)).all()
            if one.rotations is not None:
                lengths = np.linalg.norm(one.rotations, axis=1)
                assert (np.isnan(lengths) | (np.abs(lengths - 1.0) < 1e-5)).all()
    assert MUTATIONS > understood > MUTATIONS // 100
