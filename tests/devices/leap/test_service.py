"""A Leap service that starts late, goes away, or sends what is no message."""

from __future__ import annotations

import json
import socket
import sys
import threading
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from devices.errors import InputError
from devices.leap import websocket as leap_websocket
from devices.stream import open_stream
from tests.devices.leap.leap_messages import HEADER, HOSTILE, both, device_event
from tests.devices.leap.leap_service import Service, opened, serving
from tests.waiting import PATIENCE, frames_of, until


def listening() -> socket.socket:
    return socket.create_server(("127.0.0.1", 0))


@pytest.fixture(autouse=True)
def _try_again_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leap_websocket, "RETRY", 0.02)


def test_frames_come_from_a_service_that_is_asked_for_them() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(device_event(True, True).decode())
        for index in range(20):
            connection.send(json.dumps(both(index)))
        service.released.wait(PATIENCE)

    with serving(serve) as (service, port), opened(port) as stream:
        frames = frames_of(stream, 20)
        assert len(frames) == 20
        assert stream.traffic.packets == 22
        assert stream.traffic.refused == 0
        assert stream.traffic.trouble == ""
    assert service.paths == ["/v6.json"]
    assert service.settings == [{"background": True}, {"focused": True}, {"optimizeHMD": False}]
    gaps = np.diff([frame.time for frame in frames])
    assert gaps.min() >= 0.0


def test_a_service_that_goes_away_is_found_again_and_told_everything_again() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(json.dumps(both(len(service.paths))))
        if len(service.paths) < 3:
            connection.close(1001)
        else:
            service.released.wait(PATIENCE)

    with serving(serve) as (service, port), opened(port) as stream:
        frames_of(stream, 3)
    assert service.paths == ["/v6.json"] * 3  # 1001 after frames is no matter of the version
    assert len(service.settings) == 9


def test_a_service_that_does_not_know_the_version_is_asked_for_a_lower_one() -> None:
    def serve(service: Service, connection: Any) -> None:
        if service.paths[-1] != "/v4.json":
            connection.close(1001)
            return
        service.greet(connection, {"version": 3})
        connection.send(json.dumps(both(0)))
        service.released.wait(PATIENCE)

    with serving(serve) as (service, port), opened(port) as stream:
        frames_of(stream, 1)
    assert service.paths == ["/v6.json", "/v5.json", "/v4.json"]


def test_a_service_that_starts_later_is_found() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(json.dumps(both(0)))
        service.released.wait(PATIENCE)

    with serving(serve) as (_, port):
        pass  # a port that was free a moment ago, and is again
    with opened(port) as stream:
        until(lambda: "no answer" in stream.traffic.trouble)
        assert "\n" not in stream.traffic.trouble
        with serving(serve, port):
            frames_of(stream, 1)
            assert stream.traffic.trouble == ""


def test_hostile_messages_and_a_device_that_is_unplugged_leave_the_stream_running() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        for data in HOSTILE:
            if len(data) < 1 << 20:
                connection.send(data)
        connection.send(device_event(False, False).decode())
        connection.send(json.dumps(both(0)))
        service.released.wait(PATIENCE)

    with serving(serve) as (_, port), opened(port) as stream:
        frames_of(stream, 1)
        assert stream.traffic.trouble == "the Leap is not plugged in; plug it in"
        assert stream.traffic.refused == sum(len(data) < 1 << 20 for data in HOSTILE)


def test_a_message_beyond_all_bounds_ends_the_connection_not_the_stream() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(" " * (2 << 20) if len(service.paths) == 1 else json.dumps(both(0)))
        service.released.wait(PATIENCE if len(service.paths) > 1 else 0.2)

    with serving(serve) as (service, port), opened(port) as stream:
        frames_of(stream, 1)
    assert len(service.paths) == 2


@pytest.mark.parametrize(
    "answer",
    [
        "302 Found\r\nLocation: ws://127.0.0.1:{elsewhere}/v6.json\r\nContent-Length: 0",
        "302 Found\r\nLocation: ws://[::1/v6.json\r\nContent-Length: 0",  # no address
        "200 OK\r\n" + "X: y\r\n" * 5000,
    ],
)
def test_an_answer_that_leads_astray_is_not_followed_and_ends_no_thread(answer: str) -> None:
    with listening() as server, listening() as elsewhere:
        reply = f"HTTP/1.1 {answer.format(elsewhere=elsewhere.getsockname()[1])}\r\n\r\n".encode()

        def serve() -> None:
            for _ in range(2):  # it is asked again
                connection, _ = server.accept()
                with connection, suppress(OSError):
                    connection.recv(4096)
                    connection.sendall(reply)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        with opened(server.getsockname()[1]) as stream:
            thread.join(PATIENCE)
            assert not thread.is_alive()
            until(lambda: "no answer at ws://127.0.0.1" in stream.traffic.trouble)
        elsewhere.setblocking(False)
        with pytest.raises(BlockingIOError):
            elsewhere.accept()


def test_closing_while_nobody_answers_takes_no_time() -> None:
    stream = opened(1)
    stream.close()
    stream.close()
    assert stream.ended
    assert not [thread for thread in threading.enumerate() if thread.name == "device"]


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("leap+ws://127.0.0.1:99999", "not a number from 0 to 65535"),
        ("leap+ws://127.0.0.1:6437/v6.json", "HOST:PORT only"),
        ("leap+ws://127.0.0.1?hands=three", "both or left or right"),
        ("leap+ws://127.0.0.1?version=5", "'version' is unknown"),
    ],
)
def test_an_address_that_cannot_be_opened_is_one_clear_line(url: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        open_stream(url)


def test_a_missing_library_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "websockets.sync.client", None)
    with pytest.raises(InputError, match=r"pip install 'bunraku\[leap\]'"):
        open_stream("leap+ws://127.0.0.1")
