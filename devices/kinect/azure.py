"""Azure Kinect and Orbbec Femto through the C interfaces of k4a and k4abt.

Orbbec's K4A wrapper has the same functions, so the same code opens a Femto Bolt or Mega. One thread
takes captures from the camera and keeps only the newest; another gives one capture at a time to the
body tracker and waits for its result. No queue builds up: a tracker that is slower than the camera
reduces the frame rate, not the latency.
Source: Azure Kinect Sensor SDK 1.4, k4a.h, k4atypes.h; Body Tracking SDK 1.1, k4abt.h,
k4abttypes.h; Azure-Kinect-Samples, floor_detector_sample. Millimetres, +Y down, device time in
microseconds.
"""

from __future__ import annotations

import ctypes
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.kinect.bodies import Sensor, SensorBody, SensorFrame
from devices.kinect.joints import AZURE_TO_WORLD, KINECT_AZURE
from devices.transport.sdk_library import SensorLostError

_PROGRAMS = "C:/Program Files"
LIBRARIES = (
    "k4a.dll",
    f"{_PROGRAMS}/Azure Kinect SDK v1.4.1/sdk/windows-desktop/amd64/release/bin/k4a.dll",
    "libk4a.so.1.4",
    "libk4a.so",
)
TRACKER_LIBRARIES = (
    "k4abt.dll",
    f"{_PROGRAMS}/Azure Kinect Body Tracking SDK/tools/k4abt.dll",
    "libk4abt.so.1.1",
    "libk4abt.so",
)
MISSING = (
    "cannot open kinect://azure: {} is missing; install the Azure Kinect Sensor SDK 1.4 (or "
    "Orbbec's K4A wrapper) and the Body Tracking SDK 1.1 (or run `bunraku bridge` where they are)"
)
PROCESSING = {"gpu": 0, "cpu": 1, "cuda": 2, "tensorrt": 3, "directml": 4}
DEPTH_MODES = {"nfov": (2, 2), "nfov-binned": (1, 2), "wfov": (4, 1), "wfov-binned": (3, 2)}
"""Depth mode and its highest frame rate, as values of k4a_fps_t: 2 is 30, 1 is 15 per second."""

JOINTS = 32
MOST_BODIES = 16
INVALID_ID = 0xFFFFFFFF
WAIT_MS = 100
SILENT_WAITS = 30  # waits of WAIT_MS without a capture, after which the camera counts as lost
CONFIDENCE_OF_LEVEL = np.array([0.0, 0.5, 1.0, 1.0])
"""None, low (predicted), medium (the highest that this SDK gives), high (never observed)."""

_TIMEOUT = 2  # K4A_WAIT_RESULT_TIMEOUT
_CALIBRATION_BYTES = 4096  # more than the size of k4a_calibration_t, which is only passed on
_DEPTH, _ACCELERATION = 0, 3  # k4a_calibration_type_t
_GRAVITY = 9.81
_AT_REST = 0.4  # [m/s^2] largest deviation from gravity of a camera at rest
_SAMPLES = 32


class AzureJoint(ctypes.Structure):
    """k4abt_joint_t: 32 bytes; the quaternion is (w, x, y, z)."""

    _fields_ = (
        ("position", ctypes.c_float * 3),
        ("orientation", ctypes.c_float * 4),
        ("confidence", ctypes.c_uint32),
    )


class AzureBody(ctypes.Structure):
    """k4abt_body_t: 1028 bytes."""

    _fields_ = (("id", ctypes.c_uint32), ("joints", AzureJoint * JOINTS))


class Header(ctypes.Structure):
    """The data before the bodies in the packet from the library to the decoder.

    The device time [us], the number of bodies, and the up direction in the depth camera's axes
    (zero if the accelerometer gave none).
    """

    _fields_ = (
        ("time", ctypes.c_uint64),
        ("bodies", ctypes.c_uint32),
        ("up", ctypes.c_float * 3),
    )


