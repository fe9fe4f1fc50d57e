"""What has come from a device: how much, how fast, how evenly."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

SPAN = 2.0  # [s] over which rate and jitter are measured
MOST = 1024  # frames that are looked at for them


@dataclass(frozen=True, slots=True)
class Traffic:
    """The state of a live stream at one moment.

    Attributes:
        packets: messages that came, good or bad.
        frames: frames made of them.
        refused: messages, or parts of them, that were not understood and left out.
        dropped: packets and frames lost on this machine because they came faster than they were
            taken.
        rate: frames a second over the last two seconds, of all performers together.
        jitter: [s] mean absolute difference between the time from one frame of a performer to the
            next and its mean.
        last_seen: host monotonic time [s] of the newest packet, NaN before the first.
        trouble: one line on what is wrong with the connection; empty while all is well.
    """

    packets: int = 0
    frames: int = 0
    refused: int = 0
    dropped: int = 0
    rate: float = 0.0
    jitter: float = 0.0
    last_seen: float = float("nan")
    trouble: str = ""


class Rhythm:
    """When the newest frames came; one thread notes, any other asks."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=MOST)
        self._lock = threading.Lock()

    def note(self, arrival: float, performer: int) -> None:
        """Take in that a frame of `performer` came at `arrival` [s]."""
        with self._lock:
            self._arrivals.append((arrival, performer))

    def measure(self, now: float) -> tuple[float, float]:
        """Frames a second [1/s] and jitter [s] over the last `SPAN` seconds before `now`."""
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
