"""Device ``leap://``: the Leap Motion through LeapC, the library of Ultraleap's tracking service.

The library is part of Ultraleap's hand tracking software, so nothing else needs to be installed.
Source: Ultraleap Gemini SDK 5, LeapC.h; all its structures are packed without gaps. Millimetres,
device axes; quaternions (x, y, z, w); times in microseconds on the host's clock.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from urllib.parse import SplitResult

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.address import one_of, options_of
from devices.errors import InputError
from devices.leap.hands import FARTHEST_MM, Hand, palm_basis, rotations
from devices.leap.joints import FINGERS, HAND_PARENTS, PALM
from devices.leap.performer import BOTH, LeapPerformer
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.clock_map import ClockMap
from devices.transport.live_stream import LiveStream
from devices.transport.sdk_library import SensorLostError, SensorTransport, load_library

Array = NDArray[np.float64]

_SERVICE = "Ultraleap/TrackingService/bin/LeapC.dll"
LIBRARIES = (
    "LeapC.dll",
    f"C:/Program Files/{_SERVICE}",
    "libLeapC.so",
    "libLeapC.so.5",
    "/usr/lib/ultraleap-hand-tracking-service/libLeapC.so",
    "/Applications/Ultraleap Hand Tracking.app/Contents/LeapSDK/lib/libLeapC.dylib",
)
MISSING = (
    "cannot open leap://: LeapC is missing; install Ultraleap's Hand Tracking software (Gemini 5 "
    "or later), or use leap+ws://127.0.0.1:6437 where a WebSocket service runs"
)
MODES = {"desktop": 0, "screentop": 2}
WAIT_MS = 100
SILENT_WAITS = 50  # waits of WAIT_MS without a message, after which the connection is reopened
MOST_HANDS = 8
_TIMEOUT = 0xE2010004
_BACKGROUND_FRAMES = 0x1
_CONNECTION, _CONNECTION_LOST, _TRACKING, _DEVICE_LOST = 0x1, 0x2, 0x100, 0x104
_LEFT = 0
# Of each joint at which a finger's bone starts: the finger, and which of its four bones.
_STARTS = {
    f"{finger}_{joint}": (row, bone)
    for row, finger in enumerate(FINGERS)
    for bone, joint in enumerate(("mcp", "pip", "dip"), 1)
    if f"{finger}_{joint}" in HAND_PARENTS
}


class Bone(ctypes.Structure):
    """LEAP_BONE: 44 bytes."""

    _pack_ = 1
    _fields_ = (
        ("start", ctypes.c_float * 3),
        ("end", ctypes.c_float * 3),
        ("width", ctypes.c_float),
        ("rotation", ctypes.c_float * 4),
    )


class Digit(ctypes.Structure):
    """LEAP_DIGIT: 184 bytes; metacarpal, proximal, intermediate and distal bone."""

    _pack_ = 1
    _fields_ = (
        ("id", ctypes.c_int32),
        ("bones", Bone * 4),
        ("is_extended", ctypes.c_uint32),
    )


class Palm(ctypes.Structure):
    """LEAP_PALM: 80 bytes."""

    _pack_ = 1
    _fields_ = (
        ("position", ctypes.c_float * 3),
        ("stabilized_position", ctypes.c_float * 3),
        ("velocity", ctypes.c_float * 3),
        ("normal", ctypes.c_float * 3),
        ("width", ctypes.c_float),
        ("direction", ctypes.c_float * 3),
        ("orientation", ctypes.c_float * 4),
    )


class LeapHand(ctypes.Structure):
    """LEAP_HAND: 1084 bytes."""

    _pack_ = 1
    _fields_ = (
        ("id", ctypes.c_uint32),
        ("flags", ctypes.c_uint32),
        ("type", ctypes.c_int32),
        ("confidence", ctypes.c_float),
        ("visible_time", ctypes.c_uint64),
        ("pinch_distance", ctypes.c_float),
        ("grab_angle", ctypes.c_float),
        ("pinch_strength", ctypes.c_float),
        ("grab_strength", ctypes.c_float),
        ("palm", Palm),
        ("digits", Digit * 5),
        ("arm", Bone),
    )


class TrackingEvent(ctypes.Structure):
    """LEAP_TRACKING_EVENT: 48 bytes on a 64-bit machine."""

    _pack_ = 1
    _fields_ = (
        ("reserved", ctypes.c_void_p),
        ("frame_id", ctypes.c_int64),
        ("time", ctypes.c_int64),
        ("tracking_frame_id", ctypes.c_int64),
        ("hand_count", ctypes.c_uint32),
        ("hands", ctypes.c_void_p),
        ("framerate", ctypes.c_float),
    )


class Message(ctypes.Structure):
    """LEAP_CONNECTION_MESSAGE: 20 bytes on a 64-bit machine."""

    _pack_ = 1
    _fields_ = (
        ("size", ctypes.c_uint32),
        ("type", ctypes.c_int32),
        ("event", ctypes.c_void_p),
        ("device_id", ctypes.c_uint32),
    )


class Header(ctypes.Structure):
    """The data before the hands in the packet from the library to the decoder: time [us], count."""

    _pack_ = 1
    _fields_ = (("time", ctypes.c_int64), ("hands", ctypes.c_uint32))


class LeapCDecoder:
    """Frames of a performer's hands, from the bytes of tracking events.

    Attributes:
        refused: packets that could not be decoded.
    """

    def __init__(self, hands: str = BOTH) -> None:
        self._performer = LeapPerformer(hands)
        self._clock = ClockMap()
        self.refused = 0

    @property
    def skeleton(self) -> Skeleton:
        """Both hands, or the chosen one."""
        return self._performer.skeleton

    @np.errstate(over="ignore", invalid="ignore")  # values of a damaged packet
    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frame in a `Header` and its hands, received at `arrival` [s]."""
        header = Header()
        size = ctypes.sizeof(Header)
        if len(data) >= size:
            header = Header.from_buffer_copy(data)
            size += min(header.hands, MOST_HANDS) * ctypes.sizeof(LeapHand)
        if len(data) != size or header.hands > MOST_HANDS:
            self.refused += 1
            return []
        hands = np.frombuffer(data, np.dtype(LeapHand), offset=ctypes.sizeof(Header))
        seen = [hand for hand in map(_hand, hands) if PALM in hand.joints]
        time = self._clock.host_time(header.time * 1e-6, arrival)
        return [self._performer.frame(seen, time, arrival)]