class DeviceConfiguration(ctypes.Structure):
    """k4a_device_configuration_t: 36 bytes."""

    _fields_ = (
        ("color_format", ctypes.c_int32),
        ("color_resolution", ctypes.c_int32),
        ("depth_mode", ctypes.c_int32),
        ("camera_fps", ctypes.c_int32),
        ("synchronized_images_only", ctypes.c_bool),
        ("depth_delay_off_color_usec", ctypes.c_int32),
        ("wired_sync_mode", ctypes.c_int32),
        ("subordinate_delay_off_master_usec", ctypes.c_uint32),
        ("disable_streaming_indicator", ctypes.c_bool),
    )


class TrackerConfiguration(ctypes.Structure):
    """k4abt_tracker_configuration_t of SDK 1.1: 24 bytes."""

    _fields_ = (
        ("sensor_orientation", ctypes.c_int32),
        ("processing_mode", ctypes.c_int32),
        ("gpu_device_id", ctypes.c_int32),
        ("model_path", ctypes.c_char_p),
    )


class ImuSample(ctypes.Structure):
    """k4a_imu_sample_t: 48 bytes."""

    _fields_ = (
        ("temperature", ctypes.c_float),
        ("acceleration", ctypes.c_float * 3),
        ("acceleration_time", ctypes.c_uint64),
        ("gyro", ctypes.c_float * 3),
        ("gyro_time", ctypes.c_uint64),
    )


def read_sensor_frame(data: bytes) -> SensorFrame:
    """Decode the bytes of a `Header` and its bodies.

    Raises:
        ValueError: the length differs from what the header states.
    """
    if len(data) < ctypes.sizeof(Header):
        raise ValueError(f"expected at least {ctypes.sizeof(Header)} bytes, got {len(data)}")
    header = Header.from_buffer_copy(data)
    size = ctypes.sizeof(Header) + min(header.bodies, MOST_BODIES) * ctypes.sizeof(AzureBody)
    if header.bodies > MOST_BODIES or len(data) != size:
        raise ValueError(f"expected {header.bodies} bodies, got {len(data)} bytes")
    bodies = np.frombuffer(data, np.dtype(AzureBody), offset=ctypes.sizeof(Header))
    return SensorFrame(
        time=header.time * 1e-6,
        bodies=[_body(body) for body in bodies if body["id"] != INVALID_ID],
        up=np.array(header.up, dtype=np.float64),
    )


def _body(body: np.void) -> SensorBody:
    joints = body["joints"]
    levels = joints["confidence"]
    return SensorBody(
        id=int(body["id"]),
        positions=joints["position"].astype(np.float64) * 1e-3,
        rotations=joints["orientation"][:, [1, 2, 3, 0]].astype(np.float64),
        confidence=np.where(levels > 3, 0.0, CONFIDENCE_OF_LEVEL[np.minimum(levels, 3)]),
    )


SENSOR = Sensor(KINECT_AZURE, AZURE_TO_WORLD, ("FootLeft", "FootRight"), read_sensor_frame)


@dataclass(frozen=True, slots=True)
class Setup:
    """Settings of camera and tracker; the fields are the options of the address.

    `model` is the file of the tracker's network; if it is empty, the tracker searches for it.
    """

    device: int = 0
    depth: str = "nfov"
    processing: str = "gpu"
    smoothing: float = 0.0
    model: str = ""


