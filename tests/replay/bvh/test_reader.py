"""BVH files: exact kinematics, every pitfall seen in the wild, hostile input."""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from replay.bvh.reader import read_bvh, recognises_bvh
from replay.formats import read_recording
from replay.recording import Recording
from tests.replay.bvh.sound_recording import assert_sound
from tests.thorough import examples

FINGER = """HIERARCHY
ROOT base
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT middle
  {
    OFFSET 0 1 0
    CHANNELS 3 Yrotation Zrotation Xrotation
    End Site
    {
      OFFSET 0 0.5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
1 2 3 10 20 30 40 50 60
1 2 3 0 0 0 0 0 0
"""

BODY = """HIERARCHY
ROOT Hips
{
\tOFFSET 0 0 0
\tCHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation
\tJOINT Spine
\t{
\t\tOFFSET 0 @20 0
\t\tCHANNELS 3 Zrotation Xrotation Yrotation
\t\tJOINT Head
\t\t{
\t\t\tOFFSET 0 @40 0
\t\t\tCHANNELS 3 Zrotation Xrotation Yrotation
\t\t\tEnd Site
\t\t\t{
\t\t\t\tOFFSET 0 @20 0
\t\t\t}
\t\t}
\t}
SIDES}
MOTION
Frames: 2
Frame Time: 0.0333333
0 @90 0 ZEROS
0 @90 @10 ZEROS
"""


def body(unit: float = 1.0, z_up: bool = False, turned: float = 0.0) -> str:
    """A body 1.7 m tall in centimetres times `unit`, perhaps Z up, perhaps turned about up."""
    sides = ""
    for side, x in (("Left", 1), ("Right", -1)):
        sides += f"JOINT {side}Arm {{ OFFSET {x * 20} @45 0 CHANNELS 0 "
        sides += f"JOINT {side}Hand {{ OFFSET {x * 50} 0 0 CHANNELS 0 "
        sides += "End Site { OFFSET 0 0 0 } } }\n"
        sides += f"JOINT {side}UpLeg {{ OFFSET {x * 10} 0 0 CHANNELS 0 "
        sides += f"JOINT {side}Leg {{ OFFSET 0 @-45 0 CHANNELS 0 "
        sides += f"JOINT {side}Foot {{ OFFSET 0 @-45 0 CHANNELS 0 }} }} }}\n"
    text = BODY.replace("SIDES", sides).replace("ZEROS", " ".join(["0"] * 9))
    lines = []
    for line in text.replace("@", "").splitlines():
        words = line.split()
        for place, word in enumerate(words):
            if words[0] != "CHANNELS" and word.lstrip("-").isdigit() and "Frame" not in line:
                before = words[place - 1] if place else ""
                if before != "CHANNELS":
                    words[place] = repr(float(word) * unit)
        lines.append(" ".join(words))
    text = "\n".join(lines) + "\n"
    if z_up or turned:
        text = with_root_rotation(text, z_up, turned)
    return text


def with_root_rotation(text: str, z_up: bool, turned: float) -> str:
    head, motion = text.split("MOTION")
    rows = motion.strip().splitlines()
    angles = [90.0 if z_up else 0.0, turned, 0.0]
    for index in (2, 3):
        numbers = [float(word) for word in rows[index].split()]
        numbers[:3] = Rotation.from_euler("XYZ", angles, degrees=True).apply(numbers[:3]).tolist()
        numbers[3:6] = angles
        rows[index] = " ".join(map(repr, numbers))
    return head + "MOTION\n" + "\n".join(rows) + "\n"


def read(tmp_path: Path, text: str | bytes, name: str = "take.bvh") -> Recording:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_recording(path)


