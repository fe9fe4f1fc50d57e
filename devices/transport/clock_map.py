"""A device's own clock on the host's monotonic clock."""

from __future__ import annotations

import math

WINDOW = 2.0  # [s] of arrivals that one minimum is taken over
FARTHEST = 0.5  # [s] a mapped time may lie before its arrival
LARGEST = 1e11  # [s] of a device clock: 3000 years; more has no milliseconds left in a float64
STEP_BACK = 0.25  # [s] that no packet is late by on a local network


class ClockMap:
    """Maps device times to host times by the least delay seen lately.

    Packets come late by a delay that changes, never early; so the least difference between arrival
    and device time is the best estimate of the clocks' offset (the minimum filter of NTP, RFC 5905,
    section 10). It is taken over the last `WINDOW` to twice `WINDOW` seconds, so that clocks may
    drift apart. A device clock that jumps, in either direction, and a sender that begins again
    start the estimate anew.

    Attributes:
        jumps: how often it started anew.
    """

    def __init__(self) -> None:
        self.jumps = 0
        self._began: float | None = None
        self._earlier = self._current = math.inf  # least offsets [s] of two windows
        self._last_device = -math.inf
        self._last_host = -math.inf

    def host_time(self, device: float, arrival: float) -> float:
        """The host's time [s] of what the device stamped `device` [s] and that came at `arrival`.

        Never after the arrival, and never before what was returned last while arrivals do not
        fall. A stamp that is no number, or as large as none is, is taken for the arrival.
        """
        if not abs(device) < LARGEST:  # NaN is not
            self._last_host = max(self._last_host, arrival)
            return arrival
        offset = arrival - device
        if self._began is None:
            self._anchor(offset, arrival)
        elif self._jumped(device, offset):
            self.jumps += 1
            self._anchor(offset, arrival)
        elif arrival - self._began > WINDOW:
            self._earlier, self._current, self._began = self._current, offset, arrival
        self._current = min(self._current, offset)
        self._last_device = device
        mapped = device + min(self._earlier, self._current)
        self._last_host = min(max(mapped, self._last_host), arrival)
        return self._last_host

    def _jumped(self, device: float, offset: float) -> bool:
        """Whether the device's clock was set, rather than the packet late or the clock adrift."""
        least = min(self._earlier, self._current)
        return abs(offset - least) > FARTHEST or self._last_device - device > STEP_BACK

    def _anchor(self, offset: float, arrival: float) -> None:
        self._earlier, self._current, self._began = math.inf, offset, arrival
