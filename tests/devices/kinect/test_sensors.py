"""Kinect and Leap sensors through stand-ins for the makers' libraries; addresses."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from devices.kinect import azure as kinect_azure
from devices.kinect import v1 as kinect_v1
from devices.kinect import v2 as kinect_v2
from devices.kinect.azure import KinectAzure, Setup
from devices.kinect.bodies import KinectDecoder
from devices.kinect.v1 import KinectV1
from devices.kinect.v2 import KinectV2
from devices.leap import sdk as leap_sdk
from devices.leap.joints import SIDES, leap_to_world
from devices.leap.sdk import LeapC, LeapCDecoder
from devices.stream import open_stream
from devices.transport import sdk_library
from devices.transport.live_stream import LiveStream
from devices.transport.sdk_library import SensorSource, SensorTransport
from devices.transport.senders import Decoder
from tests.waiting import frames_of, until

FAKE = Path(__file__).with_name("fake_sensors.c")


@pytest.fixture(scope="module")
def fake(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """A library with the makers' functions, compiled from their documented interfaces."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("needs a C compiler to make the stand-ins for the makers' libraries")
    built = tmp_path_factory.mktemp("fake") / "fake_sensors.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", str(built), str(FAKE)], check=True)
    return ctypes.CDLL(str(built))


def watch(source: Callable[[], SensorSource], decoder: Callable[[], Decoder]) -> LiveStream:
    return LiveStream(SensorTransport(source), decoder)


# -- whole way, through libraries with the makers' functions --------------------------------------


def test_v1_is_opened_read_and_given_back(fake: ctypes.CDLL) -> None:
    fake.fake_reset(5)
    decoder = KinectDecoder(kinect_v1.SENSOR)
    with watch(lambda: KinectV1(fake), lambda: decoder) as stream:
        frames = frames_of(stream, 5)
    for step, frame in enumerate(frames, 1):
        np.testing.assert_allclose(frame.positions[5], [-0.01 * step, 1.0, -2.0], atol=1e-6)
        assert np.isnan(frame.positions[6]).all()
        assert frame.confidence[4] == 0.5
        assert frame.rotations is not None
        assert np.isnan(frame.rotations[0]).all()
        np.testing.assert_allclose(np.abs(frame.rotations[1]), [0, 1, 0, 0], atol=1e-6)
    assert fake.fake_closed() == fake.fake_opened() == 1


def test_v2_is_opened_read_and_given_back(fake: ctypes.CDLL) -> None:
    fake.fake_reset(5)
    decoder = KinectDecoder(kinect_v2.SENSOR)
    with watch(lambda: KinectV2(fake), lambda: decoder) as stream:
        frames = frames_of(stream, 5)
    for step, frame in enumerate(frames, 1):
        height = 0.8 * (0.05 * 5 - 0.3) + 0.6 * 2.0 + 1.5  # the plane's own equation
        assert frame.positions[5, 1] == pytest.approx(height, abs=1e-6)
        assert frame.positions[5, 0] == pytest.approx(-0.01 * step, abs=1e-6)
        assert frame.rotations is not None
        assert np.isnan(frame.rotations[3]).all()
        assert np.isfinite(frame.rotations[4]).all()
    assert fake.fake_closed() == fake.fake_opened()  # every interface was released


def test_azure_is_opened_read_and_given_back_and_no_queue_builds_up(fake: ctypes.CDLL) -> None:
    fake.fake_reset(200)
    decoder = KinectDecoder(kinect_azure.SENSOR)
    setup = Setup(processing="cpu", smoothing=0.2)
    with watch(lambda: KinectAzure(fake, fake, setup), lambda: decoder) as stream:
        frames = frames_of(stream, 20)
    assert fake.fake_most_waiting() == 1
    assert fake.fake_closed() == fake.fake_opened()  # captures and results, too
    for frame in frames:
        assert frame.positions[5, 1] == pytest.approx(-0.4 + 1.0, abs=1e-6)
        assert frame.positions[5, 2] == pytest.approx(-2.0)
        assert 0.0 < frame.positions[5, 0] - frame.performer <= 0.01 * 200 + 1e-6
    assert {frame.performer for frame in frames} == {0, 1}