def test_rotations_multiply_in_the_order_of_the_channels(tmp_path: Path) -> None:
    recording = read(tmp_path, FINGER)
    assert recording.skeleton.names == ("base", "middle", "middle_end")
    first = Rotation.from_euler("ZXY", [10, 20, 30], degrees=True)
    second = first * Rotation.from_euler("YZX", [40, 50, 60], degrees=True)
    base, middle, end = recording.positions[0]
    np.testing.assert_allclose(middle - base, first.apply([0, 1, 0]), atol=1e-12)
    np.testing.assert_allclose(end - middle, second.apply([0, 0.5, 0]), atol=1e-12)
    assert recording.rotations is not None
    for got, expected in zip(recording.rotations[0], (first, second, second), strict=True):
        assert (Rotation.from_quat(got) * expected.inv()).magnitude() < 1e-12
    np.testing.assert_allclose(recording.times, [0.0, 0.02])
    np.testing.assert_allclose(recording.positions[1] - recording.positions[1, 0],
                               [[0, 0, 0], [0, 1, 0], [0, 1.5, 0]], atol=1e-12)  # fmt: skip


HEAD, MOTION = FINGER.split("MOTION")
SPELLINGS: dict[str, str | bytes] = {
    "tabs and double spaces": FINGER.replace("  ", "\t\t").replace(" ", "  "),
    "CRLF": FINGER.replace("\n", "\r\n"),
    "CR only": FINGER.replace("\n", "\r"),
    "byte order mark": b"\xef\xbb\xbf" + FINGER.encode(),
    "UTF-16": FINGER.encode("utf-16"),
    "lower case": FINGER.lower(),
    "upper case": FINGER.upper().replace("BASE", "base").replace("MIDDLE", "middle"),
    "scientific notation": FINGER.replace("0.5", "5.0e-01").replace(" 40 ", " +4.0E1 "),
    "braces on the line": FINGER.replace("\n{", " {").replace("\n  {", "{").replace("\n    {", "{"),
    "all on one line": " ".join(HEAD.split()) + "\nMOTION" + MOTION,
    "blank lines": FINGER.replace("\n", "\n\n") + "\n   \n\t\n",
    "frame over several lines": FINGER.replace(" 30 40", "\n30\n40"),
    "colons without blanks": FINGER.replace("Frames: 2", "Frames:2").replace("Time: 0", "Time:0"),
    "no frame count": FINGER.replace("Frames: 2", "Frames:      "),
    "wrong frame count": FINGER.replace("Frames: 2", "Frames: 0"),
    "decimal commas": FINGER.replace("0.02", "0,02")
    .replace("0.5", "0,5")
    .replace(" 40 ", " 40,0 "),
    "no last newline": FINGER.rstrip("\n"),
    "cut last line": FINGER + "1 2 3 4",
    "cut last number": FINGER + "1 2 3 10 20 30 40 50 -",
}


@pytest.mark.parametrize("change", SPELLINGS)
def test_other_spellings_read_the_same(tmp_path: Path, change: str) -> None:
    expected, got = read(tmp_path, FINGER), read(tmp_path, SPELLINGS[change])
    assert got.skeleton.names == expected.skeleton.names
    np.testing.assert_allclose(got.positions, expected.positions, atol=1e-9)
    np.testing.assert_allclose(got.times, expected.times)
    if "cut" in change or "count" in change:
        assert got.notes != expected.notes


def test_names_with_blanks_colons_dots_and_end(tmp_path: Path) -> None:
    text = FINGER.replace("ROOT base", "ROOT rig:My Hips.001 ").replace(
        "JOINT middle", "JOINT EndOfArm"
    )
    names = read(tmp_path, text).skeleton.names
    assert names == ("rig:My Hips.001", "EndOfArm", "EndOfArm_end")


def test_repeated_names_are_numbered(tmp_path: Path) -> None:
    recording = read(tmp_path, FINGER.replace("JOINT middle", "JOINT base"))
    assert recording.skeleton.names == ("base", "base_2", "base_2_end")
    assert any("repeat" in note for note in recording.notes)