class KinectAzure:
    """An open camera and its body tracker.

    Args:
        camera: libk4a.
        tracker: libk4abt.
        setup: settings of both.

    Raises:
        InputError: the camera cannot be opened, or the tracker cannot be created.
    """

    def __init__(
        self, camera: ctypes.CDLL, tracker: ctypes.CDLL, setup: Setup | None = None
    ) -> None:
        self._k4a, self._k4abt = camera, tracker
        self._setup = setup or Setup()
        _declare(camera, tracker)
        self._device, self._tracker = ctypes.c_void_p(), ctypes.c_void_p()
        self._calibration = ctypes.create_string_buffer(_CALIBRATION_BYTES)
        self._closing = threading.Event()
        self._fresh = threading.Condition()
        self._newest: ctypes.c_void_p | None = None  # capture that waits for the tracker
        self._busy = False  # whether the tracker is processing a capture
        self._lost = ""
        self._captures = threading.Thread(target=self._capture, name="k4a", daemon=True)
        try:
            self._open()
        except InputError:
            self._shut()
            raise
        self._up = self._measure_up()
        self._captures.start()

    def _open(self) -> None:
        setup = self._setup
        where = f"cannot open kinect://azure: camera {setup.device}"
        depth, rate = DEPTH_MODES[setup.depth]
        if self._k4a.k4a_device_open(setup.device, ctypes.byref(self._device)):
            raise InputError(f"{where} does not answer; plug it in to USB 3 with enough power")
        configuration = DeviceConfiguration(depth_mode=depth, camera_fps=rate)
        if self._k4a.k4a_device_start_cameras(self._device, ctypes.byref(configuration)):
            raise InputError(f"{where} does not start; close other programs that use it")
        if self._k4a.k4a_device_get_calibration(self._device, depth, 0, self._calibration):
            raise InputError(f"{where} gives no calibration; update its firmware")
        tracker = TrackerConfiguration(
            processing_mode=PROCESSING[setup.processing], model_path=setup.model.encode() or None
        )
        if self._k4abt.k4abt_tracker_create(
            self._calibration, tracker, ctypes.byref(self._tracker)
        ):
            raise InputError(
                f"{where}: no body tracker on {setup.processing}; try ?processing=cpu, or give "
                "the tracker's network: ?model=dnn_model_2_0_op11.onnx"
            )
        self._k4abt.k4abt_tracker_set_temporal_smoothing(self._tracker, setup.smoothing)

    def _measure_up(self) -> NDArray[np.float64]:
        """The up direction (3,) in the depth camera's axes; zero if the camera gives none.

        An accelerometer at rest measures the reaction to gravity, which points up. A direction is
        converted by converting two points on it.
        """
        sample, readings = ImuSample(), []
        if self._k4a.k4a_device_start_imu(self._device):
            return np.zeros(3)
        for _ in range(_SAMPLES):
            if self._k4a.k4a_device_get_imu_sample(self._device, ctypes.byref(sample), WAIT_MS):
                break
            readings.append(list(sample.acceleration))
        self._k4a.k4a_device_stop_imu(self._device)
        mean = np.mean(readings, axis=0) if readings else np.zeros(3)
        foot, head = (self._from_accelerometer(point) for point in (np.zeros(3), mean))
        if abs(np.linalg.norm(mean) - _GRAVITY) > _AT_REST or foot is None or head is None:
            return np.zeros(3)
        return (head - foot) / _GRAVITY

    def _from_accelerometer(self, point: NDArray[np.float64]) -> NDArray[np.float64] | None:
        source, target = (ctypes.c_float * 3)(*point), (ctypes.c_float * 3)()
        failed = self._k4a.k4a_calibration_3d_to_3d(
            self._calibration, source, _ACCELERATION, _DEPTH, target
        )
        return None if failed else np.array(target, dtype=np.float64)

    def _capture(self) -> None:
        """Take captures on a thread of its own; the newest waits for the tracker."""
        silent = 0
        while not self._closing.is_set():
            capture = ctypes.c_void_p()
            result = self._k4a.k4a_device_get_capture(self._device, ctypes.byref(capture), WAIT_MS)
            silent = silent + 1 if result == _TIMEOUT else 0
            with self._fresh:
                if result == 0:
                    self._drop_newest()
                    self._newest = capture
                elif result != _TIMEOUT or silent > SILENT_WAITS:
                    self._lost = "the camera no longer answers; plug it in again"
                self._fresh.notify()
                if self._lost:
                    return

    def _drop_newest(self) -> None:
        if self._newest is not None:
            self._k4a.k4a_capture_release(self._newest)
            self._newest = None

    def _feed_tracker(self) -> None:
        """Give the newest capture to the tracker if it is idle."""
        with self._fresh:
            if not self._busy and self._newest is None:
                self._fresh.wait(WAIT_MS * 1e-3)
            if self._lost:
                raise SensorLostError(self._lost)
            if self._busy or self._newest is None:
                return
            self._busy = (
                self._k4abt.k4abt_tracker_enqueue_capture(self._tracker, self._newest, 0) == 0
            )
            self._drop_newest()

    def read(self) -> bytes | None:
        """Return the bytes of the tracker's next result, or None if none came in time."""
        self._feed_tracker()
        if not self._busy:
            return None
        frame = ctypes.c_void_p()
        result = self._k4abt.k4abt_tracker_pop_result(self._tracker, ctypes.byref(frame), WAIT_MS)
        if result == _TIMEOUT:
            return None
        self._busy = False
        if result:
            raise SensorLostError("the body tracker stopped; check its graphics driver")
        try:
            return self._bytes_of(frame)
        finally:
            self._k4abt.k4abt_frame_release(frame)

    def _bytes_of(self, frame: ctypes.c_void_p) -> bytes:
        bodies = []
        for index in range(min(self._k4abt.k4abt_frame_get_num_bodies(frame), MOST_BODIES)):
            body = AzureBody(id=self._k4abt.k4abt_frame_get_body_id(frame, index))
            joints = ctypes.byref(body, AzureBody.joints.offset)
            if not self._k4abt.k4abt_frame_get_body_skeleton(frame, index, joints):
                bodies.append(bytes(body))
        header = Header(
            time=self._k4abt.k4abt_frame_get_device_timestamp_usec(frame),
            bodies=len(bodies),
            up=tuple(self._up),
        )
        return bytes(header) + b"".join(bodies)

    def close(self) -> None:
        """Stop the camera and release camera and tracker."""
        self._closing.set()
        if self._captures.ident is not None:
            self._captures.join()
        self._shut()

    def _shut(self) -> None:
        self._drop_newest()
        if self._tracker:
            self._k4abt.k4abt_tracker_shutdown(self._tracker)
            self._k4abt.k4abt_tracker_destroy(self._tracker)
            self._tracker = ctypes.c_void_p()
        if self._device:
            self._k4a.k4a_device_stop_cameras(self._device)
            self._k4a.k4a_device_close(self._device)
            self._device = ctypes.c_void_p()


