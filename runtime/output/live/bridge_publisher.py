"""The ZeroMQ socket that `zmq+tcp://` streams on other machines connect to."""

from __future__ import annotations

import socket as sockets
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

import zmq
from zmq.auth.thread import ThreadAuthenticator
from zmq.utils import z85

from devices.bridge.keys import PublisherKeys, check_guarded, read_publisher_keys
from devices.bridge.messages import VERSION
from devices.bridge.socket import (
    DOMAIN,
    Context,
    Handshake,
    Handshakes,
    bound_endpoint,
    bridge_socket,
    tcp_endpoint,
)
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.output.live.bridge_subscribers import BridgeSubscribers

WAITING = 8192  # most frames that wait for the bridge's thread
POLL = 100  # [ms] between checks for silent subscribers
AT_ONCE = 256  # messages read before frames are sent again
LINGER = 2.0  # [s] that closing waits for subscribers that must get every frame
QUIET = 10.0  # [s] before the same line is reported again
MOST_REPORTED = 64  # lines remembered for that
Z85_LENGTH = 40


@dataclass(frozen=True, slots=True)
class BoundEndpoint:
    """Where a bridge listens and which keys it admits; `keys` is None on this machine only."""

    endpoint: str
    keys: PublisherKeys | None


def binding(bind: str, keys: Path | None, *, option: str) -> BoundEndpoint:
    """Parse ``tcp://HOST:PORT``; port 0 or ``*`` takes any free port.

    Raises:
        InputError: it is no such address, or it is reachable from other machines and there are no
            keys; the message names `option`, which gives them.
    """
    try:
        address = urlsplit(bind.replace(":*", ":0"))
        host, port = address.hostname, address.port
    except ValueError:
        host = port = None
    if host is None or port is None or bind.count("/") != 2 or not bind.startswith("tcp://"):
        raise InputError(
            f"cannot bind {bind!r}: expected tcp://HOST:PORT, as in tcp://127.0.0.1:5570"
        )
    check_guarded(host, keys=keys, option=option)
    everywhere = {"0.0.0.0": "*", "localhost": "127.0.0.1"}
    return BoundEndpoint(
        tcp_endpoint(everywhere.get(host, host), port or "*"),
        None if keys is None else read_publisher_keys(keys),
    )


