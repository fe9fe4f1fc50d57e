"""Benchmark: the time from a packet of another process to deformed vertices on the GPU."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Self
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray

from devices.bridge.stream import BridgeStream
from devices.bridge.stream import open_device as open_bridge
from devices.errors import InputError
from devices.osc.vmc_decoder import VmcDecoder
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport
from runtime.characters.builtin import builtin_character
from runtime.driving.performer import Pose
from runtime.puppet.puppet import Motion
from runtime.render.context import headless_context, is_software, release_headless
from runtime.show.collector_pauses import objects_frozen
from runtime.show.pacing import OnArrival
from runtime.show.scene import Scene
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show

RATES = (30.0, 60.0, 120.0)
WAYS = ("zmq", "vmc")
CHARACTER = "mannequin"
SIZE = (320, 180)
SETTINGS = ShowSettings(size=SIZE, match=MatchSettings(patience=0.0))
WARM_UP = 1.0  # [s] before the measurement
MEASURED = 8.0  # [s] of measurement
BUDGET_MS = {"p50": 4.0, "p99": 10.0}
PATIENCE = 20.0  # [s] without a frame before the remaining packets count as lost
_BUSY = "while True: pass"

Array = NDArray[np.float64]
Context = Any  # of moderngl, which only the renderer names
Live = BridgeStream | LiveStream


@dataclass(frozen=True, slots=True, eq=False)
class Times:
    """Host monotonic times [s] of each performed frame, (F,).

    Attributes:
        sent: just before it left the other process; VMC's clock is estimated from the least delay.
        came: its last packet was read.
        uploaded: its deformed vertices were on the GPU and the GPU had finished.
        drawn: its picture was finished, without a window's swap; NaN without pictures.
        lost: the number of frames that were sent but not performed, because a newer one had come.
    """

    sent: Array
    came: Array
    uploaded: Array
    drawn: Array
    lost: int


def run(*, load: bool = False) -> dict[str, object]:
    """Print and return percentiles [ms] by way and rate; with `load` also beside a busy process."""
    context = headless_context()
    software = is_software(context)
    vertices = len(builtin_character(CHARACTER).vertices)
    print(
        f"latency: {CHARACTER}, {vertices} vertices; budget at 60 Hz, packet to vertices: "
        f"{BUDGET_MS['p50']} ms median, {BUDGET_MS['p99']} ms p99"
    )
    print(f"pictures of {SIZE[0]}x{SIZE[1]} drawn by {'a processor' if software else 'a GPU'}")
    print(
        f"{'':>22}  packet to vertices    sent to vertices     and drawn: vertices   picture\n"
        f"{'way':>5} {'Hz':>4} {'beside':>10}    p50   p99   max    p50   p99   max"
        f"         p50   p99   p50   p99  left out"
    )
    figures: dict[str, object] = {}
    try:
        for beside in ("nothing", "a busy core") if load else ("nothing",):
            for way in WAYS:
                for rate in RATES:
                    with _busy_core(beside != "nothing"):
                        plain = measured(context, way, rate, drawn=False)
                        drawn = measured(context, way, rate, drawn=True)
                    figures[f"{way}, {rate:.0f} Hz, beside {beside}"] = _told(
                        f"{way:>5} {rate:>4.0f} {beside:>10}", plain, drawn
                    )
    finally:
        release_headless(context)
    return {"budget_ms": BUDGET_MS, "vertices": vertices, "software_gl": software, "ms": figures}


def measured(
    context: Context, way: str, rate: float, *, drawn: bool, seconds: float = MEASURED
) -> Times:
    """Perform the frames that another process sends by one way at one rate for `seconds` [s].

    Raises:
        InputError: no frame of the measurement arrived.
    """
    count = round(rate * (WARM_UP + seconds))
    with ExitStack() as closing:
        if way == "zmq":
            sender = closing.enter_context(_sender(way, rate, count))
            address = f"zmq+{_line(sender)}?mode=lossless"
            stream: Live = closing.enter_context(open_bridge(urlsplit(address)))
        else:
            udp = UdpTransport("127.0.0.1", 0, scheme="vmc")
            stream = closing.enter_context(LiveStream(udp, VmcDecoder))
            sender = closing.enter_context(_sender(way, rate, count, str(udp.port)))
            _line(sender)  # it is ready
        measurement = _Measurement(context, _Noted(stream), drawn=drawn)
        closing.enter_context(measurement.show)
        closing.enter_context(objects_frozen())
        _say(sender, "go")
        measurement.perform(count)
    return measurement.times(count, skipped=round(rate * WARM_UP))


class _Noted:
    """A live stream that counts the frames it gave and keeps the newest."""

    def __init__(self, stream: Live) -> None:
        self.stream = stream
        self.given = 0
        self.newest: SkeletonFrame | None = None

    @property
    def skeleton(self) -> Skeleton:
        return self.stream.skeleton

    @property
    def ended(self) -> bool:
        return self.stream.ended

    def poll(self) -> Sequence[SkeletonFrame]:
        frames = self.stream.poll()
        self.given += len(frames)
        self.newest = frames[-1] if frames else self.newest
        return frames

    def close(self) -> None:
        self.stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


class _StampingScene(Scene):
    """A scene that notes when [s] the vertices were on the GPU and when the picture was drawn.

    Args:
        draws: whether pictures are drawn.
    """

    def __init__(self, context: Context, *arguments: Any, draws: bool, **options: Any) -> None:
        self._context = context
        self._draws = draws
        self.uploaded = self.drawn = float("nan")
        super().__init__(context, *arguments, **options)

    def upload(self, motions: Sequence[Motion]) -> None:
        super().upload(motions)
        self._context.finish()
        self.uploaded = time.perf_counter()

    def draw(self, pose: Pose | None) -> None:
        if self._draws:
            super().draw(pose)
            self._context.finish()
            self.drawn = time.perf_counter()


class _Measurement:
    """A live show of one character, as `bunraku live` runs it, and the times of its frames."""

    def __init__(self, context: Context, stream: _Noted, *, drawn: bool) -> None:
        self._stream = stream
        self._rows: list[tuple[float, ...]] = []
        self._pace = OnArrival(stream.stream)
        self.show = Show(
            stream,
            [builtin_character(CHARACTER)],
            SETTINGS,
            pace=self._pace,
            context=context,
            make_scene=partial(_StampingScene, draws=drawn),
        )

    def perform(self, count: int) -> None:
        """Perform until `count` frames have come, or none has come for `PATIENCE`."""
        stream, scene = self._stream, self.show.controls.scene
        assert isinstance(scene, _StampingScene)
        heard = time.perf_counter()
        while stream.given < count and time.perf_counter() - heard < PATIENCE:
            self._pace.wait()
            performed = self.show.tick()
            self.show.settle()
            if performed and stream.newest is not None:
                heard = time.perf_counter()
                newest = stream.newest
                stamps = (newest.time, newest.arrival, scene.uploaded, scene.drawn)
                self._rows.append((stream.given, *stamps))

    def times(self, count: int, skipped: int) -> Times:
        """Return the times of `count` frames without the first `skipped`."""
        rows = np.array([row for row in self._rows if row[0] > skipped])
        if len(rows) == 0:
            raise InputError(
                "none of the benchmark's packets arrived; try again while the machine is less busy"
            )
        lost = max(count - skipped - len(rows), 0)
        return Times(rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4], lost)


def _told(what: str, plain: Times, drawn: Times) -> dict[str, object]:
    """Print one line and return its figures [ms]."""
    packet, sent = (_spread(plain.uploaded - since) for since in (plain.came, plain.sent))
    vertices, picture = (_spread(until - drawn.came) for until in (drawn.uploaded, drawn.drawn))
    print(
        what
        + "".join(f" {one[name]:6.2f}" for one in (packet, sent) for name in ("p50", "p99", "max"))
        + "     "
        + "".join(f" {one[name]:6.2f}" for one in (vertices, picture) for name in ("p50", "p99"))
        + f" {plain.lost:>5} {drawn.lost:>5}",
        flush=True,
    )
    return {
        "packet_to_vertices": packet,
        "sent_to_vertices": sent,
        "drawn_packet_to_vertices": vertices,
        "drawn_packet_to_picture": picture,
        "left_out": {"without_pictures": plain.lost, "with_pictures": drawn.lost},
    }


def _spread(seconds: Array) -> dict[str, float]:
    p50, p99, most = (1e3 * float(value) for value in np.percentile(seconds, (50, 99, 100)))
    return {"p50": p50, "p99": p99, "max": most}


@contextmanager
def _sender(*arguments: object) -> Iterator[subprocess.Popen[str]]:
    """Run the other process during the block."""
    with subprocess.Popen(
        [sys.executable, "-m", "runtime.benchmarks.latency_sender", *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def _busy_core(busy: bool) -> Iterator[None]:
    """Keep a core busy with another process during the block."""
    if not busy:
        yield
        return
    with subprocess.Popen([sys.executable, "-c", _BUSY]) as process:
        try:
            yield
        finally:
            process.kill()


def _line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    line = process.stdout.readline().strip()
    if not line:
        raise InputError("the benchmark's other process ended early; is this an installed bunraku?")
    return line


def _say(process: subprocess.Popen[str], line: str) -> None:
    assert process.stdin is not None
    process.stdin.write(f"{line}\n")
    process.stdin.flush()
