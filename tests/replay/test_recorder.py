"""The recorder: every frame in order whatever the loop does, every fault told, the show goes on."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from devices.builtin.gestures import RATE
from devices.builtin.motions import motion_clip
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.live_stream import Deliver, LiveStream
from replay.mcap.reader import McapReader, read_mcap
from replay.mcap.writer import McapWriter
from replay.player import EveryFrame, Player
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from runtime.benchmarks.kill import killed_recording
from tests.full_disk import files_of_at_most, posix_limits
from tests.waiting import PATIENCE

ARM = Skeleton(("shoulder", "elbow", "hand"), np.array([-1, 0, 1]), np.eye(3))
CHECKOUT = Path(__file__).resolve().parents[2]


def frame(number: int, performer: int = 0) -> SkeletonFrame:
    random = np.random.default_rng(number)
    time = number / RATE
    return SkeletonFrame(time, random.normal(size=(3, 3)), None, np.ones(3), performer, time)


def numbers(path: Path) -> list[int]:
    """Which frames of `frame` a file holds, in its order, each compared bit for bit."""
    found = []
    with McapReader(path) as reader:
        for kept in reader.frames():
            found.append(round(kept.time * RATE))
            np.testing.assert_array_equal(kept.positions, frame(found[-1]).positions)
    return found


class Told:
    """Lines that were told, and a way to wait for the first."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.first = threading.Event()

    def __call__(self, line: str) -> None:
        self.lines.append(line)
        self.first.set()


def until_told(recorder: Recorder, told: Told) -> int:
    """Offer frames, as a show goes on, until something is told; how many."""
    for number in range(1_000_000):
        recorder.offer(frame(number))
        if told.first.wait(0.0002):
            return number + 1
    raise AssertionError("nothing was told")


