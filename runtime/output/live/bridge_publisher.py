"""Frames for other machines: a ZeroMQ socket that `zmq+tcp://` streams connect to."""

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
from runtime.output.live.bridge_subscribers import BridgeAudience

WAITING = 8192  # frames handed over and not sent yet, at most
GLANCE = 100  # [ms] between looks at who has gone
AT_ONCE = 256  # messages heard before frames go out again
LAST_WORDS = 2.0  # [s] that closing waits for stages which must get every frame
QUIET = 10.0  # [s] in which one thing is not told twice
MOST_TOLD = 64  # lines remembered for that
Z85_LENGTH = 40


@dataclass(frozen=True, slots=True)
class BoundEndpoint:
    """Where a bridge listens and who may come: `keys` is None on this machine only."""

    endpoint: str
    keys: PublisherKeys | None


def binding(bind: str, keys: Path | None, *, option: str) -> BoundEndpoint:
    """What ``tcp://HOST:PORT`` asks for; a port of 0 or ``*`` takes any free one.

    Raises:
        InputError: it is no such address, or it is beyond this machine and there are no keys;
            `option` is what gives them.
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
    """Sends frames to every stage that asks for them, from a thread of its own.

    Args:
        where: to listen at.
        skeleton: of every frame.
        tell: takes one line for the operator, on the bridge's thread.
        clock: this machine's monotonic clock [s], that of the frames' times.

    Attributes:
        endpoint: where it listens, with its port.
        audience: who listens, and what they got; to be read only.

    Raises:
        InputError: the address is taken or none of this machine, or the skeleton is too large.
    """

    def __init__(
        self,
        where: BoundEndpoint,
        skeleton: Skeleton,
        *,
        tell: Callable[[str], None],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.audience = BridgeAudience(skeleton, clock)
        self._tell = tell
        self._told: dict[str, float] = {}
        self._handed: deque[SkeletonFrame] = deque(maxlen=WAITING)
        self._overrun = self._lost = 0
        self._last_word: float | None = None
        self._closing = threading.Event()
        self._woken, self._wake = sockets.socketpair()
        self._woken.setblocking(False)
        self._wake.setblocking(False)
        self._context: Context = zmq.Context()
        self._door = _Door(self._context, where.keys, self._tell_once)
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
        """Frames that a stage should have got and will not get."""
        return self.audience.lost + self._overrun

    def write(self, frame: SkeletonFrame) -> None:
        """Hand one frame over; never blocks."""
        self._overrun += len(self._handed) == self._handed.maxlen
        self._handed.append(frame)
        self._nudge()

    def close(self) -> None:
        """Give stages that must get every frame a moment to do so, then hang up; may come twice."""
        if not self._closing.is_set():
            self._closing.set()
            self._nudge()
            self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _nudge(self) -> None:
        with suppress(BlockingIOError):  # it is full of nudges that have not been heard yet
            self._wake.send(b"\0")

    def _serve(self) -> None:
        poller = zmq.Poller()
        for source in (self._socket, self._handshakes.monitor, self._woken):
            poller.register(source, zmq.POLLIN)
        try:
            while not self._closing.is_set() or self._unfinished():
                found = dict(poller.poll(GLANCE))
                if self._woken.fileno() in found:
                    with suppress(BlockingIOError):
                        self._woken.recv(4096)
                if self._handshakes.monitor in found:
                    self._watch()
                if self._socket in found:
                    self._hear()
                self._send()
        finally:
            self._release()

    def _unfinished(self) -> bool:
        """Whether, while closing, some frame still has a way to go and the time for it."""
        if self._last_word is None:
            self._last_word = time.perf_counter() + LAST_WORDS
        left = self._last_word - time.perf_counter()
        return left > 0.0 and bool(self._handed or not self.audience.settled)

    def _hear(self) -> None:
        began = time.perf_counter()
        for _ in range(AT_ONCE):
            try:
                route, *parts = self._socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                break
            stages = self.audience.stages
            for reply in self.audience.hear(route, parts[0] if len(parts) == 1 else b""):
                self._socket.send_multipart((route, reply))
            if self.audience.stages != stages:
                event = "come" if self.audience.stages > stages else "left"
                self._tell(f"a stage has {event}: {self.audience.stages} now")
        else:  # more than stages say: the rest of the program gets its share of time
            self._closing.wait(time.perf_counter() - began)
        if self.audience.other_version is not None:
            self._tell_once(
                f"a stage speaks version {self.audience.other_version} and we speak {VERSION}; "
                "install the same bunraku on both machines"
            )
            self.audience.other_version = None

    def _send(self) -> None:
        while self._handed:
            self.audience.publish(self._handed.popleft())
        lost = self.lost
        for message in self.audience.due():
            self._socket.send_multipart(message)
        if self.audience.forget():
            self._tell(f"a stage has gone silent: {self.audience.stages} now")
        if lost > self._lost:
            self._tell_once(f"a stage that must get every frame is too slow: {lost} frames lost")
            self._lost = lost

    def _watch(self) -> None:
        for outcome in self._handshakes.news():
            if outcome is Handshake.FAILED:
                self._tell_once(f"nothing goes to a stage that knocked: {outcome.value}")

    def _tell_once(self, line: str) -> None:
        now = time.perf_counter()
        if now - self._told.get(line, -QUIET) >= QUIET:
            self._told = {**self._told, line: now} if len(self._told) < MOST_TOLD else {line: now}
            self._tell(line)

    def _release(self) -> None:
        self._handshakes.close()
        self._socket.close()
        self._door.close()
        self._context.term()
        self._woken.close()
        self._wake.close()


class _Door:
    """Lets in whose key is allowed; there is none to pass where there are no keys."""

    def __init__(
        self, context: Context, keys: PublisherKeys | None, tell: Callable[[str], None]
    ) -> None:
        self._keys = keys
        self._tell = tell
        self._authenticator: ThreadAuthenticator | None = None
        if keys is not None:
            self._authenticator = ThreadAuthenticator(context)
            self._authenticator.start()
            self._authenticator.configure_curve_callback(DOMAIN, credentials_provider=self)

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether the stage with this public key, raw or as Z85, may come in."""
        del domain
        shown = key if len(key) == Z85_LENGTH else z85.encode(key)
        allowed = self._keys is not None and shown in self._keys.allowed
        if not allowed:
            self._tell(
                "nothing goes to a stage whose key is not allowed; its public key belongs into "
                "the folder `allowed` of --keys"
            )
        return allowed

    def close(self) -> None:
        """Stop letting anybody in."""
        if self._authenticator is not None:
            self._authenticator.stop()
