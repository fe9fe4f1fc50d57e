"""How far the clock of another machine is from ours, from questions and answers.

Each exchange bounds the difference: the other clock was read somewhere between our asking and our
hearing, so the midpoint is wrong by at most half the round trip, however unequal the two ways are.
Source: F. Cristian, "Probabilistic clock synchronization", Distributed Computing 3, 1989; RFC 5905
(NTP 4), section 8 for the four times and section 10 for the filter, in which a sample's bound grows
with its age and the sample with the smallest bound counts.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

SAMPLES = 64
ROUNDING = 1e-6  # [s] what the differences of large numbers of seconds may lose
DRIFT = 100e-6  # [s/s] two quartz clocks of 50 parts in a million each, in opposite directions


@dataclass(frozen=True, slots=True)
class _Sample:
    taken: float
    offset: float
    bound: float

    def bound_at(self, now: float) -> float:
        return self.bound + DRIFT * max(now - self.taken, 0.0)


class ClockOffset:
    """The other clock minus ours, kept from the last `SAMPLES` exchanges."""

    def __init__(self) -> None:
        self._samples: deque[_Sample] = deque(maxlen=SAMPLES)
        self._offset: float | None = None
        self._bound = float("inf")

    @property
    def known(self) -> bool:
        """Whether there was an exchange yet."""
        return self._offset is not None

    @property
    def seconds(self) -> float:
        """The other clock minus ours [s].

        Raises:
            ValueError: there was no exchange yet.
        """
        if self._offset is None:
            raise ValueError("Expected an exchange before `seconds`, got none")
        return self._offset

    @property
    def bound(self) -> float:
        """How wrong `seconds` may have been [s] at the last exchange; infinite before any."""
        return self._bound

    def add(self, asked: float, heard: float, answered: float, back: float) -> bool:
        """Take in one exchange.

        Args:
            asked, back: our clock [s] when the question went out and when the answer came in.
            heard, answered: the other clock [s] in between.

        Returns:
            Whether the four times make sense; what does not is left out.
        """
        round_trip = (back - asked) - (answered - heard)
        if not (back >= asked and answered >= heard and round_trip >= -ROUNDING):
            return False
        round_trip = max(round_trip, ROUNDING)
        newest = _Sample(back, ((heard - asked) + (answered - back)) / 2.0, round_trip / 2.0)
        # A clock was set, or its machine slept: what cannot be reconciled with the newest is past.
        agreeing = [
            one
            for one in self._samples
            if abs(one.offset - newest.offset) <= one.bound_at(back) + newest.bound
        ]
        self._samples = deque([*agreeing, newest], maxlen=SAMPLES)
        best = min(self._samples, key=lambda one: one.bound_at(back))
        bound = best.bound_at(back)
        # Inside the bounds nothing is known to be better, and times that move jitter.
        used = self._offset if agreeing and self._offset is not None else best.offset
        self._offset = min(max(used, best.offset - bound), best.offset + bound)
        self._bound = bound + abs(self._offset - best.offset)
        return True