def test_frames_of_many_threads_and_performers_are_all_there(tmp_path: Path) -> None:
    path, told = tmp_path / "a.mcap", Told()
    with Recorder(path, ARM, tell=told) as recorder:

        def play(performer: int) -> None:
            for number in range(300):
                recorder.offer(frame(number, performer))

        threads = [threading.Thread(target=play, args=(who,)) for who in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert (recorder.frames, recorder.lost, recorder.fault, told.lines) == (1200, 0, "", [])
    recording = read_mcap(path)
    assert recording.notes in (
        (),
        ("frames were not in order of the performers' time and were sorted",),
    )
    for performer in range(4):
        own = recording.of(performer)
        assert own.times.tolist() == [number / RATE for number in range(300)]
        np.testing.assert_array_equal(own.positions[7], frame(7).positions)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a named pipe")
def test_what_a_slow_disk_cannot_take_is_counted_told_and_seen_in_the_file(tmp_path: Path) -> None:
    pipe, path, told, flows = tmp_path / "pipe", tmp_path / "a.mcap", Told(), threading.Event()
    os.mkfifo(pipe)

    def drain() -> None:
        with pipe.open("rb") as disk, path.open("wb") as file:
            assert flows.wait(PATIENCE)  # until then a disk that stands still
            shutil.copyfileobj(disk, file)

    disk = threading.Thread(target=drain)
    disk.start()
    recorder = Recorder(pipe, ARM, tell=told, waiting=100)
    sent = until_told(recorder, told)
    for number in range(sent, sent + 30):
        recorder.offer(frame(number))  # returns at once, all the same
    assert recorder.lost == 31
    assert len(told.lines) == 1
    assert "the disk is too slow" in told.lines[0]
    flows.set()
    recorder.write(frame(sent + 30))
    recorder.close()
    disk.join()
    assert numbers(path) == [*range(sent - 1), sent + 30]
    assert recorder.frames == sent
    assert read_mcap(path).notes[0].startswith("31 recorded frames are not in the file")


def test_a_patient_source_waits_and_loses_nothing(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap", ARM, tell=Told(), waiting=2) as recorder:
        for number in range(400):
            recorder.write(frame(number))
    assert numbers(tmp_path / "a.mcap") == list(range(400))


def test_frames_reach_the_system_while_the_source_is_silent(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Recorder(path, ARM, tell=Told()) as recorder:
        for number in range(5):
            recorder.offer(frame(number))
        while recorder._writer.safe < 5:  # nothing more comes; half a second does
            pass
        shutil.copy(path, tmp_path / "running.mcap")
    assert numbers(tmp_path / "running.mcap") == list(range(5))


def test_a_frame_that_no_file_can_hold_costs_only_itself(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap", ARM, tell=Told()) as recorder:
        recorder.offer(frame(0))
        recorder.offer(SkeletonFrame(float("nan"), np.zeros((3, 3)), None, np.ones(3)))
        recorder.offer(SkeletonFrame(1.0, np.zeros((2, 3)), None, np.ones(2)))
        recorder.offer(frame(1))
    assert numbers(tmp_path / "a.mcap") == [0, 1]
    assert (recorder.frames, recorder.lost) == (2, 2)


def test_a_deleted_folder_is_told_at_once_and_the_show_goes_on(tmp_path: Path) -> None:
    folder, told = tmp_path / "takes", Told()
    folder.mkdir()
    with Recorder(folder / "a.mcap", ARM, tell=told) as recorder:
        recorder.offer(frame(0))
        shutil.rmtree(folder)
        until_told(recorder, told)
        recorder.offer(frame(1))
    assert told.lines == [recorder.fault]
    assert "a.mcap: it was deleted" in recorder.fault
    assert recorder.lost > 0


def test_a_moved_file_is_told_and_stays_whole(tmp_path: Path) -> None:
    told = Told()
    with Recorder(tmp_path / "a.mcap", ARM, tell=told) as recorder:
        recorder.offer(frame(0))
        (tmp_path / "a.mcap").rename(tmp_path / "b.mcap")
        sent = until_told(recorder, told)
    assert len(told.lines) == 1
    assert "was moved" in told.lines[0]
    assert recorder.fault == ""
    assert len(numbers(tmp_path / "b.mcap")) == sent + 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_device_is_one_clear_error_at_the_start() -> None:
    with pytest.raises(InputError, match="cannot write /dev/full: No space left"):
        Recorder(Path("/dev/full"), ARM, tell=Told())


FULL_DISK = """
import resource, sys
from pathlib import Path
sys.path.insert(0, {root!r})
resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
from runtime.cli import main
sys.exit(main(["record", "--device", "sim://show?performers=4", sys.argv[1], "--seconds", "60"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_a_full_disk_ends_a_recording_with_one_line_and_a_file_that_opens(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK.format(root=str(CHECKOUT)), str(path)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    told, error = done.stderr.splitlines()
    assert done.returncode == 2, done.stderr
    assert error.startswith(f"bunraku: error: cannot write {path}: File too large")
    recording = read_mcap(path)
    assert f"{len(recording)} frames are kept" in error
    assert told.startswith(f"bunraku: {len(recording)} frames in {path}, ")
    assert len(recording) > 0
    assert len(recording.notes) == 1, "no half record is left at the end"
    assert "not finished" in recording.notes[0]
    assert path.stat().st_size <= 400_000
    for performer in range(4):  # in order and without a hole, up to there
        assert np.diff(recording.of(performer).times) == pytest.approx(1 / RATE)


@posix_limits
def test_a_full_disk_is_told_in_the_running_show_which_goes_on(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from runtime.cli import main

    played = motion_clip("wave")
    with McapWriter(tmp_path / "in.mcap", played.skeleton) as writer:
        for index, positions in enumerate(played.positions):
            seen = np.ones(len(positions))
            writer.write(SkeletonFrame(index / RATE, positions, None, seen))
    path, report = tmp_path / "a.mcap", tmp_path / "r.json"
    show = ["replay", str(tmp_path / "in.mcap"), "--character", "paper", "--headless", "--fast"]
    with files_of_at_most(200_000):
        code = main([*show, "--record", str(path), "--report", str(report)])
    said = capfd.readouterr().err
    assert code == 2, said
    (line,) = [line for line in said.splitlines() if "warning" in line]
    assert f"cannot write {path}: File too large; the recording has stopped" in line
    told = json.loads(report.read_text())
    assert told["frames"] == len(played.positions)
    kept = len(read_mcap(path))
    assert told["record"]["frames"] == kept
    assert 0 < kept < told["frames"]
    assert told["record"]["lost"] == told["frames"] - kept
    assert f"its first {kept} frames are kept" in told["record"]["fault"]


class Script:
    """A transport that delivers when it is told to."""

    dropped = 0
    trouble = ""

    def __init__(self) -> None:
        self.closed = threading.Event()
        self.go = threading.Event()
        self.done = threading.Event()

    def run(self, deliver: Deliver) -> None:
        assert self.go.wait(PATIENCE)
        for number in range(500):
            deliver(str(number).encode(), number / RATE, "")
        self.done.set()
        self.closed.wait(PATIENCE)

    def close(self) -> None:
        self.go.set()
        self.closed.set()


class Numbers:
    """Decodes a number to the frame of that number."""

    skeleton = ARM
    refused = 0

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        del arrival
        return [frame(int(data))]


def test_a_live_device_is_recorded_whole_while_the_loop_stands_still(tmp_path: Path) -> None:
    script = Script()
    path = tmp_path / "a.mcap"
    with (
        RecordedStream(LiveStream(script, Numbers, capacity=4)) as stream,
        Recorder(path, stream.skeleton, tell=Told()) as recorder,
    ):
        stream.keep = recorder.offer
        script.go.set()
        assert script.done.wait(PATIENCE)
        left = stream.poll()
    assert [round(one.time * RATE) for one in left] == [496, 497, 498, 499]
    assert numbers(path) == list(range(500))


def test_a_player_is_recorded_as_it_is_polled(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap", ARM, tell=Told()) as recorder:
        for number in range(20):
            recorder.offer(frame(number))
    kept: list[SkeletonFrame] = []
    with RecordedStream(Player(read_mcap(tmp_path / "a.mcap"), EveryFrame())) as stream:
        stream.poll()  # nobody keeps it
        stream.keep = kept.append
        while not stream.ended:
            given = stream.poll()
            assert kept[-1] is given[-1]
        stream.keep = None
    assert len(kept) == 19


@pytest.mark.skipif(sys.platform == "win32", reason="needs kill -9")
@pytest.mark.parametrize("seconds", [0.0, 0.3, 1.1])
def test_a_killed_recording_opens_and_holds_what_came_first(tmp_path: Path, seconds: float) -> None:
    """How much is missing at most is measured by `bunraku bench kill`: it is a matter of time."""
    killed = killed_recording(tmp_path / "a.mcap", seconds)
    assert killed.whole
    assert killed.came >= max(killed.kept, 1)
