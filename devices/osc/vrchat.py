"""Device ``vrchat://``: VRChat's OSC trackers, received on VRChat's port 9000 of this machine.

Up to eight trackers and the head, each with a position and Euler angles in Unity's space. The
messages do not name body parts. Trackers are assigned to joints when they are first seen, from a
performer who stands upright, or by the user:
``vrchat://127.0.0.1:9000?trackers=1:Hips,2:LeftFoot``.

Source: VRChat's documentation of OSC trackers.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from urllib.parse import SplitResult

import numpy as np
from numpy.typing import NDArray

from devices.address import host_and_port, options_of
from devices.bodies.tracker_joints import HEAD, JOINTS, assign_trackers, tracker_skeleton
from devices.bodies.unity_space import across_unity, turn_across_unity, unity_euler
from devices.osc.messages import Message, OscError, read_packet
from devices.skeleton import SkeletonFrame
from devices.transport.frame_assembly import FrameAssembly
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport

PORT = 9000
FARTHEST = 1000.0  # [m] of a plausible position
MOST_DEGREES = 1e5
SETTLING = 1.0  # [s] from the first frame in which the assignment may still change
GONE = 1.0  # [s] without a position, after which a tracker counts as not seen

_TRACKERS = 8
_HEAD_ID = 0
_ADDRESS = re.compile(r"/tracking/trackers/(?:([1-8])|head)/(position|rotation)", re.ASCII)


class VrchatDecoder:
    """Frames of one sender's trackers; frame times are arrivals, as none are sent.

    Args:
        places: the index in JOINTS for each tracker number; empty to assign trackers by position.

    Attributes:
        refused: datagrams and messages that were malformed or implausible.
    """

    skeleton = tracker_skeleton()

    def __init__(self, places: Mapping[int, int] | None = None) -> None:
        self.refused = 0
        self._given = bool(places)
        self._places: dict[int, int] = dict(places or {})
        self._first: float | None = None
        self._assembly = FrameAssembly()
        self._positions = np.zeros((_TRACKERS + 1, 3))
        self._turns = np.full((_TRACKERS + 1, 4), np.nan)
        self._seen = np.full(_TRACKERS + 1, -np.inf)  # arrival [s] of each position

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frames that a datagram, received at `arrival` [s], completes."""
        try:
            messages = read_packet(data)
        except OscError:
            self.refused += 1
            return ()
        frames: list[SkeletonFrame] = []
        if self._assembly.overdue(arrival):
            frames += self._finish()
        heard = False
        for message in messages:
            found = _ADDRESS.fullmatch(message.address)
            if found is None:
                continue
            values = _three(message, FARTHEST if found[2] == "position" else MOST_DEGREES)
            if values is None:
                self.refused += 1
                continue
            heard = True
            tracker, turned = int(found[1] or _HEAD_ID), found[2] == "rotation"
            if 2 * tracker + turned in self._assembly.parts:
                frames += self._finish()
            self._assembly.add(2 * tracker + turned, arrival)
            if turned:
                self._turns[tracker] = turn_across_unity(unity_euler(values))
            else:
                self._positions[tracker], self._seen[tracker] = across_unity(values), arrival
        if heard and self._assembly.whole:
            frames += self._finish()
        return frames

    def _finish(self) -> list[SkeletonFrame]:
        """The frame of the newest pose of each tracker; none without a tracker on the body."""
        arrival = self._assembly.newest
        self._assembly.end()
        there = [int(i) for i in np.flatnonzero(arrival - self._seen < GONE)]
        self._first = arrival if self._first is None else self._first
        self._assign(there, settled=arrival - self._first > SETTLING)
        positions = np.full((len(JOINTS), 3), np.nan)
        rotations = np.full((len(JOINTS), 4), np.nan)
        for tracker in there:
            place = HEAD if tracker == _HEAD_ID else self._places.get(tracker)
            if place is not None:
                positions[place], rotations[place] = self._positions[tracker], self._turns[tracker]
        seen = ~np.isnan(positions[:, 0])
        if not seen.any():
            return []
        return [SkeletonFrame(arrival, positions, rotations, seen * 1.0, arrival=arrival)]

    def _assign(self, there: Sequence[int], *, settled: bool) -> None:
        """Assign new trackers to joints; after settling, the others keep theirs."""
        if self._given or {_HEAD_ID, *self._places} >= set(there):
            return
        kept = self._places if settled else {}
        new = [tracker for tracker in there if tracker != _HEAD_ID and tracker not in kept]
        head = self._positions[_HEAD_ID] if _HEAD_ID in there else None
        turn = self._turns[_HEAD_ID]
        facing = None if head is None or np.isnan(turn).any() else turn
        places = assign_trackers(self._positions[new], head, facing, taken=kept.values())
        self._places = {**kept, **dict(zip(new, places.tolist(), strict=True))}


def _three(message: Message, most: float) -> NDArray[np.float64] | None:
    """The three numbers of a message; None if there are not three or one is implausible."""
    if not message.begins("fff"):
        return None
    values = np.array(message.arguments[:3], dtype=np.float64)
    return values if (np.abs(values) < most).all() else None  # None for NaN


def _places(text: str) -> dict[int, int]:
    """Parse ``NUMBER:JOINT,NUMBER:JOINT``."""
    places: dict[int, int] = {}
    for pair in text.split(","):
        number, _, joint = pair.partition(":")
        place = JOINTS.index(joint) if joint in JOINTS else None
        if number not in set("12345678") or place is None or place in places.values():
            raise ValueError(f"expected NUMBER:JOINT,... with 1 to 8 and {', '.join(JOINTS)}")
        places[int(number)] = place
    return places


def open_device(address: SplitResult) -> LiveStream:
    """Listen at ``vrchat://HOST:PORT?trackers=NUMBER:JOINT,...``.

    Raises:
        InputError: the port is taken, or an option is unknown.
    """
    options = options_of(address, {"trackers": _places})
    host, port = host_and_port(address, PORT)
    transport = UdpTransport(host, port, scheme=address.scheme)
    return LiveStream(transport, lambda: VrchatDecoder(options.get("trackers")))
