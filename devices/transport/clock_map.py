"""Map times of a device's clock to the host's monotonic clock."""

from __future__ import annotations

import math

from devices.skeleton import MOST_SECONDS

WINDOW = 2.0  # [s] of arrivals over which a minimum is taken
FARTHEST = 0.5  # [s] largest plausible delay between mapped time and arrival
STEP_BACK = 0.25  # [s] larger than the delay of any packet on a local network


class ClockMap:
    """Maps device times to host times by the smallest recent delay.

    Packets are delayed by a varying time and never come early, so the smallest difference between
    arrival and device time is the best estimate of the clock offset (the minimum filter of NTP,
    RFC 5905, section 10). It is taken over the last `WINDOW` to twice `WINDOW` seconds, so the
    clocks may drift. The estimate restarts when the device clock jumps, in either direction, or
    the sender restarts.

    Attributes:
        jumps: number of restarts of the estimate.
    """

    def __init__(self) -> None:
        self.jumps = 0
        self._began: float | None = None
        self._earlier = self._current = math.inf  # least offsets [s] of two windows
        self._last_device = -math.inf
        self._last_host = -math.inf

    def host_time(self, device: float, arrival: float) -> float:
        """Return the host time [s] of a device time [s] that was received at `arrival` [s].

        It is never later than the arrival, and never earlier than the previous result while
        arrivals do not fall. A device time that is not finite or too large yields the arrival.
        """
        if not abs(device) < MOST_SECONDS:  # also for NaN
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
        """Whether the device clock was set, as opposed to a late packet or clock drift."""
        least = min(self._earlier, self._current)
        return abs(offset - least) > FARTHEST or self._last_device - device > STEP_BACK

    def _anchor(self, offset: float, arrival: float) -> None:
        self._earlier, self._current, self._began = math.inf, offset, arrival
