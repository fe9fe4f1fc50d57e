"""MCAP recordings: what is written comes back, also from damaged files."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.writer import CompressionType, Writer

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from replay.formats import read_recording
from replay.mcap.reader import McapReader, read_mcap
from replay.mcap.record_reader import walk
from replay.mcap.writer import McapWriter
from replay.recording import Recording
from tests.thorough import examples

ARM = Skeleton(("shoulder", "elbow", "hand"), np.array([-1, 0, 1]), np.eye(3))


def arm_frame(
    index: int, *, performer: int = 0, start: float = 0.0, rate: float = 30.0
) -> SkeletonFrame:
    random = np.random.default_rng(index)
    positions = random.normal(size=(3, 3))
    confidence = random.uniform(0.1, 1.0, size=3)
    if index % 3 == 0:
        positions[1], confidence[1] = np.nan, 0.0
    time = start + index / rate
    rotations = random.normal(size=(3, 4))
    return SkeletonFrame(time, positions, rotations, confidence, performer, time + 0.0123456789)


def write(path: Path, frames: list[SkeletonFrame]) -> Path:
    with McapWriter(path, ARM) as writer:
        for frame in frames:
            writer.write(frame)
    return path


def assert_frame(recording: Recording, index: int, frame: SkeletonFrame) -> None:
    np.testing.assert_array_equal(recording.positions[index], frame.positions)
    np.testing.assert_array_equal(recording.confidence[index], frame.confidence)
    if frame.rotations is not None and recording.rotations is not None:
        np.testing.assert_array_equal(recording.rotations[index], frame.rotations)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("mcap") / "finished.mcap"
    return write(path, [arm_frame(i) for i in range(300)]).read_bytes()


def readable(path: Path) -> Recording | None:
    """The recording, or None if there is one clear error instead; anything else fails the test."""
    with contextlib.suppress(InputError):
        return read_mcap(path)
    return None


def unfinished(tmp_path: Path, frames: int) -> Path:
    """What lies on the disk while a recording runs."""
    path = tmp_path / "running.mcap"
    with McapWriter(tmp_path / "whole.mcap", ARM) as writer:
        for index in range(frames):
            writer.write(arm_frame(index))
        path.write_bytes((tmp_path / "whole.mcap").read_bytes())
    return path


def test_a_recording_comes_back_bit_for_bit(tmp_path: Path) -> None:
    frames = [arm_frame(i) for i in range(100)]
    recording = read_recording(write(tmp_path / "a.mcap", frames))
    assert recording.skeleton.names == ARM.names
    np.testing.assert_array_equal(recording.skeleton.parents, ARM.parents)
    np.testing.assert_array_equal(recording.skeleton.rest_positions, ARM.rest_positions)
    assert recording.times.tolist() == [frame.time for frame in frames]
    assert recording.arrivals.tolist() == [frame.arrival for frame in frames]
    assert recording.notes == ()
    for index, frame in enumerate(frames):
        assert_frame(recording, index, frame)


def test_times_count_from_the_first_frame_and_latencies_remain(tmp_path: Path) -> None:
    frames = [arm_frame(i, start=98765.25) for i in range(5)]
    recording = read_mcap(write(tmp_path / "a.mcap", frames))
    assert recording.times[0] == 0.0
    np.testing.assert_allclose(recording.arrivals - recording.times, 0.0123456789, atol=1e-10)


def test_several_performers_are_kept_apart_and_sorted_by_time(tmp_path: Path) -> None:
    frames = [arm_frame(i, performer=p, start=0.001 * (2 - p)) for i in range(9) for p in (1, 2)]
    recording = read_mcap(write(tmp_path / "a.mcap", frames))
    assert (np.diff(recording.times) >= 0).all()
    for performer in (1, 2):
        own = [frame for frame in frames if frame.performer == performer]
        for index, frame in zip(
            np.flatnonzero(recording.performers == performer), own, strict=True
        ):
            assert_frame(recording, int(index), frame)


def test_frames_without_rotations_or_arrival_come_back_so(tmp_path: Path) -> None:
    bare = SkeletonFrame(1.5, np.full((3, 3), np.nan), None, np.zeros(3))
    recording = read_mcap(write(tmp_path / "a.mcap", [bare]))
    assert recording.rotations is None
    assert np.isnan(recording.arrivals).all()
    assert np.isnan(recording.positions).all()
    assert (recording.confidence == 0).all()


def test_other_tools_read_it_with_both_clocks(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", [arm_frame(i) for i in range(10)])
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        messages = list(reader.iter_messages(topics="/performer/0"))
        summary = reader.get_summary()
    assert [message.publish_time for _, _, message in messages] == [
        round(i / 30 * 1e9) for i in range(10)
    ]
    assert all(message.log_time > message.publish_time for _, _, message in messages)
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.metadata_count == 1
    assert {channel.topic for channel in summary.channels.values()} == {"/skeleton", "/performer/0"}


def test_where_frames_came_from_comes_back_and_other_tools_see_it(tmp_path: Path) -> None:
    path, facts = tmp_path / "a.mcap", {"origin": "sim://show", "began": "2026-01-01T00:00:00Z"}
    with McapWriter(path, ARM, source=facts) as writer:
        writer.write(arm_frame(0))
    assert read_mcap(path).source == facts
    with path.open("rb") as file:
        found = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
    assert found["bunraku.source"] == facts


@pytest.mark.filterwarnings("ignore:(start|end)_time is deprecated")  # old versions know no other
def test_other_tools_enter_a_long_file_anywhere_by_performer(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", [arm_frame(i, performer=i % 3) for i in range(900)])
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages(
            topics="/performer/1", start_time=int(20.0e9), end_time=int(25.0e9)
        )
        sequences = [message.sequence for _, _, message in found]
    late = [i for i in range(1, 900, 3) if 20.0 <= i / 30 + 0.0123456789 < 25.0]
    assert sequences == late


def test_numbers_that_are_left_out_are_frames_that_were_lost(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "a.mcap", ARM) as writer:
        for number in (0, 1, 5, 6, 8):
            writer.write(arm_frame(number), number)
    assert read_mcap(tmp_path / "a.mcap").notes[0].startswith("4 recorded frames are not")


def test_a_finished_file_is_entered_at_any_time(tmp_path: Path) -> None:
    frames = [arm_frame(i) for i in range(900)]
    path = write(tmp_path / "a.mcap", frames)
    with McapReader(path) as reader:
        assert reader.indexed
        late = list(reader.frames(since=frames[500].arrival))
        again = list(reader.frames())
    assert [frame.time for frame in late] == [frame.time for frame in frames[500:]]
    assert len(again) == 900


def test_seeking_reads_only_the_end_of_the_file(tmp_path: Path) -> None:
    frames = [arm_frame(i) for i in range(900)]
    path = write(tmp_path / "a.mcap", frames)
    with path.open("r+b") as file:  # after the first chunk nothing can be found from the front
        file.seek(8)
        chunks = [offset for offset, r in walk(file, path.stat().st_size) if isinstance(r, Chunk)]
        assert len(chunks) > 2
        file.seek(chunks[0] + 1)
        file.write(b"\xff" * 8)
    with McapReader(path) as reader:
        late = list(reader.frames(since=frames[-1].arrival))
        assert reader.faults == []
    assert [frame.time for frame in late] == [frames[-1].time]


def test_at_most_a_second_is_missing_while_a_recording_runs(tmp_path: Path) -> None:
    for count in (1, 29, 100, 301):
        recording = read_mcap(unfinished(tmp_path, count))
        assert len(recording) > count - 30
        assert_frame(recording, len(recording) - 1, arm_frame(len(recording) - 1))
        assert "not finished" in recording.notes[-1]


def test_a_slow_stream_is_synced_by_the_clock(tmp_path: Path) -> None:
    now = [0.0]
    with McapWriter(tmp_path / "a.mcap", ARM, clock=lambda: now[0]) as writer:
        for index in range(4):
            writer.write(arm_frame(index, rate=1e6))
            now[0] += 0.6
        assert len(read_mcap(tmp_path / "a.mcap")) == 4


WRITER_TO_KILL = """
import sys
from pathlib import Path
sys.path.insert(0, {root!r})
from tests.replay.mcap.test_reader import ARM, arm_frame
from replay.mcap.writer import McapWriter
writer = McapWriter(Path(sys.argv[1]), ARM)
for index in range(10**9):
    writer.write(arm_frame(index))
    print(index, flush=True)
    sys.stdin.readline()
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs kill -9")
def test_a_killed_recorder_loses_less_than_a_second(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    code = WRITER_TO_KILL.format(root=str(Path(__file__).resolve().parents[3]))
    with subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for index in range(100):
            assert process.stdout.readline() == f"{index}\n".encode().replace(
                b"\n", os.linesep.encode()
            )
            if index < 99:
                process.stdin.write(b"\n")
                process.stdin.flush()
        process.kill()  # in the middle of its work: it waits for the next line
    recording = read_mcap(path)
    assert recording.times[-1] >= 99 / 30 - 1.0
    for index in range(len(recording)):
        assert_frame(recording, index, arm_frame(index))


def test_a_file_cut_anywhere_gives_its_whole_frames_or_one_clear_error(
    tmp_path: Path, finished: bytes
) -> None:
    path = tmp_path / "cut.mcap"
    most = 0
    for length in [*range(0, 700, 7), *range(700, len(finished), 997)]:
        path.write_bytes(finished[:length])
        recording = readable(path)
        if recording is None:
            assert most == 0
            continue
        assert len(recording) >= most
        most = len(recording)
        assert_frame(recording, most - 1, arm_frame(most - 1))
    assert most == 300


def test_a_damaged_chunk_costs_only_its_own_frames(tmp_path: Path, finished: bytes) -> None:
    path = tmp_path / "damaged.mcap"
    path.write_bytes(finished)
    with path.open("rb") as file:
        file.seek(8)
        chunks = [offset for offset, r in walk(file, len(finished)) if isinstance(r, Chunk)]
    assert len(chunks) > 3
    for at in (chunks[0], chunks[2]):  # the first names the channels
        damaged = bytearray(finished)
        damaged[at + 70] ^= 0xFF
        path.write_bytes(damaged)
        recording = read_mcap(path)
        assert 300 * (1 - 2 / len(chunks)) <= len(recording) < 300
        assert f"at byte {at}" in recording.notes[0]


def test_a_chunk_that_claims_more_than_any_machine_can_hold_is_passed_over(
    tmp_path: Path, finished: bytes
) -> None:
    path = tmp_path / "damaged.mcap"
    path.write_bytes(finished)
    with path.open("rb") as file:
        file.seek(8)
        chunks = [offset for offset, r in walk(file, len(finished)) if isinstance(r, Chunk)]
    damaged = bytearray(finished)
    length = chunks[1] + 9 + 28 + len("....zstd")  # behind times, size, CRC and the codec's name
    damaged[length : length + 8] = (2**63 + 508).to_bytes(8, "little")
    path.write_bytes(damaged)
    recording = read_mcap(path)
    assert 0 < len(recording) < 300
    assert f"at byte {chunks[1]}" in recording.notes[0]


@settings(max_examples=examples(150), deadline=None)
@given(st.data())
def test_mutated_bytes_never_surprise(
    tmp_path_factory: pytest.TempPathFactory, finished: bytes, data: st.DataObject
) -> None:
    damaged = bytearray(finished[: data.draw(st.integers(600, 9000))])
    for _ in range(data.draw(st.integers(1, 6))):
        damaged[data.draw(st.integers(8, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "mutated.mcap"
    path.write_bytes(damaged)
    recording = readable(path)
    assert recording is None or np.isfinite(recording.times).all()


def foreign(path: Path, data: bytes, *, skeleton: bool = True) -> Path:
    """An MCAP file with one message, by the library alone."""
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        if skeleton:
            text = '{"names": ["a"], "parents": [-1], "rest_positions": [[0, 0, 0]]}'
            writer.add_metadata("bunraku.skeleton", {"json": text})
        channel = writer.register_channel("/performer/0", "json", 0)
        writer.add_message(channel, 0, data, 0)
        writer.finish()
    return path


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"{}",
        b"[1, 2]",
        b"\xff\xfe",
        b'{"time": 0, "positions": [[0, 0]], "confidence": [1]}',
        b'{"time": 1e999, "positions": [[0, 0, 0]], "confidence": [1]}',
        b'{"time": 0, "positions": [[0, 0, 0], [0, 0, 0]], "confidence": [1, 1]}',
        b'{"time": 0, "positions": [[0, {}, 0]], "confidence": [1]}',
        b'{"time": 0, "positions": ' + b"[" * 100_000,
        b'{"time": 0, "positions": [[' + b"9" * 5000 + b', 0, 0]], "confidence": [1]}',
    ],
)
def test_a_message_that_is_no_frame_is_passed_over(tmp_path: Path, message: bytes) -> None:
    with pytest.raises(InputError, match="no whole frame"):
        read_mcap(foreign(tmp_path / "a.mcap", message))


def test_numbers_that_are_not_finite_are_unseen(tmp_path: Path) -> None:
    text = b'{"time": 0, "positions": [[Infinity, 0, NaN]], "confidence": [7]}'
    recording = read_mcap(foreign(tmp_path / "a.mcap", text))
    assert not np.isfinite(recording.positions[0, 0, [0, 2]]).any()
    assert recording.confidence.tolist() == [[0.0]]


def test_a_digit_that_flipped_is_found_by_the_checksum(tmp_path: Path) -> None:
    text = b'{"time": 0, "positions": [[1.25, 0, 0]], "confidence": [1]}'
    path = foreign(tmp_path / "a.mcap", text)
    assert read_mcap(path).positions[0, 0, 0] == 1.25
    path.write_bytes(path.read_bytes().replace(b"1.25", b"1.75"))
    with pytest.raises(InputError, match="no whole frame"):
        read_mcap(path)


def test_a_file_of_another_program_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="without a Bunraku skeleton"):
        read_mcap(foreign(tmp_path / "a.mcap", b"{}", skeleton=False))


def test_a_recording_that_is_cut_off_before_its_skeleton_says_so(tmp_path: Path) -> None:
    path = foreign(tmp_path / "a.mcap", b"{}", skeleton=False)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="cut off before its skeleton"):
        read_mcap(path)


def test_a_frame_of_another_skeleton_is_refused(tmp_path: Path) -> None:
    with (
        McapWriter(tmp_path / "a.mcap", ARM) as writer,
        pytest.raises(ValueError, match="3 joints"),
    ):
        writer.write(SkeletonFrame(0.0, np.zeros((2, 3)), None, np.ones(2)))


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_one_clear_error() -> None:
    with pytest.raises(InputError, match="cannot write /dev/full"):
        McapWriter(Path("/dev/full"), ARM)


def test_a_folder_that_is_not_there_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot write"):
        McapWriter(tmp_path / "no" / "a.mcap", ARM)
