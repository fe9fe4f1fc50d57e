"""Estimate the offset between the publisher's clock and ours from request-reply exchanges.

Each exchange bounds the offset: the other clock was read between our request and our receipt, so
the midpoint is wrong by at most half the round trip, however unequal the two directions are.
Source: F. Cristian, "Probabilistic clock synchronization", Distributed Computing 3, 1989; RFC 5905
(NTP 4), section 8 for the four times and section 10 for the filter, in which a sample's bound grows
with its age and the sample with the smallest bound counts.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

SAMPLES = 64
ROUNDING = 1e-6  # [s] rounding error of differences of large times
DRIFT = 100e-6  # [s/s] two quartz clocks of 50 parts per million each, in opposite directions


@dataclass(frozen=True, slots=True)
class _Sample:
    taken: float
    offset: float
    bound: float

    def bound_at(self, now: float) -> float:
        return self.bound + DRIFT * max(now - self.taken, 0.0)


class ClockOffset:
    """The other clock minus ours, estimated from the last `SAMPLES` exchanges."""

    def __init__(self) -> None:
        self._samples: deque[_Sample] = deque(maxlen=SAMPLES)
        self._offset: float | None = None
        self._bound = float("inf")

    @property
    def known(self) -> bool:
        """Whether an exchange has taken place."""
        return self._offset is not None

    @property
    def seconds(self) -> float:
        """The other clock minus ours [s].

        Raises:
            ValueError: no exchange has taken place.
        """
        if self._offset is None:
            raise ValueError("Expected an exchange before `seconds`, got none")
        return self._offset

    @property
    def bound(self) -> float:
        """Largest possible error of `seconds` [s] at the last exchange; infinite before any."""
        return self._bound

    def add(self, asked: float, heard: float, answered: float, back: float) -> bool:
        """Add one exchange.

        Args:
            asked, back: our clock [s] when the request was sent and when the reply came in.
            heard, answered: the other clock [s] at receipt and at reply.

        Returns:
            Whether the four times are consistent; other exchanges are ignored.
        """
        round_trip = (back - asked) - (answered - heard)
        if not (back >= asked and answered >= heard and round_trip >= -ROUNDING):
            return False
        round_trip = max(round_trip, ROUNDING)
        newest = _Sample(back, ((heard - asked) + (answered - back)) / 2.0, round_trip / 2.0)
        # After a clock change or a sleeping machine, samples that contradict the newest are stale.
        agreeing = [
            one
            for one in self._samples
            if abs(one.offset - newest.offset) <= one.bound_at(back) + newest.bound
        ]
        self._samples = deque([*agreeing, newest], maxlen=SAMPLES)
        best = min(self._samples, key=lambda one: one.bound_at(back))
        bound = best.bound_at(back)
        # Within the bounds no offset is known to be better; keeping it avoids jitter of the times.
        used = self._offset if agreeing and self._offset is not None else best.offset
        self._offset = min(max(used, best.offset - bound), best.offset + bound)
        self._bound = bound + abs(self._offset - best.offset)
        return True
