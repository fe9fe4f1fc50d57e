"""Device ``mediapipe://HOST:PORT`` (landmarks from another program) and ``mediapipe://webcam``.

``mediapipe://127.0.0.1:7005`` needs nothing; `docs/devices-cameras.md` has a sender of twenty
lines. ``mediapipe://webcam?model=FILE.task`` runs MediaPipe on a webcam; it needs the extra and a
model file of MediaPipe's pose landmarker. Both use the same decoder.
"""

from __future__ import annotations

from pathlib import Path
from urllib.parse import SplitResult

from devices.address import host_and_port, one_of, options_of
from devices.errors import InputError
from devices.mediapipe.landmark_messages import USUAL_VIEW, LandmarkDecoder
from devices.mediapipe.webcam import Webcam
from devices.transport.live_stream import LiveStream
from devices.transport.sdk_library import SensorTransport
from devices.transport.udp import UdpTransport

PORT = 7005
WEBCAM = "webcam"


def open_device(address: SplitResult) -> LiveStream:
    """Open ``mediapipe://HOST:PORT?hands=on&view=60`` or ``mediapipe://webcam?model=FILE.task``.

    Raises:
        InputError: the address is wrong, the port is taken, the extra is not installed, or there
            is no such model file or camera.
    """
    readers = {"hands": one_of("on", "off"), "view": _view}
    if address.netloc == WEBCAM:
        options = options_of(address, readers | {"model": Path, "camera": _camera})
        if "model" not in options:
            raise InputError(
                f"cannot open {address.geturl()!r}: MediaPipe has no built-in models; give the "
                "file of a pose landmarker: mediapipe://webcam?model=FILE.task"
            )
        model, camera = options["model"], options.get("camera", 0)
        return LiveStream(
            SensorTransport(lambda: Webcam(model, camera)),
            lambda: LandmarkDecoder(view=options.get("view", USUAL_VIEW)),
        )
    host, port = host_and_port(address, PORT)
    options = options_of(address, readers)
    return LiveStream(
        UdpTransport(host, port, scheme=address.scheme),
        lambda: LandmarkDecoder(
            hands=options.get("hands") == "on", view=options.get("view", USUAL_VIEW)
        ),
    )


def _view(text: str) -> float:
    value = float(text) if text.replace(".", "", 1).isdecimal() else 0.0
    if not 10.0 <= value <= 170.0:
        raise ValueError("expected degrees from 10 to 170")
    return value


def _camera(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 4):
        raise ValueError("expected a camera's number from 0")
    return int(text)
