"""Untrusted recordings: what is bounded before it is used."""

from __future__ import annotations

import os
import threading
import warnings
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.skeleton import FARTHEST, MOST_SECONDS, Skeleton, SkeletonFrame
from replay.bounds import MOST_POSES, check_poses, plausible
from replay.builtin import builtin_recording
from replay.bvh.reader import read_bvh
from replay.formats import read_recording, recognise
from replay.leap.reader import read_leap
from replay.mcap.reader import MOST_MEMORY, most_frames
from replay.mcap.writer import McapWriter
from replay.mediapipe.text import parse_landmark_text
from replay.stated import UNSTATED, Stated

ARM = Skeleton(("shoulder", "hand"), np.array([-1, 0]), np.eye(3)[:2])
MIB = 1 << 20
BVH = (
    "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{\n"
    "OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.03\n0 0 0\n1 2 3\n"
)


def frame(time: float, place: float = 1.0) -> SkeletonFrame:
    return SkeletonFrame(time, np.full((2, 3), place), None, np.ones(2), arrival=time)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a POSIX pipe")
def test_a_pipe_or_device_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.bvh"
    os.mkfifo(pipe)  # whoever opens it waits for ever
    for path in (pipe, Path("/dev/zero"), Path("/dev/stdin"), tmp_path):
        if path != Path("/dev/stdin") or not path.is_file():
            with pytest.raises(InputError, match="not a file"):
                read_recording(path)


def test_a_name_that_no_file_can_have_is_refused() -> None:
    with pytest.raises(InputError, match="no file can have this name"):
        recognise(Path("a\0b.bvh"))


@pytest.mark.parametrize(
    "text",
    ["[" + "[]," * 9_000_000 + "0]", '{"a":' * 4_000_000, "[" * 500_000 + "]" * 500_000],
    ids=["lists", "objects", "deep"],
)
def test_json_that_takes_many_times_its_size_is_refused(text: str) -> None:
    for document in (text, text.encode()):
        with pytest.raises(ValueError, match=r"memory|deeply"):
            parse_json(document)


def test_json_of_a_usual_kind_is_parsed() -> None:
    assert parse_json(b'{"a": [1, 2.5, null, {"b": "\\u00e4"}]}') == {
        "a": [1, 2.5, None, {"b": "\u00e4"}]
    }


def test_lists_without_end_are_no_leap_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text('{"frames":[{"pointables":[' + "[]," * 9_000_000 + "0]}]}")
    with pytest.raises(InputError, match="memory"):
        read_leap(path)


def test_lines_without_end_are_refused_before_they_are_split(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH + "\n" * 10_000_000)
    with pytest.raises(InputError, match="lines are too many"):
        read_bvh(path)


@pytest.mark.parametrize("number", ["9" * 400, "1e999", "-1" + "0" * 310])
def test_numbers_beyond_all_bounds_are_no_traceback(number: str) -> None:
    landmarks = ",".join([f'{{"x":0,"y":0,"z":{number}}}'] * 33)
    text = f'[{{"timestamp_ms": {number}, "pose_world_landmarks": [{landmarks}]}}]'
    with suppress(InputError):
        parse_landmark_text(text.encode(), UNSTATED)


def test_frames_are_bounded_by_the_file_that_holds_them() -> None:
    assert most_frames(joints=1, size=171_000) == 100_000
    assert most_frames(joints=1, size=10 * MIB) == 10 * MIB // 20
    assert most_frames(joints=10_000, size=171_000) * 10_000 * 128 <= MOST_MEMORY
    hour = 216_000
    assert most_frames(joints=59, size=hour * 2000) >= hour


def test_poses_are_bounded() -> None:
    check_poses(MOST_POSES // 59, 59)
    with pytest.raises(InputError, match="split the recording"):
        check_poses(MOST_POSES // 59 + 1, 59)


def test_places_that_nothing_can_be_at_are_left_out_with_a_note() -> None:
    played = builtin_recording("wave")
    positions = played.positions.copy()
    positions[0, 0] = 1e308
    checked = plausible(replace(played, positions=positions))
    assert np.isnan(checked.positions[0, 0]).all()
    assert checked.confidence[0, 0] == 0.0
    np.testing.assert_array_equal(checked.positions[1:], played.positions[1:])
    assert checked.notes[-1].startswith("1 places farther than")
    assert plausible(played) is played


def test_times_that_no_clock_has_are_refused() -> None:
    played = builtin_recording("wave")
    with pytest.raises(InputError, match="no seconds"):
        plausible(replace(played, times=np.linspace(0.0, 1e308, len(played))))


def test_a_frame_at_an_impossible_time_ends_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with McapWriter(path, ARM) as writer:
        writer.write(frame(0.0))
        for time in (1e300, -1e300, 2 * MOST_SECONDS, float("nan")):
            with pytest.raises(ValueError, match="time"):
                writer.write(frame(time))
        writer.write(frame(1.0, 1e308))
        writer.write(frame(2.0))
    read = read_recording(path)
    assert read.times.tolist() == [0.0, 1.0, 2.0]
    assert np.isnan(read.positions[1]).all()
    assert (np.abs(read.positions[[0, 2]]) <= FARTHEST).all()


def test_two_readers_at_once_leave_the_filter_of_warnings_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH.replace("1 2 3", "1 x 3"))  # is tried as numbers, in vain
    before = list(warnings.filters)
    together = threading.Barrier(4)

    def read() -> None:
        together.wait()
        for _ in range(50):
            read_bvh(path)

    threads = [threading.Thread(target=read) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert warnings.filters == before


def test_a_skeleton_that_no_recording_of_ours_can_hold_is_refused(tmp_path: Path) -> None:
    """Else `convert` would write what it cannot read."""
    path = tmp_path / "far.bvh"
    path.write_text(
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
        "JOINT b\n{\nOFFSET 0 5000 0\nCHANNELS 1 Xrotation\n}\n}\n"
        "MOTION\nFrames: 1\nFrame Time: 0.03\n0 0 0 0\n"
    )
    with pytest.raises(InputError, match=r"farther than 1000 m away; state its unit"):
        read_recording(path, Stated(unit="m"))
    assert len(read_recording(path, Stated(unit="mm"))) == 1