def _declare(camera: Any, tracker: Any) -> None:
    """Declare argument and result types; without them ctypes would cut handles to 32 bits."""
    handle, number, out = ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p
    for library, name, result, takes in (
        (camera, "k4a_device_open", number, [number, out]),
        (camera, "k4a_device_close", None, [handle]),
        (camera, "k4a_device_start_cameras", number, [handle, out]),
        (camera, "k4a_device_stop_cameras", None, [handle]),
        (camera, "k4a_device_start_imu", number, [handle]),
        (camera, "k4a_device_stop_imu", None, [handle]),
        (camera, "k4a_device_get_imu_sample", number, [handle, out, ctypes.c_int32]),
        (camera, "k4a_device_get_calibration", number, [handle, number, number, out]),
        (camera, "k4a_calibration_3d_to_3d", number, [out, out, number, number, out]),
        (camera, "k4a_device_get_capture", number, [handle, out, ctypes.c_int32]),
        (camera, "k4a_capture_release", None, [handle]),
        (tracker, "k4abt_tracker_create", number, [out, TrackerConfiguration, out]),
        (tracker, "k4abt_tracker_set_temporal_smoothing", None, [handle, ctypes.c_float]),
        (tracker, "k4abt_tracker_enqueue_capture", number, [handle, handle, ctypes.c_int32]),
        (tracker, "k4abt_tracker_pop_result", number, [handle, out, ctypes.c_int32]),
        (tracker, "k4abt_tracker_shutdown", None, [handle]),
        (tracker, "k4abt_tracker_destroy", None, [handle]),
        (tracker, "k4abt_frame_get_num_bodies", number, [handle]),
        (tracker, "k4abt_frame_get_body_id", number, [handle, number]),
        (tracker, "k4abt_frame_get_body_skeleton", number, [handle, number, out]),
        (tracker, "k4abt_frame_get_device_timestamp_usec", ctypes.c_uint64, [handle]),
        (tracker, "k4abt_frame_release", None, [handle]),
    ):
        function = getattr(library, name)
        function.restype, function.argtypes = result, takes
