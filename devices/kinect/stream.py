"""Device ``kinect://v1``, ``kinect://v2`` and ``kinect://azure``.

Each needs its maker's library on this machine; Azure's also opens Orbbec's Femto cameras. The
sensor's floor plane or accelerometer levels the frames; ``?floor=camera`` keeps camera axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult

from devices.address import one_of, options_of
from devices.errors import InputError
from devices.kinect import azure as kinect_azure
from devices.kinect import v1 as kinect_v1
from devices.kinect import v2 as kinect_v2
from devices.kinect.azure import KinectAzure
from devices.kinect.bodies import KinectDecoder, Sensor
from devices.kinect.v1 import KinectV1
from devices.kinect.v2 import KinectV2
from devices.transport.live_stream import LiveStream
from devices.transport.sdk_library import SensorSource, SensorTransport, load_library

Options = dict[str, Any]

FLOOR = {"floor": one_of("level", "camera")}


def open_device(address: SplitResult) -> LiveStream:
    """Open ``kinect://v1?seated=on``, ``kinect://v2`` or ``kinect://azure?processing=cpu``.

    Raises:
        InputError: there is no such Kinect, an option is unknown, the library is not installed, or
            no sensor answers.
    """
    kind = address.netloc
    if kind not in KINDS or address.path.strip("/"):
        known = ", ".join(f"kinect://{one}" for one in KINDS)
        raise InputError(f"cannot open {address.geturl()!r}: no such Kinect; known: {known}")
    sensor, known_options, open_sensor = KINDS[kind]
    options = options_of(address, FLOOR | known_options)
    level = options.pop("floor", "level") == "level"
    transport = SensorTransport(lambda: open_sensor(options))
    return LiveStream(transport, lambda: KinectDecoder(sensor, level=level))


def _open_v1(options: Options) -> SensorSource:
    library = load_library(kinect_v1.LIBRARIES, kinect_v1.MISSING)
    return KinectV1(library, seated=options.get("seated") == "on")


def _open_v2(_options: Options) -> SensorSource:
    return KinectV2(load_library(kinect_v2.LIBRARIES, kinect_v2.MISSING))


def _open_azure(options: Options) -> SensorSource:
    camera = load_library(kinect_azure.LIBRARIES, kinect_azure.MISSING.format("k4a"))
    tracker = load_library(kinect_azure.TRACKER_LIBRARIES, kinect_azure.MISSING.format("k4abt"))
    return KinectAzure(camera, tracker, kinect_azure.Setup(**options))


def _share(text: str) -> float:
    value = float(text) if text.replace(".", "", 1).isdigit() else math.nan
    if not 0.0 <= value <= 1.0:
        raise ValueError("expected a number from 0 to 1")
    return value


def _file(text: str) -> str:
    if not Path(text).is_file():
        raise ValueError("expected an existing file")
    return text


def _index(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 4):
        raise ValueError("expected a number from 0")
    return int(text)


KINDS: Mapping[
    str, tuple[Sensor, dict[str, Callable[[str], Any]], Callable[[Options], SensorSource]]
] = {
    "v1": (kinect_v1.SENSOR, {"seated": one_of("on", "off")}, _open_v1),
    "v2": (kinect_v2.SENSOR, {}, _open_v2),
    "azure": (
        kinect_azure.SENSOR,
        {
            "device": _index,
            "depth": one_of(*kinect_azure.DEPTH_MODES),
            "processing": one_of(*kinect_azure.PROCESSING),
            "smoothing": _share,
            "model": _file,
        },
        _open_azure,
    ),
}
