"""Statistics of the data from a device: packets, frames, rate, jitter."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

SPAN = 2.0  # [s] over which rate and jitter are measured
MOST = 1024  # frames used for them


@dataclass(frozen=True, slots=True)
class Traffic:
    """The state of a live stream at one moment.

    Attributes:
        packets: messages received, valid or not.
        frames: frames made from them.
        refused: messages, or parts of them, that could not be decoded and were omitted.
        dropped: packets and frames lost on this machine because they came faster than they were
            taken.
        rate: frames per second over the last two seconds, all performers together.
        jitter: [s] mean absolute deviation of the time between a performer's frames from its mean.
        last_seen: host monotonic time [s] of the newest packet, NaN before the first.
        trouble: one line that describes a fault of the connection; empty if there is none.
    """

    packets: int = 0
    frames: int = 0
    refused: int = 0
    dropped: int = 0
    rate: float = 0.0
    jitter: float = 0.0
    last_seen: float = float("nan")
    trouble: str = ""

    def unused(self, address: str) -> str:
        """Why no frame came from a device, in one line; empty if frames came.

        Args:
            address: of the device, as it was opened.
        """
        if self.frames:
            return ""
        if not self.packets:
            return f"nothing came from {address}" + (f": {self.trouble}" if self.trouble else "")
        refused = f", {self.refused} of their parts were refused" if self.refused else ""
        return (
            f"{self.packets} packets came from {address}, and none held a performer's frame"
            f"{refused}; does the sender speak {address.partition(':')[0]}?"
        )


class Rhythm:
    """Arrivals of the newest frames; one thread notes them, any other reads them."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=MOST)
        self._lock = threading.Lock()

    def note(self, arrival: float, performer: int) -> None:
        """Note the arrival [s] of a frame of `performer`."""
        with self._lock:
            self._arrivals.append((arrival, performer))

    def measure(self, now: float) -> tuple[float, float]:
        """Return frames per second [1/s] and jitter [s] over the last `SPAN` seconds."""
        with self._lock:
            recent = [entry for entry in self._arrivals if now - entry[0] <= SPAN]
        if len(recent) < 2:
            return 0.0, 0.0
        lasted = now - recent[0][0]
        rate = (len(recent) - 1) / lasted if lasted > 0.0 else 0.0
        deviations: list[float] = []
        for performer in {who for _, who in recent}:
            times = [arrival for arrival, who in recent if who == performer]
            steps = [late - early for early, late in pairwise(times)]
            mean = sum(steps) / len(steps) if steps else 0.0
            deviations += [abs(step - mean) for step in steps]
        return rate, sum(deviations) / len(deviations) if deviations else 0.0
