"""Xsens MVN's network streamer: ``xsens://127.0.0.1:9763``, poses of a whole suit by UDP or TCP.

MVN is told where to send; by TCP (``?transport=tcp``) it connects to us, and the same datagrams
come one after another. They are big-endian. Of their kinds, MXTP02 (positions and quaternions) and
MXTP01 (positions and Euler angles) hold a pose; a pose that is too long for one datagram comes in
several. MVN's world is right-handed, Z up (``?up=y`` where MVN was told so), the suit's X forward
at calibration; in MXTP01 it is Y up, Z forward. Positions are metres or centimetres, as versions
differ; the size of the body tells. In which order MXTP01's angles are to be applied is not
specified, so its rotations are left unknown.

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
FARTHEST = 1000.0  # [m] or a position is not believed
MOST_CHARACTERS = 32
MOST_OPEN = 4  # samples of one character whose datagrams are waited for
MOST_PARTS = 8  # datagrams of one sample
LATE = 1000  # samples that a datagram is behind at most; one further behind began to count anew
SMALLEST_IN_CM = 5.0  # of a body whose size in metres is 0.5 or less

HEADER = struct.Struct(">6sIBBIBBBBHH")
_LAST = 0x80  # flag of the datagram counter
_QUATERNIONS, _EULER = b"MXTP02", b"MXTP01"
_SEGMENTS = {
    _QUATERNIONS: np.dtype([("id", ">u4"), ("position", ">f4", 3), ("rotation", ">f4", 4)]),
    _EULER: np.dtype([("id", ">u4"), ("position", ">f4", 3), ("angles", ">f4", 3)]),
}
# Names and proportions of the character, joint angles, kinematics, sensors, time code: no pose.
_WITHOUT_POSE = {b"12", b"13", b"20", b"21", b"22", b"23", b"24", b"25"}
# To ours of (forward, left, up) and, where MVN is set to Y up, of (forward, up, right).
_AXES = {
    "z": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
}
_FEWEST = 3  # segments by which a body can be measured


@dataclass(frozen=True, slots=True, eq=False)
class _Datagram:
    """One datagram with segments.

    Attributes:
        kind: the protocol's identifier.
        counter: of the sample.
        place: among the sample's datagrams.
        last: whether none of the sample's follow.
        time: [s] of MVN's clock.
        character: whose segments they are.
        props: how many of the character's segments are things held.
        segments: as `_SEGMENTS` lays them out.
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
    """The datagrams of one pose so far, by their place; how many there are once that is known."""

    parts: dict[int, NDArray[np.void]] = field(default_factory=dict)
    count: int | None = None

    @property
    def whole(self) -> bool:
        return self.count is not None and all(part in self.parts for part in range(self.count))


@dataclass(slots=True, eq=False)
class _Character:
    """What is known of one character of MVN's.

    Attributes:
        open: samples that are not whole, by counter.
        newest: counter of the last whole one.
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
        up: which axis of MXTP02 is up, "z" or "y".

    Attributes:
        refused: datagrams that were malformed, late, repeated, of a kind that is not read, or whose
            sample never became whole.
    """

    def __init__(self, *, fingers: bool = False, up: str = "z") -> None:
        self.refused = 0
        self.skeleton = xsens_skeleton(fingers=fingers)
        self._axes = _AXES[up]
        self._clock = ClockMap()
        self._characters: dict[int, _Character] = {}

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """The frame that a datagram, which came at `arrival` [s], completes."""
        datagram = _datagram(data)
        if datagram is None:
            self.refused += data[:4] != b"MXTP" or data[4:6] not in _WITHOUT_POSE
            return ()
        character = self._characters.setdefault(datagram.character, _Character())
        if datagram.kind == _QUATERNIONS:
            character.quaternions = arrival
        elif arrival - character.quaternions < 1.0:
            return ()  # the same poses once more, with less in them
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
        """Whether a sample was overtaken by a newer one or came already; a restart is neither."""
        behind = character.newest - counter
        if behind < 0:
            return False
        if behind < LATE and arrival - character.came < STEP_BACK:
            return True
        character.open.clear()
        character.newest = -1
        return False

    def _assemble(self, character: _Character, datagram: _Datagram) -> NDArray[np.void] | None:
        """The segments of the sample that this datagram makes whole."""
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

    @np.errstate(over="ignore", invalid="ignore")  # whatever a damaged packet holds
    def _joints(
        self, segments: NDArray[np.void], props: int, character: _Character
    ) -> tuple[Array, Array]:
        """Positions (J, 3) [m] and rotations (J, 4) in our axes, NaN where unknown."""
        count = len(self.skeleton.names)
        joints, inside = _joint_numbers(segments["id"], props, count)
        positions, rotations = np.full((count, 3), np.nan), np.full((count, 4), np.nan)
        positions[joints] = segments["position"][inside]
        size = _size(positions[:BODY])
        if size > 0.0:
            character.unit = 0.01 if size > SMALLEST_IN_CM else 1.0
        positions *= character.unit
        positions[~(np.abs(positions) < FARTHEST).all(axis=1)] = np.nan  # NaN is not less
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
    """What a datagram holds; None where that is no pose, or other than its header says."""
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
    """Bytes of the datagram that begins with `head`, its 24 bytes of header; None if it is none.

    MVN left the size of the payload empty before the protocol had one; the items of a pose tell it.
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
    """How far a body's segments are from its middle, in the median; 0 where too few are seen."""
    seen = positions[np.isfinite(positions).all(axis=1)]
    if len(seen) < _FEWEST:
        return 0.0
    return float(np.median(np.linalg.norm(seen - np.median(seen, axis=0), axis=1)))


def _joint_numbers(
    ids: NDArray[np.uint32], props: int, count: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The joint of each segment, and which segments have one: props have none.

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
        InputError: the port is taken, or an option is not known.
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
