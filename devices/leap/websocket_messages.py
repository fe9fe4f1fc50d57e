"""Decode the Leap Motion's WebSocket protocol, one JSON message at a time.

The first message is a header with the protocol version; then come frames, and events that report
which devices are attached and streaming. A server that speaks an older protocol is accepted.
Source: leapjs, lib/protocol.js; Leap developer archive, "Leap_JSON".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from devices.leap.hands import leap_frame
from devices.leap.performer import BOTH, LeapPerformer
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.clock_map import ClockMap
from devices.transport.json_object import json_object

MOST_BYTES = 1 << 20
MOST_DEVICES = 16


class LeapDecoder:
    """Frames of a performer's hands from messages of the WebSocket.

    Attributes:
        version: of the server's protocol; None before its header.
        devices: by device id, whether it is attached and whether it is streaming.
        refused: messages that do not belong to this protocol.
    """

    def __init__(self, hands: str = BOTH) -> None:
        self._performer = LeapPerformer(hands)
        self._clock = ClockMap()
        self.version: int | None = None
        self.devices: dict[str, tuple[bool, bool]] = {}
        self.refused = 0

    @property
    def skeleton(self) -> Skeleton:
        """Both hands, or the chosen one."""
        return self._performer.skeleton

    @property
    def trouble(self) -> str:
        """One line that explains why no frames come, from the server's events; else empty."""
        states = self.devices.values()
        if not states or any(attached and streaming for attached, streaming in states):
            return ""
        if any(attached for attached, _ in states):
            return "the Leap is plugged in but paused; resume it in its control panel"
        return "the Leap is not plugged in; plug it in"

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frame in a message received at `arrival` [s]; none for headers and events."""
        message = json_object(data, MOST_BYTES)
        if isinstance(message.get("hands"), list):
            return [self._frame(message, arrival)]
        if not (self._header(message) or self._event(message.get("event"))):
            self.refused += 1
        return []

    def _frame(self, message: Mapping[str, Any], arrival: float) -> SkeletonFrame:
        found = leap_frame(message)
        stamp = found.timestamp
        time = arrival if stamp is None else self._clock.host_time(stamp * 1e-6, arrival)
        return self._performer.frame(found.hands, time, arrival)

    def _header(self, message: Mapping[str, Any]) -> bool:
        version = message.get("version")
        if not isinstance(version, int) or isinstance(version, bool) or "event" in message:
            return False
        self.version = version
        self.devices.clear()  # a new connection reports them again
        return True

    def _event(self, event: Any) -> bool:
        if not isinstance(event, dict) or not isinstance(event.get("type"), str):
            return False
        state = event.get("state")
        if event["type"] == "deviceEvent" and isinstance(state, dict):
            name = str(state.get("id"))[:64]
            if name in self.devices or len(self.devices) < MOST_DEVICES:
                self.devices[name] = (state.get("attached") is True, state.get("streaming") is True)
        return True
