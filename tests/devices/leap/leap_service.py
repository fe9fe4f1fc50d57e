"""A Leap service on loopback, and a stream that is opened on it."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest

from devices.leap.websocket import open_device
from devices.transport.live_stream import LiveStream
from tests.waiting import PATIENCE


class Service:
    """A Leap service as its clients see it: paths asked for, settings sent, what it answers."""

    def __init__(self, serve: Callable[[Service, Any], None]) -> None:
        self.paths: list[str] = []
        self.settings: list[dict[str, Any]] = []
        self.released = threading.Event()
        self._serve = serve

    def __call__(self, connection: Any) -> None:
        self.paths.append(urlsplit(connection.request.path).path)
        self._serve(self, connection)

    def greet(self, connection: Any, header: dict[str, Any], settings: int = 3) -> None:
        connection.send(json.dumps(header))
        for _ in range(settings):
            self.settings.append(json.loads(connection.recv(timeout=PATIENCE)))


@contextmanager
def serving(serve: Callable[[Service, Any], None], port: int = 0) -> Iterator[tuple[Service, int]]:
    server_module = pytest.importorskip("websockets.sync.server", reason="needs the extra leap")
    service = Service(serve)
    server = server_module.serve(service, "127.0.0.1", port)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield service, server.socket.getsockname()[1]
    finally:
        service.released.set()
        server.shutdown()
        thread.join(PATIENCE)


def opened(port: int, options: str = "") -> LiveStream:
    return open_device(urlsplit(f"leap+ws://127.0.0.1:{port}{options}"))
