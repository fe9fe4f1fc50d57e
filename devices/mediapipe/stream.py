"""Device ``mediapipe://HOST:PORT``: landmarks from another program.

It needs nothing; `docs/devices-cameras.md` has a sender of twenty lines. A webcam of this machine
is `devices/webcam/`.
"""

from __future__ import annotations

from urllib.parse import SplitResult

from devices.address import host_and_port, one_of, options_of
from devices.errors import InputError
from devices.mediapipe.landmark_messages import USUAL_VIEW, LandmarkDecoder
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport

PORT = 7005
WEBCAM = "webcam"


def open_device(address: SplitResult) -> LiveStream:
    """Open ``mediapipe://HOST:PORT?hands=on&view=60``.

    Raises:
        InputError: the address is wrong, or the port is taken.
    """
    if address.netloc == WEBCAM:
        raise InputError(f"cannot open {address.geturl()!r}: a webcam is webcam://0")
    options = options_of(address, {"hands": one_of("on", "off"), "view": view_angle})
    host, port = host_and_port(address, PORT)
    return LiveStream(
        UdpTransport(host, port, scheme=address.scheme),
        lambda: LandmarkDecoder(
            hands=options.get("hands") == "on", view=options.get("view", USUAL_VIEW)
        ),
    )


def view_angle(text: str) -> float:
    """Parse a camera's horizontal field of view [degrees].

    Raises:
        ValueError: the text is no number from 10 to 170.
    """
    value = float(text) if text.replace(".", "", 1).isdecimal() else 0.0
    if not 10.0 <= value <= 170.0:
        raise ValueError("expected degrees from 10 to 170")
    return value
