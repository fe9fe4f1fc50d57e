"""An hour of four performers at 60 Hz: nothing lost, memory flat, no tick too long."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.builtin.gestures import RATE
from devices.builtin.motions import motion_clip
from devices.builtin.simulator import Simulator
from devices.skeleton import SkeletonFrame
from replay.mcap.reader import McapReader
from replay.recorded_stream import Keep, RecordedStream
from replay.recorder import WAITING, Recorder
from runtime.benchmarks.memory import resident_memory
from runtime.benchmarks.stolen_time import JIFFY, stolen_time
from runtime.characters.builtin import builtin_character
from runtime.conditioning.switches import for_live
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.puppet_match import Choices
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.render.camera import front_camera
from runtime.show.clock import Ticker
from runtime.show.collector_pauses import objects_frozen
from runtime.show.loop import FrameLoop
from runtime.show.pacing import AtOnce, SpareTime
from runtime.show.warn import warn

HOUR = 3600.0  # [s]
PERFORMERS = 4
CHARACTER = "trex"
WARM_UP = 0.2  # of the show
MOST_WARM_UP = 300.0  # [s]
TICKS_A_SAMPLE = 60  # of the memory
MOST_GROWTH = 0.01
LONGEST_TICK = 0.05  # [s]
WAITING_ACCELERATED = 256  # frames for the disk, where the show waits for it as well


@dataclass(frozen=True, slots=True, eq=False)
class Soak:
    """What came of it.

    Attributes:
        sent: frames that came.
        kept: frames that the recording gives back, in order.
        ticks: (T,) [s] how long each took.
        work: (T,) [s] for how long of that the loop had a core: the rest, it waited for one.
        stolen: (T,) [s] for how long the machine's host kept its cores to itself since the tick
            before, of all cores together.
        memory: (S,) resident memory [bytes], once a second of the show.
    """

    sent: int
    kept: int
    ticks: NDArray[np.float32]
    work: NDArray[np.float32]
    stolen: NDArray[np.float32]
    memory: NDArray[np.float64]

    @property
    def warm(self) -> int:
        """Seconds of the show after which memory counts."""
        return int(min(WARM_UP * len(self.memory), MOST_WARM_UP))

    @property
    def slow(self) -> NDArray[np.bool_]:
        """Which ticks (T,) took too long."""
        slow: NDArray[np.bool_] = self.ticks > LONGEST_TICK
        return slow

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """Which of those (T,) the host took cores in; it is counted once it gives them back."""
        counted_later = np.append(self.stolen[1:], 0.0)
        stalled: NDArray[np.bool_] = self.slow & (self.stolen + counted_later >= 0.99 * JIFFY)
        return stalled

    @property
    def growth(self) -> float:
        """By what part the memory was larger, at most, than when it was warm."""
        return float(self.memory[self.warm :].max() / self.memory[self.warm] - 1.0)


def run(*, seconds: float = HOUR, real_time: bool = False) -> dict[str, object]:
    """Perform and record for so many seconds [s] of show; print and return what came of it.

    In real time, or as fast as it goes: then the clock goes on by a sixtieth of a second a tick.
    """
    pace = "in real time" if real_time else "as fast as it goes"
    print(
        f"soak: {PERFORMERS} performers, {RATE:.0f} Hz, {seconds:.0f} s of show {pace}", flush=True
    )
    with tempfile.TemporaryDirectory() as folder:
        soak = soaked(Path(folder) / "soak.mcap", seconds, real_time=real_time)
    p50, p99, most = (1e3 * float(q) for q in np.percentile(soak.ticks, (50, 99, 100)))
    slow, stalled = int(soak.slow.sum()), int(soak.stalled.sum())
    worked = 1e3 * float(soak.work.max())
    lost, resident = soak.sent - soak.kept, float(soak.memory[-1]) / 2**20
    print(f"  frames    {soak.sent} came, {lost} lost in the recording")
    print(
        f"  memory    {resident:.1f} MiB at the end, {100 * soak.growth:+.2f} % at most "
        f"since {soak.warm} s (budget {100 * MOST_GROWTH:.0f} %)"
    )
    print(
        f"  ticks     {len(soak.ticks)}: {p50:.2f} ms median, {p99:.2f} ms p99, {most:.2f} ms at "
        f"most, {slow} over {1e3 * LONGEST_TICK:.0f} ms, {stalled} of them where this machine's "
        "host took its cores"
    )
    print(f"  work      {worked:.2f} ms of a core at most in a tick; beyond that it waited for one")
    return {
        "real_time": real_time,
        "seconds": seconds,
        "frames": {"came": soak.sent, "lost": lost},
        "memory": {"mib": resident, "growth": soak.growth},
        "tick_ms": {"p50": p50, "p99": p99, "max": most},
        "ticks_over_50_ms": slow,
        "of_them_stolen": stalled,
        "work_ms_max": worked,
    }


def soaked(path: Path, seconds: float, *, real_time: bool) -> Soak:
    """Perform for so long [s] while everything is recorded to `path`, and read that back."""
    ticks = max(int(seconds * RATE), 1)
    clock = _ShowClock()
    stream = Simulator(
        motion_clip("show"), time.perf_counter if real_time else clock, performers=PERFORMERS
    )
    # Filled, not only claimed, so that their own memory does not grow.
    spent, work, stolen = np.full((3, ticks), np.nan, np.float32)
    memory = np.full((ticks - 1) // TICKS_A_SAMPLE + 1, np.nan)
    waiting = WAITING if real_time else WAITING_ACCELERATED
    with Recorder(path, stream.skeleton, tell=warn, waiting=waiting) as recorder:
        log = _Log(recorder.offer if real_time else recorder.write, 2 * ticks * PERFORMERS)
        loop = _loop(RecordedStream(stream, log.note))
        pace = Ticker(RATE) if real_time else AtOnce()
        spare = SpareTime(pace, loop)
        with objects_frozen():
            before = stolen_time()
            for tick in range(ticks):
                began, worked = time.perf_counter(), time.thread_time()
                loop.tick()
                spare.spend()
                spent[tick] = time.perf_counter() - began
                work[tick] = time.thread_time() - worked
                now = stolen_time()
                stolen[tick], before = now - before, now
                if tick % TICKS_A_SAMPLE == 0:
                    memory[tick // TICKS_A_SAMPLE] = resident_memory()
                clock.now = (tick + 1) / RATE
                pace.wait()
    return Soak(log.count, log.found_in(path), spent, work, stolen, memory)


def _loop(stream: RecordedStream) -> FrameLoop:
    """A show of one character by whoever leads, without pictures."""
    performer = Performer(stream.skeleton)
    puppet = Puppet(builtin_character(CHARACTER))
    camera = front_camera()
    report = Report(None)
    return FrameLoop(
        stream,
        performer,
        [puppet],
        match_session=MatchSession(
            performer, [puppet], lambda: camera.view_rotation, Choices(), [None]
        ),
        report=report,
        scene=None,
        outputs=[[report.cast(puppet.character)]],
        conditioning=for_live(),
    )


class _ShowClock:
    """A clock [s] that stands until it is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


class _Log:
    """Notes who came when, on the way to the recorder."""

    def __init__(self, keep: Keep, most: int) -> None:
        self.count = 0
        self._keep = keep
        self._stamps = np.full((most, 2), np.nan)

    def note(self, frame: SkeletonFrame) -> None:
        """Note one frame, and hand it on."""
        self._stamps[self.count] = frame.performer, frame.time
        self.count += 1
        self._keep(frame)

    def found_in(self, path: Path) -> int:
        """How many of them a recording gives back, in the order in which they came."""
        came = iter(self._stamps[: self.count].tolist())
        with McapReader(path) as reader:
            return sum([frame.performer, frame.time] in came for frame in reader.frames())
