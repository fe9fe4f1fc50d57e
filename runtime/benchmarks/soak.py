"""Benchmark: an hour of four performers at 60 Hz; frames lost, memory growth, longest tick."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.builtin.gestures import RATE
from devices.builtin.motions import motion_clip
from devices.builtin.simulator import BACKLOG_SECONDS, Simulator
from devices.skeleton import SkeletonFrame
from replay.mcap.reader import McapReader
from replay.recorded_stream import Keep, RecordedStream
from replay.recorder import WAITING, Recorder
from runtime.benchmarks.memory import resident_memory
from runtime.benchmarks.stolen_time import JIFFY, stolen_time
from runtime.characters.builtin import builtin_character
from runtime.show.clock import Ticker
from runtime.show.collector_pauses import objects_frozen
from runtime.show.messages import warn
from runtime.show.pacing import Pace
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show

HOUR = 3600.0  # [s]
PERFORMERS = 4
CHARACTER = "trex"
WARM_UP = 0.2  # share of the show before memory is compared
MOST_WARM_UP = 300.0  # [s]
TICKS_A_SAMPLE = 60  # ticks from one look at the memory to the next
MOST_GROWTH = 0.01
LONGEST_TICK = 0.05  # [s]
SETTINGS = ShowSettings(match=MatchSettings(patience=0.0))
WAITING_ACCELERATED = 256  # frames queued for the disk when the show waits for the disk


@dataclass(frozen=True, slots=True, eq=False)
class Soak:
    """The measurements of one run.

    Attributes:
        sent: frames that arrived.
        kept: frames that the recording gives back, in order.
        ticks: (T,) [s] the duration of each tick.
        work: (T,) [s] the part of it in which the loop had a core; otherwise it waited for one.
        stolen: (T,) [s] the time since the tick before in which a virtual machine's host withheld
            its cores, summed over all cores.
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
        """The second of the show from which memory is measured."""
        return int(min(WARM_UP * len(self.memory), MOST_WARM_UP))

    @property
    def slow(self) -> NDArray[np.bool_]:
        """The ticks (T,) that took too long."""
        slow: NDArray[np.bool_] = self.ticks > LONGEST_TICK
        return slow

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """The slow ticks (T,) with stolen time in them or in the next, as it is reported late."""
        counted_later = np.append(self.stolen[1:], 0.0)
        stalled: NDArray[np.bool_] = self.slow & (self.stolen + counted_later >= 0.99 * JIFFY)
        return stalled

    @property
    def growth(self) -> float:
        """By which share the memory grew, at most, after the warm-up."""
        return float(self.memory[self.warm :].max() / self.memory[self.warm] - 1.0)


def run(*, seconds: float = HOUR, real_time: bool = False) -> dict[str, object]:
    """Perform and record for `seconds` [s] of show; print and return the measurements.

    The show runs in real time, or as fast as possible with a clock that advances by a sixtieth of a
    second a tick.
    """
    tempo = "in real time" if real_time else "as fast as possible"
    print(
        f"soak: {PERFORMERS} performers, {RATE:.0f} Hz, {seconds:.0f} s of show {tempo}", flush=True
    )
    with tempfile.TemporaryDirectory() as folder:
        soak = soaked(
            Path(folder) / "soak.mcap", seconds, Tempo.real() if real_time else Tempo.accelerated()
        )
    p50, p99, most = (1e3 * float(q) for q in np.percentile(soak.ticks, (50, 99, 100)))
    slow, stalled = int(soak.slow.sum()), int(soak.stalled.sum())
    worked = 1e3 * float(soak.work.max())
    lost, resident = soak.sent - soak.kept, float(soak.memory[-1]) / 2**20
    print(f"  frames    {soak.sent} arrived, {lost} lost in the recording")
    print(
        f"  memory    {resident:.1f} MiB at the end, {100 * soak.growth:+.2f} % at most "
        f"since {soak.warm} s (budget {100 * MOST_GROWTH:.0f} %)"
    )
    print(
        f"  ticks     {len(soak.ticks)}: {p50:.2f} ms median, {p99:.2f} ms p99, {most:.2f} ms at "
        f"most; {slow} over {1e3 * LONGEST_TICK:.0f} ms, in {stalled} of them this machine's "
        "host withheld its cores"
    )
    print(f"  work      {worked:.2f} ms of a core at most in a tick; the rest it waited for a core")
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