class BridgePublisher:
    """Sends frames to every subscriber, on a thread of its own.

    Args:
        where: the address to listen at.
        skeleton: of every frame.
        report: takes one line for the operator, on the bridge's thread.
        clock: this machine's monotonic clock [s], which the frames' times use.

    Attributes:
        endpoint: the address that it listens at, with its port.
        subscribers: the subscribers and their counts; read only.

    Raises:
        InputError: the address is taken or not of this machine, or the skeleton is too large.
    """

    def __init__(
        self,
        where: BoundEndpoint,
        skeleton: Skeleton,
        *,
        report: Callable[[str], None],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.subscribers = BridgeSubscribers(skeleton, clock)
        self._report = report
        self._reported: dict[str, float] = {}
        self._handed: deque[SkeletonFrame] = deque(maxlen=WAITING)
        self._overrun = self._lost = 0
        self._deadline: float | None = None
        self._closing = threading.Event()
        self._woken, self._wake = sockets.socketpair()
        self._woken.setblocking(False)
        self._wake.setblocking(False)
        self._context: Context = zmq.Context()
        self._admission = _Admission(self._context, where.keys, self._report_once)
        self._socket = bridge_socket(self._context, zmq.ROUTER, where.endpoint, where.keys)
        self._handshakes = Handshakes(self._socket)
        try:
            self._socket.bind(where.endpoint)
        except zmq.ZMQError as error:
            self._release()
            raise InputError(f"cannot bind {where.endpoint}: {error.strerror}") from error
        self.endpoint = bound_endpoint(self._socket)
        self._thread = threading.Thread(target=self._serve, name="bridge", daemon=True)
        self._thread.start()

    @property
    def lost(self) -> int:
        """Frames that a subscriber should have got and will not get."""
        return self.subscribers.lost + self._overrun

    def write(self, frame: SkeletonFrame) -> None:
        """Queue one frame; never blocks."""
        self._overrun += len(self._handed) == self._handed.maxlen
        self._handed.append(frame)
        self._signal()

    def close(self) -> None:
        """Give lossless subscribers a moment to finish, then close; may be called twice."""
        if not self._closing.is_set():
            self._closing.set()
            self._signal()
            self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _signal(self) -> None:
        with suppress(BlockingIOError):  # the socket is full of signals that were not read yet
            self._wake.send(b"\0")

    def _serve(self) -> None:
        poller = zmq.Poller()
        for source in (self._socket, self._handshakes.monitor, self._woken):
            poller.register(source, zmq.POLLIN)
        try:
            while not self._closing.is_set() or self._unfinished():
                found = dict(poller.poll(POLL))
                if self._woken.fileno() in found:
                    with suppress(BlockingIOError):
                        self._woken.recv(4096)
                if self._handshakes.monitor in found:
                    self._watch()
                if self._socket in found:
                    self._read()
                self._send()
        finally:
            self._release()

    def _unfinished(self) -> bool:
        """Whether, while closing, frames are still to be sent and there is time left."""
        if self._deadline is None:
            self._deadline = time.perf_counter() + LINGER
        left = self._deadline - time.perf_counter()
        return left > 0.0 and bool(self._handed or not self.subscribers.settled)

    def _read(self) -> None:
        began = time.perf_counter()
        for _ in range(AT_ONCE):
            try:
                route, *parts = self._socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                break
            count = self.subscribers.count
            for reply in self.subscribers.read(route, parts[0] if len(parts) == 1 else b""):
                self._socket.send_multipart((route, reply))
            if self.subscribers.count != count:
                event = "connected" if self.subscribers.count > count else "left"
                self._report(f"a subscriber has {event}: {self.subscribers.count} now")
        else:  # more messages than subscribers send: leave time for the rest of the program
            self._closing.wait(time.perf_counter() - began)
        if self.subscribers.other_version is not None:
            self._report_once(
                f"a subscriber uses version {self.subscribers.other_version}, this bridge "
                f"{VERSION}; install the same bunraku on both machines"
            )
            self.subscribers.other_version = None

    def _send(self) -> None:
        while self._handed:
            self.subscribers.publish(self._handed.popleft())
        lost = self.lost
        for message in self.subscribers.due():
            self._socket.send_multipart(message)
        if self.subscribers.forget():
            self._report(f"a subscriber is silent and was dropped: {self.subscribers.count} now")
        if lost > self._lost:
            self._report_once(f"a lossless subscriber is too slow: {lost} frames lost")
            self._lost = lost

    def _watch(self) -> None:
        for outcome in self._handshakes.news():
            if outcome is Handshake.FAILED:
                self._report_once(f"a subscriber cannot connect: {outcome.value}")

    def _report_once(self, line: str) -> None:
        now = time.perf_counter()
        if now - self._reported.get(line, -QUIET) >= QUIET:
            self._reported = (
                {**self._reported, line: now}
                if len(self._reported) < MOST_REPORTED
                else {line: now}
            )
            self._report(line)

    def _release(self) -> None:
        self._handshakes.close()
        self._socket.close()
        self._admission.close()
        self._context.term()
        self._woken.close()
        self._wake.close()


class _Admission:
    """Admits subscribers whose key is allowed; without keys it does nothing."""

    def __init__(
        self, context: Context, keys: PublisherKeys | None, report: Callable[[str], None]
    ) -> None:
        self._keys = keys
        self._report = report
        self._authenticator: ThreadAuthenticator | None = None
        if keys is not None:
            self._authenticator = ThreadAuthenticator(context)
            self._authenticator.start()
            self._authenticator.configure_curve_callback(DOMAIN, credentials_provider=self)

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether the subscriber with this public key, raw or as Z85, is admitted."""
        del domain
        shown = key if len(key) == Z85_LENGTH else z85.encode(key)
        allowed = self._keys is not None and shown in self._keys.allowed
        if not allowed:
            self._report(
                "refused a subscriber whose key is not allowed; put its public key into the "
                "folder `allowed` of --keys"
            )
        return allowed

    def close(self) -> None:
        """Stop admitting subscribers."""
        if self._authenticator is not None:
            self._authenticator.stop()