def _hand(found: np.void) -> Hand:
    """Convert a LEAP_HAND to a `Hand`; joints with invalid numbers are omitted."""
    bones, palm = found["digits"]["bones"], found["palm"]
    starts = bones["start"].astype(np.float64)  # (5, 4, 3)
    places = {name: starts[finger, bone] for name, (finger, bone) in _STARTS.items()}
    turns = {name: bones["rotation"][finger, bone] for name, (finger, bone) in _STARTS.items()}
    for finger, end in zip(FINGERS, bones["end"][:, -1].astype(np.float64), strict=True):
        places[f"{finger}_tip"] = end
        turns[f"{finger}_tip"] = turns[f"{finger}_dip"]
    places |= {
        PALM: palm["position"].astype(np.float64),
        "elbow": found["arm"]["start"].astype(np.float64),
        "wrist": found["arm"]["end"].astype(np.float64),
    }
    turns |= {"elbow": found["arm"]["rotation"], "wrist": found["arm"]["rotation"]}
    direction, normal = palm["direction"].astype(np.float64), palm["normal"].astype(np.float64)
    near = (np.abs(np.array(list(places.values()))) <= FARTHEST_MM).all(axis=1)  # False for NaN
    return Hand(
        id=int(found["id"]),
        side="left" if found["type"] == _LEFT else "right",
        confidence=_share(float(found["confidence"])),
        joints={name: places[name] for name, good in zip(places, near, strict=True) if good},
        direction=direction,
        normal=normal,
        bases=_bases(turns, palm_basis(direction, normal)),
    )


