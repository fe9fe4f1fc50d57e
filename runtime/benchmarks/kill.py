"""Benchmark: kills a recorder while it writes; checks that its files open, and what is missing."""

from __future__ import annotations

import os
import random
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from devices.builtin.motions import motion_clip
from devices.builtin.simulator import Simulator
from devices.skeleton import SkeletonFrame
from replay.mcap.reader import McapReader
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from runtime.show.clock import Ticker
from runtime.show.messages import warn

MOMENTS = 50
PERFORMERS = 4
LONGEST = 3.0  # [s] a recording runs at most before it is killed
MOST_MISSING = 1.0  # [s]
POLLS = 240.0  # a second
_STAMP = struct.Struct("<dq")  # time [s] and performer of a frame that arrived


@dataclass(frozen=True, slots=True)
class Killed:
    """A recording whose process was killed.

    Attributes:
        came: the number of frames that had arrived.
        kept: the number of frames that the file gives back.
        whole: whether those are the first frames that arrived, without gaps, in order.
        missing: [s] from the last frame in the file to the last frame that arrived.
    """

    came: int
    kept: int
    whole: bool
    missing: float


def run() -> dict[str, object]:
    """Kill 50 recordings at random moments of their first 3 s; print and return what remains."""
    print(f"kill: {MOMENTS} recordings of {PERFORMERS} performers at 60 Hz, killed", flush=True)
    moments = random.Random(0)
    with tempfile.TemporaryDirectory() as folder:
        killed = [
            killed_recording(Path(folder) / f"{number}.mcap", moments.uniform(0.0, LONGEST))
            for number in range(MOMENTS)
        ]
    missing = np.array([one.missing for one in killed])
    whole = sum(one.whole for one in killed)
    print(f"  files     {len(killed)} of {MOMENTS} open, {whole} whole up to their last frame")
    print(
        f"  missing   {np.median(missing):.3f} s in the median, {missing.max():.3f} s at most "
        f"(budget {MOST_MISSING:.0f} s)"
    )
    return {
        "moments": MOMENTS,
        "whole": whole,
        "missing_s": {"p50": float(np.median(missing)), "max": float(missing.max())},
    }


def killed_recording(path: Path, seconds: float) -> Killed:
    """Record to `path` in another process, kill it `seconds` after its first frame, read the file.

    Raises:
        InputError: the file cannot be opened.
    """
    command = [sys.executable, "-m", "runtime.benchmarks.kill", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=_ROOT) as process:
        assert process.stdout is not None
        first = process.stdout.read(_STAMP.size)
        time.sleep(seconds)
        process.kill()
        told = first + process.stdout.read()
    came = list(_STAMP.iter_unpack(told[: len(told) // _STAMP.size * _STAMP.size]))
    with McapReader(path) as reader:
        kept = [(frame.time, frame.performer) for frame in reader.frames()]
    end = kept[-1][0] if kept else came[0][0]
    return Killed(len(came), len(kept), kept == came[: len(kept)], came[-1][0] - end)


def _record_for_ever(path: Path) -> None:
    """Record simulated performers to `path`; write a stamp of each frame to standard output."""
    stream = Simulator(motion_clip("show"), performers=PERFORMERS)
    recorder = Recorder(path, stream.skeleton, tell=warn)

    def keep(frame: SkeletonFrame) -> None:
        os.write(sys.stdout.fileno(), _STAMP.pack(frame.time, frame.performer))
        recorder.offer(frame)

    recorded = RecordedStream(stream, keep)
    ticker = Ticker(POLLS)
    while True:
        recorded.poll()
        ticker.wait()


_ROOT = Path(__file__).resolve().parents[2]

if __name__ == "__main__":
    _record_for_ever(Path(sys.argv[1]))