def test_leapc_is_opened_read_and_given_back(fake: ctypes.CDLL) -> None:
    fake.fake_reset(5)
    with watch(lambda: LeapC(fake), LeapCDecoder) as stream:
        frames = frames_of(stream, 5)
        skeleton = stream.skeleton
    for step, frame in enumerate(frames, 1):
        for side, x in (("right", 80.0 + 10 * step), ("left", -80.0 + 10 * step)):
            place = frame.positions[skeleton.index(f"{side}_palm")]
            np.testing.assert_allclose(place, leap_to_world([x, 200, 50]), atol=1e-6)
            tip = frame.positions[skeleton.index(f"{side}_pinky_tip")]
            np.testing.assert_allclose(tip, leap_to_world([x + 40, 200, -55]), atol=1e-6)
    assert frames[0].rotations is not None
    turned = np.isfinite(frames[0].rotations).all(axis=1)
    without = {"hands", *(f"{side}_{joint}" for side in SIDES for joint in ("elbow", "wrist"))}
    assert {skeleton.names[joint] for joint in np.flatnonzero(~turned)} == without
    assert (frames[0].confidence == 0.5).all()
    assert frames[-1].time - frames[0].time <= 4 * 0.009 + 1e-6
    assert fake.fake_closed() == fake.fake_opened() == 1


@pytest.mark.parametrize("kind", ["v1", "azure", "leap"])
def test_a_sensor_that_is_unplugged_comes_back(
    kind: str, fake: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sdk_library, "RETRY", 0.01)
    sources: dict[str, Callable[[], SensorSource]] = {
        "v1": lambda: KinectV1(fake),
        "azure": lambda: KinectAzure(fake, fake, Setup(processing="cpu")),
        "leap": lambda: LeapC(fake),
    }
    decoders: dict[str, Callable[[], Decoder]] = {
        "v1": lambda: KinectDecoder(kinect_v1.SENSOR),
        "azure": lambda: KinectDecoder(kinect_azure.SENSOR),
        "leap": LeapCDecoder,
    }
    fake.fake_reset(1_000_000)
    with watch(sources[kind], decoders[kind]) as stream:
        frames_of(stream, 2)
        fake.fake_plug(0)
        until(lambda: bool(stream.traffic.trouble))
        assert "\n" not in stream.traffic.trouble
        stream.poll()
        fake.fake_plug(1)
        frames_of(stream, 2)
        until(lambda: not stream.traffic.trouble)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (KinectV1, "kinect://v1: no sensor answers"),
        (KinectV2, "kinect://v2: no sensor answers"),
        (lambda fake: KinectAzure(fake, fake), "kinect://azure: camera 0 does not answer"),
    ],
)
def test_a_sensor_that_is_not_there_is_said_in_one_line(
    make: Callable[[ctypes.CDLL], SensorSource], says: str, fake: ctypes.CDLL
) -> None:
    fake.fake_reset(1)
    fake.fake_plug(0)
    with pytest.raises(InputError, match=says) as caught:
        make(fake)
    assert "\n" not in str(caught.value)


def test_a_tracker_that_cannot_be_made_gives_the_camera_back(fake: ctypes.CDLL) -> None:
    fake.fake_reset(1)
    with pytest.raises(InputError, match="processing=cpu"):
        KinectAzure(fake, fake, Setup(processing="cuda"))
    assert fake.fake_closed() == fake.fake_opened() == 1


# -- addresses ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("kinect://v1", "Kinect10.dll"),
        ("kinect://v2", "Kinect20.dll"),
        ("kinect://azure?processing=cpu&smoothing=0.5&device=1&depth=wfov", "k4a is missing"),
        ("leap://", r"leap\+ws://"),
        ("kinect://v3", "kinect://v1, kinect://v2, kinect://azure"),
        ("kinect://azure?processing=abacus", "gpu or cpu"),
        ("kinect://azure?smoothing=2", "from 0 to 1"),
        ("kinect://v2?seated=on", "'seated' is unknown"),
        ("kinect://v1?floor=carpet", "level or camera"),
        ("leap://192.168.0.2", "leap\\+ws://HOST:PORT"),
        ("leap://?mode=hat", "desktop or screentop"),
    ],
)
def test_an_address_that_cannot_be_opened_is_one_clear_line(url: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        open_stream(url)
    assert "\n" not in str(caught.value)


@pytest.fixture(autouse=True)
def _no_makers_library(monkeypatch: pytest.MonkeyPatch) -> None:
    """Should a maker's library be installed where the tests run, they must not open it."""
    for module in (kinect_v1, kinect_v2, kinect_azure, leap_sdk):
        monkeypatch.setattr(module, "LIBRARIES", ("no-such-library",))


@pytest.mark.parametrize(("found", "flags"), [(True, [8]), (False, [])])
def test_on_windows_a_library_s_own_needs_may_lie_beside_it(
    found: bool, flags: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[tuple[str, list[int]]] = []
    where = str(tmp_path / "k4a.dll") if found else None

    def windows(name: str, **more: int) -> object:
        loaded.append((name, list(more.values())))
        return fake

    monkeypatch.setattr("ctypes.WinDLL", windows, raising=False)
    monkeypatch.setattr("ctypes.util.find_library", lambda _name: where)
    assert sdk_library.load_library(["k4a.dll"], "missing") is fake
    assert loaded == [(where or "k4a.dll", flags)]
