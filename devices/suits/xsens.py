"""Device ``xsens://127.0.0.1:9763``: Xsens MVN's network streamer, by UDP or TCP.

MVN sends to a configured address; by TCP (``?transport=tcp``) it connects to us, and the same
datagrams follow one another. They are big-endian. The kinds MXTP02 (positions and quaternions) and
MXTP01 (positions and Euler angles) hold a pose; a pose that is too long for one datagram is split.
MVN's world is right-handed, Z up (``?up=y`` if MVN is set to Y up), with the suit's X forward at
calibration; in MXTP01 it is Y up, Z forward. Positions are metres or centimetres, depending on the
version; the size of the body decides. The order of MXTP01's angles is not specified, so its
rotations are left unknown.

Source: MVN real-time network streaming protocol specification, section 2.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from urllib.parse import SplitResult

import numpy as np
from numpy.typing import NDArray

from devices.address import host_and_port, one_of, options_of
from devices.skeleton import SkeletonFrame
from devices.suits.xsens_segments import BODY, FINGERS_A_HAND, xsens_skeleton
from devices.transport.clock_map import STEP_BACK, ClockMap
from devices.transport.live_stream import LiveStream
from devices.transport.tcp import Framing, TcpTransport
from devices.transport.udp import UdpTransport

Array = NDArray[np.float64]

PORT = 9763
FARTHEST = 1000.0  # [m] of a plausible position
MOST_CHARACTERS = 32
MOST_OPEN = 4  # incomplete samples of one character that are kept
MOST_PARTS = 8  # datagrams of one sample
LATE = 1000  # samples that a late datagram is behind at most; beyond that, MVN has restarted
SMALLEST_IN_CM = 5.0  # size in centimetres of a body whose size in metres is at most 0.5

HEADER = struct.Struct(">6sIBBIBBBBHH")
_LAST = 0x80  # flag of the datagram counter
_QUATERNIONS, _EULER = b"MXTP02", b"MXTP01"
_SEGMENTS = {
    _QUATERNIONS: np.dtype([("id", ">u4"), ("position", ">f4", 3), ("rotation", ">f4", 4)]),
    _EULER: np.dtype([("id", ">u4"), ("position", ">f4", 3), ("angles", ">f4", 3)]),
}
# Names and proportions of the character, joint angles, kinematics, sensors, time code: no poses.
_WITHOUT_POSE = {b"12", b"13", b"20", b"21", b"22", b"23", b"24", b"25"}
# Axes to ours of (forward, left, up) and, if MVN is set to Y up, of (forward, up, right).
_AXES = {
    "z": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
}
_FEWEST = 3  # segments needed to measure a body


@dataclass(frozen=True, slots=True, eq=False)
class _Datagram:
    """One datagram with segments.

    Attributes:
        kind: the protocol's identifier.
        counter: of the sample.
        place: index among the sample's datagrams.
        last: whether it is the sample's last datagram.
        time: [s] on MVN's clock.
        character: number of the character.
        props: number of the character's segments that are props.
        segments: in the layout of `_SEGMENTS`.
    """

    kind: bytes
    counter: int
    place: int
    last: bool
    time: float
    character: int
    props: int
    segments: NDArray[np.void]


@dataclass(slots=True, eq=False)
class _Sample:
    """The datagrams of one pose so far, by their index; their number once it is known."""

    parts: dict[int, NDArray[np.void]] = field(default_factory=dict)
    count: int | None = None

    @property
    def whole(self) -> bool:
        return self.count is not None and all(part in self.parts for part in range(self.count))


@dataclass(slots=True, eq=False)
class _Character:
    """State of one character in MVN.

    Attributes:
        open: incomplete samples, by counter.
        newest: counter of the last complete sample.
        came: its arrival [s].
        quaternions: arrival [s] of the last MXTP02.
        unit: [m] of its positions.
    """

    open: dict[int, _Sample] = field(default_factory=dict)
    newest: int = -1
    came: float = -1e300
    quaternions: float = -1e300
    unit: float = 1.0


class XsensDecoder:
    """Frames of every character of one MVN.

    Args:
        fingers: whether the skeleton has the 40 segments of MVN's gloves.
        up: the up axis of MXTP02, "z" or "y".

    Attributes:
        refused: datagrams that were malformed, late, repeated, of an unsupported kind, or part of a
            sample that stayed incomplete.
    """

    def __init__(self, *, fingers: bool = False, up: str = "z") -> None:
        self.refused = 0
        self.skeleton = xsens_skeleton(fingers=fingers)
        self._axes = _AXES[up]
        self._clock = ClockMap()
        self._characters: dict[int, _Character] = {}

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frame that a datagram, received at `arrival` [s], completes."""
        datagram = _datagram(data)
        if datagram is None:
            self.refused += data[:4] != b"MXTP" or data[4:6] not in _WITHOUT_POSE
            return ()
        character = self._characters.setdefault(datagram.character, _Character())
        if datagram.kind == _QUATERNIONS:
            character.quaternions = arrival
        elif arrival - character.quaternions < 1.0:
            return ()  # the same poses with less information
        if self._late(character, datagram.counter, arrival):
            self.refused += 1
            return ()
        whole = self._assemble(character, datagram)
        if whole is None:
            return ()
        character.newest, character.came = datagram.counter, arrival
        positions, rotations = self._joints(whole, datagram.props, character)
        return [
            SkeletonFrame(
                time=self._clock.host_time(datagram.time, arrival),
                positions=positions,
                rotations=rotations,
                confidence=np.isfinite(positions[:, 0]) * 1.0,
                performer=datagram.character,
                arrival=arrival,
            )
        ]

    def _late(self, character: _Character, counter: int, arrival: float) -> bool:
        """Whether a sample is late or repeated; a restart of MVN is neither."""
        behind = character.newest - counter
        if behind < 0:
            return False
        if behind < LATE and arrival - character.came < STEP_BACK:
            return True
        character.open.clear()
        character.newest = -1
        return False

    def _assemble(self, character: _Character, datagram: _Datagram) -> NDArray[np.void] | None:
        """The segments of the sample that this datagram completes, or None."""
        sample = character.open.setdefault(datagram.counter, _Sample())
        if datagram.place in sample.parts:
            self.refused += 1
            return None
        sample.parts[datagram.place] = datagram.segments
        if datagram.last:
            sample.count = datagram.place + 1
        if sample.whole:
            overtaken = [counter for counter in character.open if counter <= datagram.counter]
            self.refused += len(overtaken) - 1
            for counter in overtaken:
                del character.open[counter]
            layout = datagram.segments.dtype
            parts = [part for _, part in sorted(sample.parts.items()) if part.dtype == layout]
            return np.concatenate(parts)
        if len(character.open) > MOST_OPEN:
            del character.open[min(character.open)]
            self.refused += 1
        return None

    @np.errstate(over="ignore", invalid="ignore")  # values of a damaged packet
    def _joints(
        self, segments: NDArray[np.void], props: int, character: _Character
    ) -> tuple[Array, Array]:
        """Positions (J, 3) [m] and rotations (J, 4) in our axes; NaN where unknown."""
        count = len(self.skeleton.names)
        joints, inside = _joint_numbers(segments["id"], props, count)
        positions, rotations = np.full((count, 3), np.nan), np.full((count, 4), np.nan)
        positions[joints] = segments["position"][inside]
        size = _size(positions[:BODY])
        if size > 0.0:
            character.unit = 0.01 if size > SMALLEST_IN_CM else 1.0
        positions *= character.unit
        positions[~(np.abs(positions) < FARTHEST).all(axis=1)] = np.nan  # also where it is NaN
        if "rotation" not in (segments.dtype.names or ()):
            return positions, rotations  # MXTP01, whose axes are ours
        w, *axis = segments["rotation"][inside].astype(np.float64).T
        rotations[joints] = np.column_stack([np.column_stack(axis) @ self._axes.T, w])
        length = np.linalg.norm(rotations, axis=1)
        turned = (length > 0.5) & (length < 2.0) & np.isfinite(positions[:, 0])
        rotations[turned] /= length[turned, None]
        rotations[~turned] = np.nan
        return positions @ self._axes.T, rotations


