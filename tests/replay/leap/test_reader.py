"""Leap recordings: real files, hands and sides, and damaged files."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.errors import InputError
from devices.leap.joints import FINGERS, chest, leap_to_world
from replay.formats import read_recording
from replay.leap import reader as leap_reader
from replay.leap.lz_string import lz_pieces
from replay.leap.reader import read_leap, recognises_leap
from replay.recording import Recording
from tests.thorough import examples


def hand(number: int, side: str | None, x: float, confidence: float = 1.0) -> dict[str, Any]:
    """A level hand, palm down, 20 cm over the device."""
    found: dict[str, Any] = {
        "id": number,
        "confidence": confidence,
        "palmPosition": [x, 200.0, 50.0],
        "palmNormal": [0.0, -1.0, 0.0],
        "direction": [0.0, 0.0, -1.0],
    }
    return found | ({"type": side} if side else {})


def finger(of: int, kind: int, x: float, **more: Any) -> dict[str, Any]:
    ends = ("mcp", "pip", "dip", "tip")
    places = {f"{end}Position": [x, 200.0, 20.0 - 25.0 * i] for i, end in enumerate(ends)}
    return {"id": 10 * of + kind, "handId": of, "type": kind, "tool": False} | places | more


def bones(of: int, x: float) -> list[dict[str, Any]]:
    return [finger(of, kind, x + 20.0 * (kind - 2)) for kind in range(5)]


def frame(index: int, hands: list[Any], pointables: list[Any]) -> dict[str, Any]:
    return {"timestamp": 5_000_000 + 10_000 * index, "hands": hands, "pointables": pointables}


def document(path: Path, frames: list[Any]) -> Path:
    path.write_text(json.dumps({"metadata": {"formatVersion": 1}, "frames": frames}))
    return path


def lines(path: Path, frames: list[Any], version: int = 6) -> Path:
    path.write_text("".join(json.dumps(one) + "\n" for one in [{"version": version}, *frames]))
    return path


def place(recording: Recording, index: int, name: str) -> np.ndarray:
    return recording.positions[index, recording.skeleton.index(name)]


def readable(path: Path) -> Recording | None:
    """The recording, or None if there is one clear error instead; anything else fails the test."""
    with contextlib.suppress(InputError):
        recording = read_leap(path)
        assert np.isfinite(recording.times).all()
        assert (np.diff(recording.times) >= 0).all()
        seen = np.isfinite(recording.positions).all(axis=2)
        assert ((recording.confidence > 0) <= seen).all()
        return recording
    return None


def lz_base64(numbers: list[tuple[int, int]]) -> bytes:
    """Numbers of given widths, from the lowest bit, in base64 digits."""
    stream = "".join(f"{number:0{width}b}"[::-1] for number, width in numbers)
    stream += "0" * (-len(stream) % 6)
    digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
    return "".join(digits[int(stream[i : i + 6], 2)] for i in range(0, len(stream), 6)).encode()


def lz_compress(text: str) -> bytes:
    """A greedy encoder, written from the description of the code alone."""
    numbers, entries, size, previous = [], {}, 3, ""
    while text:
        known = {**entries, previous + previous[:1]: size} if previous else entries
        piece = max((entry for entry in known if text.startswith(entry)), key=len, default="")
        if piece:
            numbers.append((known[piece], size.bit_length()))
        else:
            piece = text[0]
            wide = ord(piece) > 255
            numbers += [(int(wide), size.bit_length()), (ord(piece), 16 if wide else 8)]
            entries[piece] = size
            size += 1
        if previous:
            entries.setdefault(previous + piece[0], size)
            size += 1
        previous, text = piece, text[len(piece) :]
    return lz_base64([*numbers, (2, size.bit_length())])


@settings(max_examples=examples(100), deadline=None)
@given(st.text(st.sampled_from("ab{}\u0159\u65e5"), max_size=300))
def test_lz_string_is_unpacked(text: str) -> None:
    assert "".join(lz_pieces(lz_compress(text))) == text


def test_a_compressed_document_is_read(tmp_path: Path) -> None:
    frames = [frame(i, [hand(7, "right", 40.0 + i)], bones(7, 40.0 + i)) for i in range(2)]
    plain = document(tmp_path / "a.json", frames)
    packed = tmp_path / "a.json.lz"
    packed.write_bytes(lz_compress(plain.read_text()))
    assert recognises_leap(packed, packed.read_bytes()[:4096])
    np.testing.assert_array_equal(read_leap(packed).positions, read_leap(plain).positions)


def test_a_document_and_lines_hold_the_same(tmp_path: Path) -> None:
    frames = [frame(i, [hand(7, "right", 40.0 + i)], bones(7, 40.0 + i)) for i in range(5)]
    one = read_recording(document(tmp_path / "a.json", frames))
    two = read_recording(lines(tmp_path / "a.ldj", frames))
    np.testing.assert_array_equal(one.positions, two.positions)
    np.testing.assert_allclose(one.times, 0.01 * np.arange(5))
    np.testing.assert_allclose(place(one, 3, "palm"), leap_to_world([43.0, 200.0, 50.0]))
    np.testing.assert_allclose(place(one, 3, "pinky_dip"), leap_to_world([83.0, 200.0, -30.0]))
    assert one.skeleton.names[one.skeleton.root] == "palm"


def test_the_packed_form_is_unpacked_by_its_scheme(tmp_path: Path) -> None:
    point = ["id", "handId", "mcpPosition", "pipPosition", "dipPosition", "tipPosition"]
    scheme = ["timestamp", {"hands": [["id", "type", "palmPosition"]]}, {"pointables": [point]}]
    ends = [[0.0, 200.0, 20.0 - i] for i in range(4)]
    packed = [[1000 * i, [[3, "left", [0.0, 200.0, 50.0]]], [[31, 3, *ends]]] for i in range(3)]
    recording = read_leap(document(tmp_path / "a.json", [scheme, *packed]))
    np.testing.assert_allclose(place(recording, 2, "index_pip"), leap_to_world([0, 200, 19]))
    np.testing.assert_allclose(recording.times, [0.0, 0.001, 0.002])


def test_a_frame_without_a_hand_is_kept_and_empty(tmp_path: Path) -> None:
    seen = frame(1, [hand(7, "right", 0.0, confidence=0.6)], bones(7, 0.0))
    frames = [frame(0, [], []), seen, frame(2, [], [])]
    recording = read_leap(document(tmp_path / "a.json", frames))
    assert np.isnan(recording.positions[[0, 2]]).all()
    assert (recording.confidence[[0, 2]] == 0).all()
    assert (recording.confidence[1] == 0.6).all()


def test_two_hands_keep_their_sides_in_any_order(tmp_path: Path) -> None:
    left, right = hand(1, "left", -80.0), hand(2, "right", 80.0)
    points = bones(1, -80.0) + bones(2, 80.0)
    frames = [
        frame(0, [left, right], points),
        frame(1, [right, left], points[::-1]),
        frame(2, [right], bones(2, 80.0)),
        frame(3, [{**left, "id": 9}, right], bones(9, -80.0) + bones(2, 80.0)),
    ]
    recording = read_leap(document(tmp_path / "a.json", frames))
    for index in (0, 1, 3):
        assert place(recording, index, "left_palm")[0] == pytest.approx(0.08)
        assert place(recording, index, "left_index_tip")[0] == pytest.approx(0.1)
    assert np.isnan(place(recording, 2, "left_palm")).all()
    assert np.isfinite(place(recording, 2, "right_palm")).all()
    np.testing.assert_allclose(place(recording, 2, "hands"), chest())


def test_the_arm_is_there_when_it_was_recorded(tmp_path: Path) -> None:
    arm = {"wrist": [0.0, 190.0, 120.0], "elbow": [0.0, 150.0, 350.0]}
    frames = [frame(i, [hand(7, "right", 0.0) | arm], bones(7, 0.0)) for i in range(2)]
    skeleton = read_leap(document(tmp_path / "a.json", frames)).skeleton
    assert skeleton.names[skeleton.root] == "elbow"
    assert skeleton.parents[skeleton.index("palm")] == skeleton.index("wrist")
    upper = (
        skeleton.rest_positions[skeleton.index("wrist")] - skeleton.rest_positions[skeleton.root]
    )
    assert np.linalg.norm(upper) == pytest.approx(np.hypot(0.04, 0.23))


def tips(of: int, places: dict[int, tuple[float, float]]) -> list[dict[str, Any]]:
    """Pointables of protocol 1: ids with places across and forward of a palm at 0, 200, 50."""
    return [
        {"id": one, "handId": of, "tool": False, "tipPosition": [x, 200.0, 50.0 - forward]}
        for one, (x, forward) in places.items()
    ]


SPREAD = {77: (-75.0, 35.0), 5: (-35.0, 90.0), 40: (-5.0, 100.0), 8: (25.0, 92.0), 61: (60.0, 70.0)}


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_tips_without_names_get_fingers_and_keep_them(tmp_path: Path, mirror: float) -> None:
    spread = {one: (mirror * x, forward) for one, (x, forward) in SPREAD.items()}
    frames = [frame(0, [hand(3, None, 0.0)], tips(3, {77: spread[77], 8: spread[8]}))]
    frames += [frame(i, [hand(3, None, 0.0)], tips(3, spread)[:: (-1) ** i]) for i in range(1, 4)]
    gone = {one: where for one, where in spread.items() if one != 40}
    curled = {one: (x + 15.0, forward - 30.0) for one, (x, forward) in gone.items()}
    frames += [frame(4, [hand(3, None, 0.0)], tips(3, curled))]
    back = {**gone, 99: spread[40]}  # the middle finger returns with a new id
    frames += [frame(5, [hand(3, None, 0.0)], tips(3, back))]
    recording = read_leap(lines(tmp_path / "a.ldj", frames, version=1))
    assert ("left" if mirror < 0 else "right") in recording.notes[0]
    order = dict(zip(FINGERS, spread, strict=True))
    for index in range(1, 4):
        for name, one in order.items():
            expected = leap_to_world([spread[one][0], 200.0, 50.0 - spread[one][1]])
            np.testing.assert_allclose(place(recording, index, f"{name}_tip"), expected)
    assert np.isnan(place(recording, 0, "index_tip")).all()
    assert np.isfinite(place(recording, 0, "thumb_tip")).all()
    assert np.isnan(place(recording, 4, "middle_tip")).all()
    np.testing.assert_allclose(
        place(recording, 4, "ring_tip"),
        leap_to_world([curled[8][0], 200.0, 50.0 - curled[8][1]]),
    )
    assert np.isfinite(place(recording, 5, "middle_tip")).all()


def test_unnamed_hands_keep_their_sides_while_they_cross(tmp_path: Path) -> None:
    frames = []
    for index, x in enumerate((80.0, 40.0, -40.0, -80.0)):
        hands = [hand(4, None, x), hand(2, None, -x)]
        frames.append(frame(index, hands, tips(4, {1: (x, 90.0)}) + tips(2, {8: (-x, 90.0)})))
    recording = read_leap(lines(tmp_path / "a.ldj", frames, version=1))
    right = recording.positions[:, recording.skeleton.index("right_palm"), 0]
    np.testing.assert_allclose(right, [-0.08, -0.04, 0.04, 0.08])


def test_of_two_hands_on_one_side_the_one_there_before_stays_else_the_surer(
    tmp_path: Path,
) -> None:
    ghost, true, left = (
        hand(1, "right", 10.0, confidence=0.2),
        hand(2, "right", 50.0, confidence=0.9),
        hand(3, "left", -50.0),
    )
    frames = [
        frame(0, [ghost, true, left], []),
        frame(1, [ghost | {"confidence": 1.0}, true, left], []),
    ]
    recording = read_leap(document(tmp_path / "a.json", frames))
    right = recording.positions[:, recording.skeleton.index("right_palm"), 0]
    np.testing.assert_allclose(right, [-0.05, -0.05])


def test_a_tool_is_no_finger(tmp_path: Path) -> None:
    pencil = tips(3, {1: (0.0, 150.0)})[0] | {"tool": True}
    frames = [frame(0, [hand(3, None, 0.0)], [*tips(3, SPREAD), pencil])]
    recording = read_leap(lines(tmp_path / "a.ldj", frames, version=1))
    assert len(recording.skeleton.names) == 6
    assert np.linalg.norm(recording.positions - place(recording, 0, "palm"), axis=2).max() < 0.11


def test_missing_times_are_made_from_the_rate(tmp_path: Path) -> None:
    frames = [frame(i, [hand(7, "right", 0.0)], []) | {"currentFrameRate": 50} for i in range(4)]
    del frames[2]["timestamp"]
    recording = read_leap(document(tmp_path / "a.json", frames))
    np.testing.assert_allclose(recording.times, [0.0, 0.02, 0.04, 0.06])
    assert "50.0 frames" in recording.notes[0]


def test_a_clock_that_goes_back_stands_still(tmp_path: Path) -> None:
    frames = [frame(i, [hand(7, "right", 0.0)], []) for i in (0, 3, 1, 4)]
    recording = read_leap(document(tmp_path / "a.json", frames))
    np.testing.assert_allclose(recording.times, [0.0, 0.03, 0.03, 0.04])
    assert "goes back" in recording.notes[0]


def test_the_last_line_may_be_cut(tmp_path: Path) -> None:
    path = lines(
        tmp_path / "a.ldj", [frame(i, [hand(7, "right", 0.0)], bones(7, 0.0)) for i in range(4)]
    )
    path.write_bytes(path.read_bytes()[:-40])
    recording = read_leap(path)
    assert len(recording) == 3
    assert "1 lines" in recording.notes[0]


@pytest.mark.parametrize(
    "text",
    [
        '{"frames": 3, "pointables": 1}',
        '{"frames": [], "pointables": 1}',
        '{"frames": [1, 2], "pointables": 1}',
        '{"frames": [{"hands": [], "pointables": []}]}',
        '{"frames": [{"hands": [{"id": 1, "palmPosition": [1, 2]}], "pointables": []}]}',
        '{"frames": [{"hands": [{"id": 1, "palmPosition": [1, 2, 1e999]}], "pointables": []}]}',
        '{"frames": [{"hands": {"a": 1}, "pointables": "x"}]}',
        '{"frames": [["timestamp", {"hands": [["id"]]}], [1, 2]], "pointables": 1}',
        '{"frames": [["timestamp", {}], [1, 2]], "pointables": 1}',
        '{"frames": [["timestamp", 7], [1, 2]], "pointables": 1}',
        '{"frames": ' + "[" * 100_000 + ', "pointables": 1}',
        '{"pointables": ',
        "N4IgZgTghgtgpgZxALgNqgMYFcITgOwBcAxaeAJSkLhQEZ",
        "N4Ig!!!!",
        "",
    ],
)
def test_what_is_no_recording_is_one_clear_error(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_leap(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_odd_values_are_unseen_not_errors(tmp_path: Path) -> None:
    odd = finger(7, 1, 0.0, tipPosition=[True, None, "3"], dipPosition=[10**400, 0, 0], type=[1])
    frames = [frame(0, [hand(7, "both", 0.0, confidence=9.0)], [odd, 5, None])]
    recording = read_leap(document(tmp_path / "a.json", frames))
    assert recording.skeleton.names == ("palm", "index_mcp", "index_pip")
    assert recording.confidence.max() == 1.0


def lz_bomb(count: int) -> bytes:
    """One letter in pieces that grow by one with every number: k numbers, k^2 / 2 letters."""
    return lz_base64(
        [(0, 2), (97, 8)] + [(size, size.bit_length()) for size in range(4, 4 + count)]
    )


def test_a_bomb_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leap_reader, "MAX_BYTES", 1 << 20)
    path = tmp_path / "bomb.json.lz"
    path.write_bytes(lz_bomb(3000))  # 7 kB for 4.5 MB
    with pytest.raises(InputError, match="unpacks to more than 1 MiB"):
        read_leap(path)


def recordings(shared: Path) -> list[Path]:
    return sorted((shared / "leap").rglob("*.lz")) + sorted((shared / "leap").rglob("*.ldj"))


def test_real_recordings_are_known_and_read_whole(shared: Path) -> None:
    for path in recordings(shared):
        assert recognises_leap(path, path.read_bytes()[:4096])
        recording = read_recording(path)
        assert len(recording) > 50
        assert 0.5 < recording.seconds < 60
        seen = np.isfinite(recording.positions).all(axis=2)
        assert seen.mean() > 0.85
        assert ((recording.confidence > 0) == seen).all()


def test_real_hands_are_upright_with_bones_of_one_length(shared: Path) -> None:
    for path in recordings(shared):
        recording = read_recording(path)
        names = recording.skeleton.names
        tip = [i for i, name in enumerate(names) if name.endswith("middle_tip")]
        for joint in tip:
            palm = names.index(names[joint].replace("middle_tip", "palm"))
            up = recording.positions[:, joint, 1] - recording.positions[:, palm, 1]
            assert np.nanmedian(up) > 0.04  # fingers up in the picture
        if "ldj" in path.name:
            continue
        ends = recording.positions - recording.positions[:, recording.skeleton.parents]
        lengths = np.linalg.norm(ends, axis=2)
        bones = [i for i, name in enumerate(names) if name.endswith(("_dip", "_tip"))]
        spread = np.ptp(lengths[:, bones], axis=0) / lengths[:, bones].mean(axis=0)
        assert np.median(spread) < 0.25


def test_real_left_hand_is_on_the_right_of_the_picture(shared: Path) -> None:
    recording = read_recording(shared / "leap" / "leapjs_playback" / "three-claps.json.lz")
    left = recording.positions[0, recording.skeleton.index("left_palm")]
    right = recording.positions[0, recording.skeleton.index("right_palm")]
    assert left[0] > right[0] + 0.1


def test_real_recordings_cut_anywhere_never_surprise(shared: Path, tmp_path: Path) -> None:
    for path in [recordings(shared)[-1], shared / "leap" / "leapjs_playback" / "wave.json.lz"]:
        whole = path.read_bytes()
        cut = tmp_path / path.name
        for length in np.linspace(0, len(whole) - 1, 25, dtype=int):
            cut.write_bytes(whole[:length])
            readable(cut)


@settings(max_examples=examples(100), deadline=None)
@given(st.data())
def test_mutated_messages_never_surprise(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    frames = [frame(i, [hand(7, "right", 0.0)], bones(7, 0.0)[:2]) for i in range(3)]
    text = bytearray(json.dumps({"frames": frames}).encode())
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at] = data.draw(st.sampled_from(b'0123456789-e."[]{},:tn '))
    path = tmp_path_factory.getbasetemp() / "mutated.json"
    path.write_bytes(text)
    readable(path)
