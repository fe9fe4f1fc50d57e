"""Device ``leap+ws://127.0.0.1:6437``: the Leap Motion's WebSocket.

The Orion service answers at this port, or `UltraleapTrackingWebSocket` beside newer services. A
stopped service is tried again twice a second; the settings are then sent again, since the service
does not remember them. A service that closes with code 1001 before its first message does not
support the requested protocol version: the next lower version is requested then, and after the
lowest the newest again.
Source: leapjs, lib/connection/base.js.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from socket import create_connection
from typing import Any
from urllib.parse import SplitResult

from devices.address import host_and_port, one_of, options_of
from devices.errors import InputError
from devices.leap.performer import BOTH
from devices.leap.websocket_messages import MOST_BYTES, LeapDecoder
from devices.transport.live_stream import Deliver, LiveStream

PORT = 6437
NEWEST = 6
RETRY = 0.5  # [s]
PATIENCE = 3.0  # [s] for an answer
LOOK = 0.1  # [s] between checks whether the reader is closed
GOING_AWAY = 1001
SETTINGS = ({"background": True}, {"focused": True}, {"optimizeHMD": False})


class LeapWebSocket:
    """A connection that reconnects by itself.

    Args:
        host, port: where the service answers.
        devices: returns one line on a fault of the service's devices, or an empty one.

    Attributes:
        dropped: always 0; messages that the service skips are not counted.
        version: of the protocol that is requested.

    Raises:
        InputError: the WebSocket library is not installed.
    """

    dropped = 0

    def __init__(self, host: str, port: int, devices: Callable[[], str] = str) -> None:
        try:
            import websockets.sync.client  # noqa: F401, PLC0415  # an optional extra, checked before the show
        except ImportError:
            raise InputError("leap+ws:// needs the extra: pip install 'bunraku[leap]'") from None
        self.version = NEWEST
        self._address = host, port
        self._where = f"{'[' + host + ']' if ':' in host else host}:{port}"
        self._devices = devices
        self._connection_trouble = ""
        self._closing = threading.Event()

    @property
    def trouble(self) -> str:
        """One line that explains why no frames come now, or an empty one."""
        return self._connection_trouble or self._devices()

    def run(self, deliver: Deliver) -> None:
        """Deliver every message until closed, over successive connections."""
        while not self._closing.is_set():
            self._connect(deliver)
            self._closing.wait(RETRY)

    def close(self) -> None:
        """Make `run` return soon; may be called twice."""
        self._closing.set()

    def _connect(self, deliver: Deliver) -> None:
        from websockets.exceptions import ConnectionClosed, WebSocketException  # noqa: PLC0415  # an optional extra
        from websockets.sync.client import connect  # noqa: PLC0415  # an optional extra

        url = f"ws://{self._where}/v{self.version}.json"
        verified = False
        try:
            # On a socket of our own the library follows no redirect to another host.
            socket = create_connection(self._address, timeout=PATIENCE)
            with connect(
                url,
                sock=socket,
                open_timeout=PATIENCE,
                close_timeout=LOOK,
                max_size=MOST_BYTES,
                proxy=None,
            ) as connection:
                for data in self._messages(connection):
                    if not verified:
                        self._ask(connection)
                        verified = True
                    deliver(data, time.perf_counter(), "")
        except ConnectionClosed as error:
            code = error.rcvd.code if error.rcvd else None
            if code == GOING_AWAY and not verified:
                self.version = self.version - 1 or NEWEST
            self._connection_trouble = f"{url} closed the connection ({code}); trying again"
        except (OSError, ValueError, WebSocketException) as error:
            # ValueError: an answer that the library cannot take apart, such as a broken address.
            self._connection_trouble = (
                f"no answer at {url} ({_short(error)}); start the Ultraleap service, or "
                "UltraleapTrackingWebSocket beside a service that is newer than Orion"
            )

    def _messages(self, connection: Any) -> Iterator[bytes]:
        while not self._closing.is_set():
            try:
                message = connection.recv(timeout=LOOK)
            except TimeoutError:
                continue
            yield message.encode() if isinstance(message, str) else message

    def _ask(self, connection: Any) -> None:
        self._connection_trouble = ""
        for setting in SETTINGS:
            connection.send(json.dumps(setting))


def _short(error: Exception) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 80 else text[:77] + "..."


def open_device(address: SplitResult) -> LiveStream:
    """Open ``leap+ws://HOST:PORT?hands=both``; `hands` may also be "left" or "right".

    Raises:
        InputError: the address is wrong, or the WebSocket library is not installed.
    """
    host, port = host_and_port(address, PORT)
    options = options_of(address, {"hands": one_of(BOTH, "left", "right")})
    decoder = LeapDecoder(options.get("hands", BOTH))
    return LiveStream(LeapWebSocket(host, port, lambda: decoder.trouble), lambda: decoder)