def test_a_missing_end_site_leaves_a_leaf(tmp_path: Path) -> None:
    text = FINGER.replace("    End Site\n    {\n      OFFSET 0 0.5 0\n    }\n", "")
    assert read(tmp_path, text).skeleton.names == ("base", "middle")


def test_several_roots_are_joined_under_one(tmp_path: Path) -> None:
    head, motion = FINGER.split("MOTION")
    second = head.replace("HIERARCHY", "").replace("base", "other").replace("middle", "tip")
    rows = motion.strip().splitlines()
    rows[2:] = [f"{row} 5 2 3 0 0 0 0 0 0" for row in rows[2:]]
    recording = read(tmp_path, head + second + "MOTION\n" + "\n".join(rows))
    skeleton = recording.skeleton
    assert skeleton.names[0] == "root"
    assert [skeleton.names[skeleton.parents[skeleton.index(n)]] for n in ("base", "other")] == [
        "root",
        "root",
    ]
    apart = (
        recording.positions[:, skeleton.index("other")]
        - recording.positions[:, skeleton.index("base")]
    )
    np.testing.assert_allclose(apart, [[4, 0, 0], [4, 0, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("given_positions", "expected"),
    [
        (("0 0 0", "0 0 0"), ([0, 1, 0], [0, 1, 0])),  # MakeHuman: zeros do not replace OFFSET
        (("0 1 0", "0 1.2 0"), ([0, 1, 0], [0, 1.2, 0])),  # Bandai-Namco: absolute
        (("0 0 0", "0 0.2 0"), ([0, 1, 0], [0, 1.2, 0])),  # relative to OFFSET
    ],
)
def test_position_channels_below_the_root(
    tmp_path: Path, given_positions: tuple[str, str], expected: tuple[list[float], list[float]]
) -> None:
    text = FINGER.replace(
        "CHANNELS 3 Yrotation Zrotation Xrotation",
        "CHANNELS 6 Xposition Yposition Zposition Yrotation Zrotation Xrotation",
    )
    rows = [f"0 0 0 0 0 0 {at} 0 0 0" for at in given_positions]
    recording = read(tmp_path, text.split("1 2 3")[0] + "\n".join(rows))
    bones = recording.positions[:, 1] - recording.positions[:, 0]
    np.testing.assert_allclose(bones, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("written", "seconds"),
    [("0", 1 / 30), ("nan", 1 / 30), ("-1", 1 / 30), ("", 1 / 30), ("60", 1 / 60), (".04", 0.04)],
)
def test_frame_times(tmp_path: Path, written: str, seconds: float) -> None:
    recording = read(tmp_path, FINGER.replace("Time: 0.02", f"Time: {written}"))
    assert recording.times[1] == pytest.approx(seconds)
    assert len(recording.notes) == (3 if written == ".04" else 4)


@pytest.mark.parametrize("unit", [1.0, 0.01, 10.0, 1 / 2.54, 0.1, 0.45 / 2.54, 3.7e-4])
@pytest.mark.parametrize("z_up", [False, True])
@pytest.mark.parametrize("turned", [0.0, 130.0])
def test_units_and_axes_are_found_from_the_body(
    tmp_path: Path, unit: float, z_up: bool, turned: float
) -> None:
    recording = read(tmp_path, body(unit, z_up, turned))
    reference = read(tmp_path, body())
    at = recording.skeleton.index
    scale = 1.0 if unit != 3.7e-4 else 1.7 / 1.724  # unknown unit: to 1.7 m by the bones
    for frames, expected in (
        (recording.positions, reference.positions),
        (recording.skeleton.rest_positions, reference.skeleton.rest_positions),
    ):
        np.testing.assert_allclose(frames, expected * scale, atol=2e-3)
    first = recording.positions[0]
    np.testing.assert_allclose(first[at("Hips"), [0, 2]], 0, atol=1e-9)
    assert first[at("LeftHand"), 0] > 0.6 * scale
    assert first[:, 1].min() == pytest.approx(0, abs=1e-9)
    moved = recording.positions[1, at("Hips")] - first[at("Hips")]
    np.testing.assert_allclose(moved, [0, 0, 0.1 * scale], atol=2e-3)


def test_a_value_that_is_no_number_hides_the_joint_and_what_hangs_on_it(tmp_path: Path) -> None:
    for bad in ("nan", "-1.#IND", "1e300", "inf"):
        recording = read(tmp_path, FINGER.replace("40 50 60", f"40 {bad} 60"))
        assert recording.confidence.tolist() == [[1, 1, 0], [1, 1, 1]]
        assert np.isnan(recording.positions[0, 2]).all()
        assert any("not finite" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("HIERARCHY", "HIERACHY", "not a BVH file"),
        ("MOTION", "", "no MOTION section"),
        ("Frames: 2", "Pictures: 2", "line 16: expected .Frames:"),
        ("OFFSET 0 1 0", "OFFSET 0 one 0", "line 8: expected a number, got 'one'"),
        ("OFFSET 0 1 0", "OFFSET 0 1e99 0", "line 8: 1e99 is not a plausible length"),
        ("CHANNELS 3 Y", "CHANNELS 4 Y", "line 10: expected one of 4 channels"),
        ("CHANNELS 3 Y", "CHANNELS x Y", "line 9: expected the number of channels"),
        ("ROOT base\n{", "ROOT base\n", "line 4: expected an opening brace"),
        ("    }\n  }\n}", "    }\n  }", "are not closed"),
        ("HIERARCHY", "HIERARCHY }", "outside of any joint"),
        ("HIERARCHY", "HIERARCHY { BONES }", "expected JOINT"),
        ("40 50 60\n", "40 50 60 70\n", "line 19: expected 9 values .* line 19 makes it 10"),
        ("40 50 60\n", "40 50\n", "line 19: expected 9 values .* line 20 makes it 17"),
        ("40 50 60\n", "40 fifty 60\n", "line 19: expected numbers only"),
    ],
)
def test_what_is_no_bvh_is_answered_with_where(
    tmp_path: Path, before: str, after: str, message: str
) -> None:
    with pytest.raises(InputError, match=message) as error:
        read(tmp_path, FINGER.replace(before, after, 1))
    assert "take.bvh" in str(error.value)
    assert "\n" not in str(error.value)


def test_no_frame_is_an_error_and_no_channel_is_one_frame(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no whole frame"):
        read(tmp_path, FINGER.split("1 2 3", maxsplit=1)[0])
    still = "\n".join(line for line in FINGER.splitlines() if "CHANNELS" not in line).split(
        "1 2 3"
    )[0]
    assert len(read(tmp_path, still)) == 1


def test_other_files_are_not_taken_for_bvh(tmp_path: Path) -> None:
    assert recognises_bvh(Path("x.txt"), b"\xef\xbb\xbf  hierarchy\nROOT")
    assert not recognises_bvh(Path("x.csv"), b"1,2,3\n")


def some_mutation(data: bytes, chance: random.Random) -> bytes:
    words = (b"nan", b"-", b"{", b"}", b"1e308", b"\x00\xff", b"End", b"CHANNELS 99", b"\n", b"7 7")
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(data) + 1)
        to = min(len(data), at + chance.choice((0, 0, 1, 5, 40)))
        data = data[:at] + chance.choice(words) + data[to:]
        if chance.random() < 0.3:
            data = data[: chance.randrange(len(data) + 1)]
    return data


@settings(
    max_examples=examples(300),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.integers(0, 2**32))
def test_any_damage_gives_a_clear_error_or_a_sound_recording(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    source = chance.choice((FINGER, body(), SPELLINGS["UTF-16"]))
    path = tmp_path / "damaged.bvh"
    path.write_bytes(
        some_mutation(source if isinstance(source, bytes) else source.encode(), chance)
    )
    with contextlib.suppress(InputError):
        assert_sound(read_bvh(path))
