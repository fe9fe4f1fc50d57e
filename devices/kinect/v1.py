"""Kinect for Xbox 360 and Kinect for Windows v1 through the C interface of Kinect10.dll.

Source: Kinect for Windows SDK 1.8, NuiApi.h, NuiSensor.h, NuiSkeleton.h. Metres in camera space. Of
six people two are tracked; of the others only the position is known, and they are omitted.
"""

from __future__ import annotations

import ctypes

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.kinect.bodies import Sensor, SensorBody, SensorFrame
from devices.kinect.joints import CONFIDENCE_OF_STATE, KINECT_TO_WORLD, KINECT_V1
from devices.transport.sdk_library import SensorLostError

LIBRARIES = ("Kinect10.dll",)
MISSING = (
    "cannot open kinect://v1: Kinect10.dll is missing; it needs Windows with the Kinect for "
    "Windows Runtime 1.8 (or run `bunraku bridge` where the Kinect is plugged in)"
)
USES_SKELETON = 0x8
SEATED = 0x4
WAIT_MS = 100
NO_DATA = 0x83010001
PEOPLE = 6
JOINTS = 20
_TRACKED = 2
_MILLISECOND = 1e-3


class Vector4(ctypes.Structure):
    """Vector4: 16 bytes."""

    _fields_ = (("values", ctypes.c_float * 4),)


class SkeletonData(ctypes.Structure):
    """NUI_SKELETON_DATA: 436 bytes."""

    _fields_ = (
        ("tracking_state", ctypes.c_uint32),
        ("tracking_id", ctypes.c_uint32),
        ("enrollment_index", ctypes.c_uint32),
        ("user_index", ctypes.c_uint32),
        ("position", Vector4),
        ("positions", Vector4 * JOINTS),
        ("states", ctypes.c_uint32 * JOINTS),
        ("quality", ctypes.c_uint32),
    )


class NuiSkeletonFrame(ctypes.Structure):
    """NUI_SKELETON_FRAME: 2664 bytes; its time is in milliseconds."""

    _fields_ = (
        ("time", ctypes.c_int64),
        ("number", ctypes.c_uint32),
        ("flags", ctypes.c_uint32),
        ("floor", Vector4),
        ("gravity", Vector4),
        ("people", SkeletonData * PEOPLE),
    )


class BoneRotation(ctypes.Structure):
    """NUI_SKELETON_BONE_ROTATION: 80 bytes."""

    _fields_ = (("matrix", ctypes.c_float * 16), ("quaternion", Vector4))


class BoneOrientation(ctypes.Structure):
    """NUI_SKELETON_BONE_ORIENTATION: 168 bytes."""

    _fields_ = (
        ("end", ctypes.c_uint32),
        ("start", ctypes.c_uint32),
        ("hierarchical", BoneRotation),
        ("absolute", BoneRotation),
    )


class Packet(ctypes.Structure):
    """The packet from the library to the decoder: a frame, and the bones of all people in it."""

    _fields_ = (
        ("frame", NuiSkeletonFrame),
        ("bones", BoneOrientation * JOINTS * PEOPLE),
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
    frame, bones = packet["frame"], packet["bones"]
    people = frame["people"]
    tracked = (people["tracking_state"] == _TRACKED) & (people["tracking_id"] != 0)
    floor = frame["floor"]["values"].astype(np.float64)
    return SensorFrame(
        time=float(frame["time"]) * _MILLISECOND,
        bodies=[_body(people[slot], bones[slot]) for slot in np.flatnonzero(tracked)],
        up=floor[:3],
        height=float(floor[3]) if floor[:3].any() else float("nan"),
    )


def _body(person: np.void, bones: NDArray[np.void]) -> SensorBody:
    states, ends = person["states"], bones["end"]
    rotations = np.zeros((JOINTS, 4))
    rotations[ends[ends < JOINTS]] = bones["absolute"]["quaternion"]["values"][ends < JOINTS]
    return SensorBody(
        id=int(person["tracking_id"]),
        positions=person["positions"]["values"][:, :3].astype(np.float64),
        rotations=rotations,
        confidence=np.where(states > 2, 0.0, CONFIDENCE_OF_STATE[np.minimum(states, 2)]),
    )


SENSOR = Sensor(KINECT_V1, KINECT_TO_WORLD, ("FootLeft", "FootRight"), read_sensor_frame)


class KinectV1:
    """An open sensor.

    Args:
        library: Kinect10.dll.
        seated: whether only the upper body is tracked.

    Raises:
        InputError: no sensor answers.
    """

    def __init__(self, library: ctypes.CDLL, *, seated: bool = False) -> None:
        self._nui = library
        self._packet = Packet()
        for name in (
            "NuiInitialize",
            "NuiSkeletonTrackingEnable",
            "NuiSkeletonGetNextFrame",
            "NuiSkeletonCalculateBoneOrientations",
        ):
            getattr(library, name).restype = ctypes.c_uint32
        library.NuiSkeletonTrackingEnable.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
        code = library.NuiInitialize(ctypes.c_uint32(USES_SKELETON))
        if not code:
            code = library.NuiSkeletonTrackingEnable(None, SEATED if seated else 0)
            if code:
                library.NuiShutdown()
        if code:
            raise InputError(
                f"cannot open kinect://v1: no sensor answers (0x{code:08X}); plug it in, with its "
                "own power supply, and close other programs that use it"
            )

    def read(self) -> bytes | None:
        """Return the bytes of the next `Packet`, or None if none came in time."""
        frame = self._packet.frame
        code = self._nui.NuiSkeletonGetNextFrame(ctypes.c_uint32(WAIT_MS), ctypes.byref(frame))
        if code == NO_DATA:
            return None
        if code:
            raise SensorLostError(f"the Kinect no longer answers (0x{code:08X}); plug it in again")
        for person, bones in zip(frame.people, self._packet.bones, strict=True):
            failed = person.tracking_state != _TRACKED or (
                self._nui.NuiSkeletonCalculateBoneOrientations(
                    ctypes.byref(person), ctypes.byref(bones)
                )
            )
            if failed:
                ctypes.memset(ctypes.byref(bones), 0, ctypes.sizeof(bones))
        return bytes(self._packet)

    def close(self) -> None:
        """Release the sensor."""
        self._nui.NuiShutdown()