def _bases(turns: Mapping[str, NDArray[np.float32]], palm: Array) -> dict[str, Array]:
    quaternions = np.array(list(turns.values()), dtype=np.float64)
    length = np.linalg.norm(quaternions, axis=1)
    known = (length > 0.5) & (length < 2.0)  # a bone without length has no rotation
    found: dict[str, Array] = {}
    if known.any():
        matrices = Rotation.from_quat(quaternions[known]).as_matrix()
        names = [name for name, good in zip(turns, known, strict=True) if good]
        found = dict(zip(names, matrices, strict=True))
    (turned,), (square,) = rotations(palm[None])
    return found | ({PALM: turned} if square else {})


def _share(confidence: float) -> float:
    return min(max(confidence, 0.0), 1.0) if np.isfinite(confidence) else 0.0


class LeapC:
    """An open connection to the service.

    Args:
        library: LeapC.
        mode: orientation of the device, one of `MODES`.

    Raises:
        InputError: the library gives no connection.
    """

    def __init__(self, library: ctypes.CDLL, mode: str = "desktop") -> None:
        self._leap = library
        self._mode = MODES[mode]
        self._silent = 0
        self._connection = ctypes.c_void_p()
        handle, number, out = ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p
        for name, takes in (
            ("LeapCreateConnection", [out, out]),
            ("LeapOpenConnection", [handle]),
            ("LeapPollConnection", [handle, number, out]),
            ("LeapSetPolicyFlags", [handle, ctypes.c_uint64, ctypes.c_uint64]),
            ("LeapSetTrackingMode", [handle, number]),
            ("LeapCloseConnection", [handle]),
            ("LeapDestroyConnection", [handle]),
        ):
            function = getattr(library, name)
            function.restype, function.argtypes = number, takes
        code = library.LeapCreateConnection(None, ctypes.byref(self._connection))
        code = code or library.LeapOpenConnection(self._connection)
        if code:
            self.close()
            raise InputError(
                f"cannot open leap://: the service gives no connection (0x{code:08X}); start "
                "Ultraleap's Hand Tracking service"
            )

    def read(self) -> bytes | None:
        """Return the bytes of the next tracking event, or None for another message or none."""
        message = Message(size=ctypes.sizeof(Message))
        code = self._leap.LeapPollConnection(self._connection, WAIT_MS, ctypes.byref(message))
        if code:
            self._silent += 1
            if code != _TIMEOUT or self._silent > SILENT_WAITS:
                raise SensorLostError(
                    f"the Leap's service sends nothing (0x{code:08X}); start it, and plug in the "
                    "Leap"
                )
            return None
        self._silent = 0
        if message.type == _CONNECTION:
            self._leap.LeapSetPolicyFlags(self._connection, _BACKGROUND_FRAMES, 0)
            self._leap.LeapSetTrackingMode(self._connection, self._mode)
        elif message.type in (_CONNECTION_LOST, _DEVICE_LOST):
            raise SensorLostError("the Leap was unplugged, or its service stopped; restore it")
        return _event_bytes(message) if message.type == _TRACKING and message.event else None

    def close(self) -> None:
        """Close the connection."""
        if self._connection:
            self._leap.LeapCloseConnection(self._connection)
            self._leap.LeapDestroyConnection(self._connection)
            self._connection = ctypes.c_void_p()


def _event_bytes(message: Message) -> bytes:
    """Copy a tracking event, which the library overwrites with the next message."""
    event = TrackingEvent.from_address(message.event)
    count = min(event.hand_count, MOST_HANDS) if event.hands else 0
    hands = ctypes.string_at(event.hands, count * ctypes.sizeof(LeapHand)) if count else b""
    return bytes(Header(time=event.time, hands=count)) + hands


def open_device(address: SplitResult) -> LiveStream:
    """Open ``leap://?hands=both&mode=desktop``.

    Raises:
        InputError: an option is unknown, or LeapC or its service is missing.
    """
    if address.netloc or address.path.strip("/"):
        raise InputError(
            f"cannot open {address.geturl()!r}: expected leap:// alone; for a service elsewhere "
            "use leap+ws://HOST:PORT"
        )
    options = options_of(address, {"hands": one_of(BOTH, "left", "right"), "mode": one_of(*MODES)})
    mode, hands = options.get("mode", "desktop"), options.get("hands", BOTH)
    transport = SensorTransport(lambda: LeapC(load_library(LIBRARIES, MISSING), mode))
    return LiveStream(transport, lambda: LeapCDecoder(hands))