def _datagram(data: bytes) -> _Datagram | None:
    """Decode a datagram; None if it holds no pose or contradicts its header."""
    if len(data) < HEADER.size:
        return None
    tag, counter, place, count, time, who, _, props, _, _, size = HEADER.unpack_from(data)
    layout = _SEGMENTS.get(tag)
    if layout is None or count == 0 or len(data) != HEADER.size + count * layout.itemsize:
        return None
    number, last = place & ~_LAST, bool(place & _LAST)
    if size not in (0, len(data) - HEADER.size) or number >= MOST_PARTS or who >= MOST_CHARACTERS:
        return None
    segments = np.frombuffer(data, layout, offset=HEADER.size)
    return _Datagram(tag, counter, number, last, time * 1e-3, who, props, segments)


def datagram_length(head: bytes) -> int | None:
    """Return the length of the datagram that begins with the 24-byte header `head`, or None.

    Old versions of MVN leave the payload size empty; the number of items gives it for poses.
    """
    tag, _, _, count, _, _, _, _, _, _, size = HEADER.unpack(head)
    if tag[:4] != b"MXTP" or not tag[4:].isdigit():
        return None
    layout = _SEGMENTS.get(tag)
    if layout is None:
        return HEADER.size + size if size else None
    items = count * layout.itemsize
    return HEADER.size + items if size in (0, items) else None


def _size(positions: Array) -> float:
    """Median distance of a body's segments from their middle; 0 if too few are seen."""
    seen = positions[np.isfinite(positions).all(axis=1)]
    if len(seen) < _FEWEST:
        return 0.0
    return float(np.median(np.linalg.norm(seen - np.median(seen, axis=0), axis=1)))


def _joint_numbers(
    ids: NDArray[np.uint32], props: int, count: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the joint of each segment, and which segments have one; props have none.

    Segments count from 1; those of the fingers begin after the body's and the props.
    """
    index = ids.astype(np.int64) - 1
    finger = index - props
    joints = np.where(index < BODY, index, finger)
    body = (index >= 0) & (index < BODY)
    hands = (finger >= BODY) & (finger < min(count, BODY + 2 * FINGERS_A_HAND))
    inside = body | hands
    return joints[inside], inside


def open_device(address: SplitResult) -> LiveStream:
    """Listen at ``xsens://HOST:PORT?transport=udp|tcp&fingers=on|off&up=z|y``.

    Raises:
        InputError: the port is taken, or an option is unknown.
    """
    known = {
        "transport": one_of("udp", "tcp"),
        "fingers": one_of("on", "off"),
        "up": one_of(*_AXES),
    }
    options = options_of(address, known)
    host, port = host_and_port(address, PORT)
    transport: UdpTransport | TcpTransport
    if options.get("transport") == "tcp":
        framing = Framing("MXTP", HEADER.size, datagram_length)
        transport = TcpTransport(host, port, scheme=address.scheme, framing=framing)
    else:
        transport = UdpTransport(host, port, scheme=address.scheme)
    return LiveStream(
        transport,
        lambda: XsensDecoder(fingers=options.get("fingers") == "on", up=options.get("up", "z")),
    )