@dataclass(frozen=True, slots=True)
class Tempo:
    """How the time of a show passes.

    Attributes:
        clock: the show's time [s].
        pace: waits from tick to tick.
        waits_for_disk: whether the show waits until a frame is queued for the disk; otherwise the
            recorder drops frames when its queue is full.
    """

    clock: Callable[[], float]
    pace: Pace
    waits_for_disk: bool

    @classmethod
    def real(cls) -> Tempo:
        """Real time."""
        return cls(time.perf_counter, Ticker(RATE), waits_for_disk=False)

    @classmethod
    def accelerated(cls) -> Tempo:
        """A sixtieth of a second a tick, however long the tick takes."""
        steps = Steps(1.0 / RATE)
        return cls(steps, steps, waits_for_disk=True)


class Steps:
    """A clock [s] that advances by a fixed step when a tick waits for the next one."""

    def __init__(self, step: float) -> None:
        self._step = step
        self._count = 0

    def __call__(self) -> float:
        """Return the time [s]."""
        return self._count * self._step

    def wait(self) -> None:
        """Advance by one step."""
        self._count += 1

    def is_due(self) -> bool:
        """Return False: each tick has all the time that it takes."""
        return False


def soaked(path: Path, seconds: float, tempo: Tempo) -> Soak:
    """Perform for `seconds` [s] of show, record everything to `path`, and read that back."""
    stream = Simulator(motion_clip("show"), tempo.clock, performers=PERFORMERS)
    most = int(seconds * RATE) + 2
    # Filled now, so that their own memory does not grow during the show.
    spent, work, stolen = np.full((3, most), np.nan, np.float32)
    memory = np.full((most - 1) // TICKS_A_SAMPLE + 1, np.nan)
    waiting = WAITING_ACCELERATED if tempo.waits_for_disk else WAITING
    with Recorder(path, stream.skeleton, tell=warn, waiting=waiting) as recorder:
        frames = most + int(BACKLOG_SECONDS * RATE)  # the last poll may be late
        keep = recorder.write if tempo.waits_for_disk else recorder.offer
        log = _Log(keep, frames * PERFORMERS)
        recorded = RecordedStream(stream, log.note)
        show = Show(recorded, [builtin_character(CHARACTER)], SETTINGS, pace=tempo.pace)
        tick, end = 0, tempo.clock() + seconds
        with show, objects_frozen():
            before = stolen_time()
            while tempo.clock() < end and tick < most:
                began, worked = time.perf_counter(), time.thread_time()
                show.tick()
                show.settle()
                spent[tick] = time.perf_counter() - began
                work[tick] = time.thread_time() - worked
                now = stolen_time()
                stolen[tick], before = now - before, now
                if tick % TICKS_A_SAMPLE == 0:
                    memory[tick // TICKS_A_SAMPLE] = resident_memory()
                tick += 1
                tempo.pace.wait()
    samples = (tick - 1) // TICKS_A_SAMPLE + 1
    found = log.found_in(path)
    return Soak(log.count, found, spent[:tick], work[:tick], stolen[:tick], memory[:samples])


class _Log:
    """Notes performer and time of each frame on its way to the recorder."""

    def __init__(self, keep: Keep, most: int) -> None:
        self.count = 0
        self._keep = keep
        self._stamps = np.full((most, 2), np.nan)

    def note(self, frame: SkeletonFrame) -> None:
        """Note one frame and pass it on."""
        self._stamps[self.count] = frame.performer, frame.time
        self.count += 1
        self._keep(frame)

    def found_in(self, path: Path) -> int:
        """Return how many of the noted frames a recording gives back, in order of arrival."""
        came = iter(self._stamps[: self.count].tolist())
        with McapReader(path) as reader:
            return sum([frame.performer, frame.time] in came for frame in reader.frames())
