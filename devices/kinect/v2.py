"""Kinect for Xbox One through the COM interfaces of Kinect20.dll, called by their method tables.

The SDK's only plain function returns an `IKinectSensor`. Its methods, and those of the objects that
it opens, are called by their index in the interface's table, so no COM library is needed.
Source: Kinect for Windows SDK 2.0, Kinect.h. Metres in camera space; six slots for bodies, which
are not identities; the orientation of a joint is that of the bone that ends there.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.kinect.bodies import Sensor, SensorBody, SensorFrame
from devices.kinect.joints import CONFIDENCE_OF_STATE, KINECT_TO_WORLD, KINECT_V2
from devices.transport.sdk_library import SensorLostError

LIBRARIES = ("Kinect20.dll",)
MISSING = (
    "cannot open kinect://v2: Kinect20.dll is missing; it needs Windows with the Kinect for "
    "Windows Runtime 2.0 (or run `bunraku bridge` where the Kinect is plugged in)"
)
PEOPLE = 6
JOINTS = 25
PENDING = 0x8000000A  # E_PENDING: no new frame yet
WAIT = 0.1  # [s]
PAUSE = 0.002  # [s] between two checks for a new frame
ASLEEP = 5.0  # [s] without a frame or a sensor, after which it is opened again
_TICK = 1e-7

# Indices of methods in their interface's table; the first three are IUnknown's.
_RELEASE = 2
_SENSOR_OPEN, _SENSOR_CLOSE, _SENSOR_IS_AVAILABLE, _SENSOR_BODY_FRAME_SOURCE = 6, 7, 9, 12
_SOURCE_OPEN_READER = 8
_READER_ACQUIRE_LATEST_FRAME = 6
_FRAME_BODIES, _FRAME_FLOOR, _FRAME_TIME = 3, 4, 5
_BODY_JOINTS, _BODY_ORIENTATIONS, _BODY_ID, _BODY_IS_TRACKED = 3, 4, 14, 15


class Joint(ctypes.Structure):
    """Joint: 20 bytes."""

    _fields_ = (
        ("type", ctypes.c_int32),
        ("position", ctypes.c_float * 3),
        ("state", ctypes.c_int32),
    )


class JointOrientation(ctypes.Structure):
    """JointOrientation: 20 bytes; (x, y, z, w), all zero at the ends of limbs."""

    _fields_ = (("type", ctypes.c_int32), ("orientation", ctypes.c_float * 4))


class TrackedBody(ctypes.Structure):
    """One of the six slots, in the packet from the library to the decoder."""

    _fields_ = (
        ("id", ctypes.c_uint64),
        ("tracked", ctypes.c_uint64),
        ("joints", Joint * JOINTS),
        ("orientations", JointOrientation * JOINTS),
    )


class Packet(ctypes.Structure):
    """The packet from the library to the decoder: time [100 ns], floor plane and bodies."""

    _fields_ = (
        ("time", ctypes.c_int64),
        ("floor", ctypes.c_float * 4),
        ("bodies", TrackedBody * PEOPLE),
    )


_PACKET = np.dtype(Packet)


def read_sensor_frame(data: bytes) -> SensorFrame:
    """Decode the bytes of a `Packet`.

    Raises:
        ValueError: the length is wrong.
    """
    if len(data) != ctypes.sizeof(Packet):
        raise ValueError(f"expected {ctypes.sizeof(Packet)} bytes, got {len(data)}")
    packet = np.frombuffer(data, _PACKET)[0]
    floor = packet["floor"].astype(np.float64)
    bodies = packet["bodies"]
    return SensorFrame(
        time=float(packet["time"]) * _TICK,
        bodies=[_body(bodies[slot]) for slot in np.flatnonzero(bodies["tracked"])],
        up=floor[:3],
        height=float(floor[3]) if floor[:3].any() else float("nan"),
    )


def _body(body: np.void) -> SensorBody:
    positions, rotations = np.zeros((JOINTS, 3)), np.zeros((JOINTS, 4))
    confidence = np.zeros(JOINTS)
    joints, turns = body["joints"], body["orientations"]
    states = joints["state"]
    joints = joints[_is_joint(joints["type"]) & (states >= 0) & (states <= 2)]
    positions[joints["type"]] = joints["position"]
    confidence[joints["type"]] = CONFIDENCE_OF_STATE[joints["state"]]
    turns = turns[_is_joint(turns["type"])]
    rotations[turns["type"]] = turns["orientation"]
    return SensorBody(int(body["id"]), positions, rotations, confidence)


def _is_joint(types: NDArray[np.int32]) -> NDArray[np.bool_]:
    return (types >= 0) & (types < JOINTS)


SENSOR = Sensor(KINECT_V2, KINECT_TO_WORLD, ("FootLeft", "FootRight"), read_sensor_frame)


def _method(thing: ctypes.c_void_p, place: int, *types: type) -> Callable[..., int]:
    """The method at index `place` in the table of a COM object; it returns an unsigned HRESULT."""
    kind: Any = getattr(ctypes, "WINFUNCTYPE", ctypes.CFUNCTYPE)
    table = ctypes.cast(thing, ctypes.POINTER(ctypes.POINTER(ctypes.c_void_p)))[0]
    function = kind(ctypes.c_uint32, ctypes.c_void_p, *types)(table[place])
    return lambda *arguments: int(function(thing, *arguments))


def _release(thing: ctypes.c_void_p) -> None:
    if thing:
        _method(thing, _RELEASE)()


class KinectV2:
    """An open sensor.

    Args:
        library: Kinect20.dll.

    Raises:
        InputError: the SDK gives no sensor.
    """

    def __init__(self, library: ctypes.CDLL) -> None:
        self._sensor, self._reader = ctypes.c_void_p(), ctypes.c_void_p()
        self._bodies = (ctypes.c_void_p * PEOPLE)()
        self._last = time.perf_counter()
        library.GetDefaultKinectSensor.restype = ctypes.c_uint32
        code = library.GetDefaultKinectSensor(ctypes.byref(self._sensor))
        if not code:
            code = _method(self._sensor, _SENSOR_OPEN)()
        if not code:
            code = self._open_reader()
        if code:
            self.close()
            raise InputError(
                f"cannot open kinect://v2: no sensor answers (0x{code:08X}); plug it in to USB 3, "
                "with its own power supply"
            )

    def _open_reader(self) -> int:
        source = ctypes.c_void_p()
        code = _method(self._sensor, _SENSOR_BODY_FRAME_SOURCE, ctypes.c_void_p)(
            ctypes.addressof(source)
        )
        if not code:
            code = _method(source, _SOURCE_OPEN_READER, ctypes.c_void_p)(
                ctypes.addressof(self._reader)
            )
            _release(source)
        return code

    def read(self) -> bytes | None:
        """Return the bytes of the newest `Packet`, or None if none came in time."""
        frame = ctypes.c_void_p()
        latest = _method(self._reader, _READER_ACQUIRE_LATEST_FRAME, ctypes.c_void_p)
        until = time.perf_counter() + WAIT
        while (code := latest(ctypes.addressof(frame))) == PENDING:
            if time.perf_counter() > until:
                self._still_there()
                return None
            time.sleep(PAUSE)
        if code:
            raise SensorLostError(f"the Kinect no longer answers (0x{code:08X}); plug it in again")
        self._last = time.perf_counter()
        try:
            return bytes(self._packet(frame))
        finally:
            _release(frame)

    def _still_there(self) -> None:
        available = ctypes.c_ubyte()
        _method(self._sensor, _SENSOR_IS_AVAILABLE, ctypes.c_void_p)(ctypes.addressof(available))
        if available.value:
            self._last = time.perf_counter()
        elif time.perf_counter() - self._last > ASLEEP:
            raise SensorLostError("the Kinect is absent; plug it in to USB 3, with its power")

    def _packet(self, frame: ctypes.c_void_p) -> Packet:
        packet = Packet()
        _method(frame, _FRAME_TIME, ctypes.c_void_p)(ctypes.addressof(packet))
        _method(frame, _FRAME_FLOOR, ctypes.c_void_p)(
            ctypes.addressof(packet) + Packet.floor.offset
        )
        refresh = _method(frame, _FRAME_BODIES, ctypes.c_uint32, ctypes.c_void_p)
        if refresh(PEOPLE, ctypes.addressof(self._bodies)) == 0:
            for pointer, slot in zip(self._bodies, packet.bodies, strict=True):
                if pointer:
                    _fill(ctypes.c_void_p(pointer), slot)
        return packet

    def close(self) -> None:
        """Release the sensor."""
        for body in self._bodies:
            _release(ctypes.c_void_p(body))
        self._bodies = (ctypes.c_void_p * PEOPLE)()
        _release(self._reader)
        self._reader = ctypes.c_void_p()
        if self._sensor:
            _method(self._sensor, _SENSOR_CLOSE)()
            _release(self._sensor)
            self._sensor = ctypes.c_void_p()


def _fill(body: ctypes.c_void_p, slot: TrackedBody) -> None:
    """Copy an IBody into a slot; if a call fails, the slot stays untracked."""
    tracked = ctypes.c_ubyte()
    _method(body, _BODY_IS_TRACKED, ctypes.c_void_p)(ctypes.addressof(tracked))
    if not tracked.value:
        return
    start = ctypes.addressof(slot)
    joints = _method(body, _BODY_JOINTS, ctypes.c_uint32, ctypes.c_void_p)
    turns = _method(body, _BODY_ORIENTATIONS, ctypes.c_uint32, ctypes.c_void_p)
    failed = (
        _method(body, _BODY_ID, ctypes.c_void_p)(start)
        or joints(JOINTS, start + TrackedBody.joints.offset)
        or turns(JOINTS, start + TrackedBody.orientations.offset)
    )
    slot.tracked = not failed
