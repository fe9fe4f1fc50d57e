"""Kinect frames as bytes: layouts, bodies, numbers, the floor, and hostile bytes."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.camera_level import CameraLevel
from devices.bodies.performer_numbers import PerformerNumbers
from devices.kinect import azure as kinect_azure
from devices.kinect import v1 as kinect_v1
from devices.kinect import v2 as kinect_v2
from devices.kinect.bodies import KinectDecoder, Sensor
from devices.kinect.joints import KINECT_AZURE, KINECT_V1, KINECT_V2
from devices.leap import sdk as leap_sdk
from runtime.benchmarks.fuzzing.kinect_packets import azure_packet, v1_packet, v2_packet

SENSORS = (kinect_v1.SENSOR, kinect_v2.SENSOR, kinect_azure.SENSOR)


# -- layouts --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("layout", "size"),
    [
        (kinect_v1.SkeletonData, 436),
        (kinect_v1.NuiSkeletonFrame, 2664),
        (kinect_v1.BoneOrientation, 168),
        (kinect_v2.Joint, 20),
        (kinect_v2.JointOrientation, 20),
        (kinect_azure.AzureJoint, 32),
        (kinect_azure.AzureBody, 1028),
        (kinect_azure.DeviceConfiguration, 36),
        (kinect_azure.TrackerConfiguration, 24),
        (kinect_azure.ImuSample, 48),
        (leap_sdk.Bone, 44),
        (leap_sdk.Digit, 184),
        (leap_sdk.Palm, 80),
        (leap_sdk.LeapHand, 1084),
        (leap_sdk.TrackingEvent, 48),
        (leap_sdk.Message, 20),
    ],
)
def test_structures_have_the_sizes_that_the_makers_state(
    layout: type[ctypes.Structure], size: int
) -> None:
    assert ctypes.sizeof(layout) == size


PACKETS = {
    "v1": (kinect_v1.SENSOR, v1_packet({2: (2, 7, (0.5, 0.25, 2.0))}, (0, 1, 0, 0.75))),
    "v2": (kinect_v2.SENSOR, v2_packet({5: (7, (0.5, 0.25, 2.0))}, (0, 1, 0, 0.75))),
    "azure": (kinect_azure.SENSOR, azure_packet({7: (-500.0, -250.0, 2000.0)}, (0, -1, 0))),
}


@pytest.mark.parametrize("kind", PACKETS)
def test_a_body_stands_in_the_world_as_it_stood_before_the_camera(kind: str) -> None:
    sensor, packet = PACKETS[kind]
    (frame,) = KinectDecoder(sensor, level=False).feed(packet, 100.0)
    seen = frame.confidence > 0
    np.testing.assert_allclose(frame.positions[seen], [[-0.5, 0.25, -2.0]] * seen.sum(), atol=1e-6)
    assert np.isnan(frame.positions[~seen]).all()
    levels = [0.0, 0.5, 1.0, 1.0] if kind == "azure" else [0.0, 0.5, 1.0]
    expected = [levels[joint % len(levels)] for joint in range(len(frame.confidence))]
    np.testing.assert_array_equal(frame.confidence, expected)
    assert (frame.performer, frame.time, frame.arrival) == (0, 100.0, 100.0)


@pytest.mark.parametrize("kind", PACKETS)
def test_a_zero_quaternion_is_no_turn_and_others_turn_with_the_axes(kind: str) -> None:
    sensor, packet = PACKETS[kind]
    (frame,) = KinectDecoder(sensor, level=False).feed(packet, 100.0)
    assert frame.rotations is not None
    assert np.isnan(frame.rotations[0]).all()
    camera = Rotation.from_rotvec([0, 0, 0.6]).as_matrix()
    found = Rotation.from_quat(frame.rotations[1:]).as_matrix()
    np.testing.assert_allclose(found, [sensor.to_world @ camera] * len(found), atol=1e-6)


def test_the_skeletons_are_the_three_sets_of_joints() -> None:
    assert [len(sensor.skeleton.names) for sensor in SENSORS] == [20, 25, 32]
    assert [s.skeleton for s in SENSORS] == [KINECT_V1, KINECT_V2, KINECT_AZURE]
    for sensor in SENSORS:
        assert np.linalg.det(sensor.to_world) == pytest.approx(1.0)


def test_slots_are_no_identities() -> None:
    decoder = KinectDecoder(kinect_v2.SENSOR)
    near, far = (0.0, 0.0, 2.0), (1.5, 0.0, 2.5)
    floor = (0, 1, 0, 1)
    first = decoder.feed(v2_packet({0: (11, near), 1: (22, far)}, floor), 0.0)
    moved = decoder.feed(v2_packet({4: (11, near), 0: (22, far)}, floor), 0.1)
    for frames in (first, moved):
        assert [frame.performer for frame in frames] == [0, 1]
        assert frames[0].positions[1, 0] == pytest.approx(0.0)
        assert frames[1].positions[1, 0] == pytest.approx(-1.5)


def test_who_comes_back_with_another_id_has_the_same_number() -> None:
    numbers = PerformerNumbers()
    here, there = np.array([0.0, 1.0, -2.0]), np.array([1.5, 1.0, -2.0])
    assert numbers({11: here, 22: there}) == {11: 0, 22: 1}
    assert numbers({}) == {}
    assert numbers({33: there + 0.1}) == {33: 1}
    assert numbers({33: there, 44: here}) == {33: 1, 44: 0}
    assert numbers({33: there, 44: here, 55: np.full(3, np.nan)}) == {33: 1, 44: 0, 55: 2}


def test_numbers_stay_small_however_many_ids_come() -> None:
    numbers = PerformerNumbers()
    rng = np.random.default_rng(3)
    for body in range(2000):
        assert (
            max(numbers({body: rng.normal(size=3), body + 10_000: rng.normal(size=3)}).values()) < 2
        )


def test_people_of_whom_only_the_place_is_known_are_left_out() -> None:
    packet = v1_packet({0: (1, 3, (0, 0, 1.0)), 1: (2, 4, (0, 0, 2.0))}, (0, 0, 0, 0))
    frames = KinectDecoder(kinect_v1.SENSOR).feed(packet, 0.0)
    assert len(frames) == 1
    assert np.nanmax(frames[0].positions[:, 2]) == pytest.approx(-2.0)


def test_an_invalid_azure_id_is_nobody() -> None:
    packet = azure_packet({0xFFFFFFFF: (0, 0, 1000.0)}, (0, -1, 0))
    assert KinectDecoder(kinect_azure.SENSOR).feed(packet, 0.0) == []


# -- the floor ------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [-30.0, 0.0, 25.0])
def test_a_tilted_camera_s_view_is_levelled_with_the_floor_at_zero(degrees: float) -> None:
    """A point whose height above the floor is known, seen by a camera that looks up or down."""
    tilt = Rotation.from_euler("x", degrees, degrees=True).as_matrix()  # world to camera
    up = tilt @ [0.0, 1.0, 0.0]
    point = tilt @ (np.array([0.3, 0.9, 2.0]) - [0.0, 1.2, 0.0])  # 0.9 m high; the camera at 1.2
    packet = v2_packet({1: (5, tuple(point))}, (*up, 1.2))
    (frame,) = KinectDecoder(kinect_v2.SENSOR).feed(packet, 0.0)
    np.testing.assert_allclose(frame.positions[1], [-0.3, 0.9, -2.0], atol=1e-6)
    assert frame.rotations is not None
    seen = Rotation.from_quat(frame.rotations[1]).as_matrix()
    level = kinect_v2.SENSOR.to_world @ tilt.T @ Rotation.from_rotvec([0, 0, 0.6]).as_matrix()
    np.testing.assert_allclose(seen, level, atol=1e-6)


def test_an_accelerometer_levels_and_feet_find_the_floor() -> None:
    tilt = Rotation.from_euler("x", 20.0, degrees=True).as_matrix()
    up = tilt @ [0.0, -1.0, 0.0]  # camera axes have y down
    foot = tilt @ [0.0, 800.0, 2000.0]  # 0.8 m below the camera
    packet = azure_packet({3: tuple(foot)}, up)
    table = bytearray(packet)
    for joint in (21, 25):  # the feet, tracked as well as this SDK ever says
        struct.pack_into("<I", table, 24 + 4 + 32 * joint + 28, 2)
    decoder = KinectDecoder(kinect_azure.SENSOR)
    (frame,) = decoder.feed(bytes(table), 0.0)
    np.testing.assert_allclose(frame.positions[21], [0.0, 0.0, -2.0], atol=1e-6)


def test_the_level_is_steady_and_follows_a_camera_that_is_moved() -> None:
    level, rng = CameraLevel(), np.random.default_rng(2)
    for _ in range(300):
        noisy = np.array([0.0, 1.0, 0.0]) + rng.normal(scale=0.02, size=3)
        level.learn(noisy / np.linalg.norm(noisy), 1.0 + rng.normal(scale=0.02))
    assert np.degrees(np.arccos(level.turn[1, 1])) < 0.5
    assert level.height == pytest.approx(1.0, abs=0.01)
    for _ in range(600):
        level.learn(np.array([0.0, 0.8, 0.6]), 1.5)
    np.testing.assert_allclose(level.turn @ [0.0, 0.8, 0.6], [0.0, 1.0, 0.0], atol=1e-3)
    assert level.height == pytest.approx(1.5, abs=1e-3)


@pytest.mark.parametrize(
    "up", [(0, 0, 0), (np.nan, 1, 0), (1, 0, 0), (0, -1, 0), (0, np.inf, 0), (0, 50, 0)]
)
def test_what_cannot_be_a_floor_is_passed_over(up: Sequence[float]) -> None:
    level = CameraLevel()
    level.learn(np.array(up, dtype=float), 1.3)
    np.testing.assert_array_equal(level.turn, np.eye(3))
    assert level.height == 1.0


# -- hostile bytes --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", PACKETS)
def test_what_is_no_frame_is_refused_and_counted(kind: str) -> None:
    sensor, packet = PACKETS[kind]
    decoder = KinectDecoder(sensor)
    for data in (b"", b"\0", packet[:-1], packet + b"\0", bytes(100_000)):
        assert decoder.feed(data, 0.0) == []
    assert decoder.refused == 5
    assert len(decoder.feed(packet, 0.0)) == 1


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 3e38, 1e-42])
def test_numbers_that_say_nothing_are_unseen(sensor: Sensor, value: float) -> None:
    packet = next(packet for one, packet in PACKETS.values() if one is sensor)
    floats = np.frombuffer(bytearray(packet), np.float32)
    head = 6 if sensor is kinect_azure.SENSOR else 12
    ids = floats.view(np.uint32).copy()
    damaged = np.where((np.abs(floats) > 1e-3) & (np.arange(len(floats)) >= head), value, floats)
    damaged = np.where(ids < 100, floats, damaged).astype(np.float32)
    for frame in KinectDecoder(sensor).feed(damaged.tobytes(), 1.0):
        seen = frame.confidence > 0
        assert np.isfinite(frame.positions[seen]).all()
        assert np.isnan(frame.positions[~seen]).all()


def test_a_device_clock_that_jumps_back_never_makes_a_frame_later_than_its_arrival() -> None:
    decoder = KinectDecoder(kinect_azure.SENSOR)
    packet = bytearray(azure_packet({1: (0, 0, 1000.0)}, (0, -1, 0)))
    for arrival, stamp in enumerate((10_000_000, 11_000_000, 5, 1_000_005, 2**63, 2**64 - 1)):
        struct.pack_into("<Q", packet, 0, stamp)
        (frame,) = decoder.feed(bytes(packet), float(arrival))
        assert arrival - 1.5 <= frame.time <= arrival
