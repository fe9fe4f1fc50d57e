"""Receives messages over TCP: senders connect to us, and a header gives each message's length.

One thread reads all connections. Whatever happens on one of them (silence, a reset, an end in the
middle of a message, invalid bytes) does not affect the others.
"""

from __future__ import annotations

import selectors
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count

from devices.transport.bound_socket import bound_socket
from devices.transport.live_stream import Deliver
from devices.transport.senders import FORGOTTEN, MOST_SENDERS

LONGEST = 1 << 20  # bytes of a message; a header that states more is invalid
CHUNK = 1 << 14  # bytes read from one connection before the others have their turn
WAIT = 0.1  # [s] between checks whether the reader is closed
SLICE = 0.004  # [s] of work without a pause, after which the reader pauses for as long
IDLE = 0.0002  # [s] of waiting for bytes that counts as a pause
# A machine that loses power does not close its connections: probed after 2 s, closed after 5 s.
_KEEP_ALIVE = {"TCP_KEEPIDLE": 2, "TCP_KEEPINTVL": 1, "TCP_KEEPCNT": 3}


@dataclass(frozen=True, slots=True)
class Framing:
    """How a stream is cut into messages that each begin with a header.

    Attributes:
        name: of the protocol, for error messages.
        header: bytes of a header.
        length: returns the bytes of a whole message from its header; None for an invalid header.
    """

    name: str
    header: int
    length: Callable[[bytes], int | None]


def take_messages(data: bytearray, framing: Framing) -> tuple[list[bytes], bool]:
    """Remove the whole messages from the front of `data`; also return whether the rest is valid."""
    messages: list[bytes] = []
    start = 0
    sound = True
    while len(data) - start >= framing.header:
        length = framing.length(bytes(data[start : start + framing.header]))
        if length is None or not framing.header <= length <= LONGEST:
            sound = False
            break
        if len(data) - start < length:
            break
        messages.append(bytes(data[start : start + length]))
        start += length
    del data[:start]
    return messages, sound


@dataclass(slots=True, eq=False)
class _Connection:
    """One sender.

    Attributes:
        stream: non-blocking socket.
        name: host and port, for error messages.
        source: its machine, and the lowest number that no other connection of it has. A sender
            that reconnects is the same sender, with the same decoder and performers. It is not the
            address tuple, since `Senders` lets datagram senders take over each other's slots.
        heard: time [s] of the connection or of its newest bytes.
        data: the beginning of a message.
        valid: whether a message was received.
    """

    stream: socket.socket
    name: str
    source: str
    heard: float
    data: bytearray = field(default_factory=bytearray)
    valid: bool = False


class TcpTransport:
    """A listening TCP socket and its accepted connections, at most `MOST_SENDERS`.

    A further connection replaces the one that was silent longest, if for `FORGOTTEN` seconds, and
    is closed otherwise. The reader takes at most half of one core's time, as `UdpTransport` does;
    TCP then slows the senders down.

    Args:
        host: a name or an address of this machine.
        port: 0 takes any free one.
        scheme: the scheme of the address, for suggestions in error messages.
        framing: of the protocol.

    Attributes:
        host, port: the listening address.
        dropped: always 0; TCP loses nothing.
        trouble: why a connection was closed; empty after the first message of another.

    Raises:
        InputError: the host is unknown or not this machine, or the port is taken (the message
            names the process and a free port) or forbidden.
    """

    dropped = 0

    def __init__(self, host: str, port: int, *, scheme: str, framing: Framing) -> None:
        self.trouble = ""
        self._framing = framing
        self._closing = threading.Event()
        self._connections: list[_Connection] = []
        self._listener = bound_socket(host, port, protocol="tcp", scheme=scheme)
        self._listener.setblocking(False)
        self.host, self.port = self._listener.getsockname()[:2]

    def run(self, deliver: Deliver) -> None:
        """Deliver every message, with the arrival of its last byte, until closed."""
        with selectors.DefaultSelector() as selector:
            try:
                selector.register(self._listener, selectors.EVENT_READ)
                self._serve(selector, deliver)
            except (OSError, ValueError):
                if not self._closing.is_set():  # else the listener was closed by `close`
                    raise
            finally:
                for connection in tuple(self._connections):
                    self._drop(selector, connection)

    def close(self) -> None:
        """Release the port; `run` then closes the connections. May be called twice."""
        self._closing.set()
        self._listener.close()

    def _serve(self, selector: selectors.BaseSelector, deliver: Deliver) -> None:
        worked, since = 0.0, time.thread_time()
        while not self._closing.is_set():
            asked = time.perf_counter()
            worked, since = worked + time.thread_time() - since, time.thread_time()
            ready = selector.select(WAIT)
            worked = 0.0 if time.perf_counter() - asked > IDLE else worked
            for key, _ in ready:
                if key.data is None:
                    self._accept(selector)
                elif key.data in self._connections:  # else it was just replaced
                    self._read(selector, key.data, deliver)
            if worked > SLICE:
                self._closing.wait(worked)
                worked = 0.0

    def _accept(self, selector: selectors.BaseSelector) -> None:
        try:
            stream, (host, port, *_) = self._listener.accept()
        except (BlockingIOError, ConnectionError):
            return  # the connection is already gone
        except OSError as error:
            if not self._closing.wait(WAIT):  # it would fail again at once
                self.trouble = f"a connection cannot be accepted ({error.strerror or error})"
            return
        _prepare(stream)
        now = time.perf_counter()
        name = f"{host}:{port}"
        if len(self._connections) == MOST_SENDERS and not self._make_room(selector, now):
            self.trouble = f"{name} was refused: {MOST_SENDERS} others are connected; close one"
            stream.close()
            return
        taken = {connection.source for connection in self._connections}
        source = next(key for key in (f"{host} {n}" for n in count()) if key not in taken)
        connection = _Connection(stream, name, source, now)
        self._connections.append(connection)
        selector.register(stream, selectors.EVENT_READ, connection)

    def _make_room(self, selector: selectors.BaseSelector, now: float) -> bool:
        """Close the connection that was silent longest, if for long; return whether it was."""
        quietest = min(self._connections, key=lambda connection: connection.heard)
        if now - quietest.heard < FORGOTTEN:
            return False
        self._drop(selector, quietest)
        return True

    def _read(
        self, selector: selectors.BaseSelector, connection: _Connection, deliver: Deliver
    ) -> None:
        try:
            data = connection.stream.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            self._drop(selector, connection, f"was lost ({error.strerror or error})")
            return
        if not data:
            unfinished = "ended in the middle of a message" if connection.data else ""
            self._drop(selector, connection, unfinished)
            return
        connection.heard = time.perf_counter()
        connection.data += data
        messages, sound = take_messages(connection.data, self._framing)
        if messages and not connection.valid:
            connection.valid = True
            self.trouble = ""
        for message in messages:
            deliver(message, connection.heard, connection.source)
        if not sound:  # the start of the next message is unknown
            what = f"sent what is no {self._framing.name} message and was closed; "
            self._drop(selector, connection, what + "set its sender to that, and connect again")

    def _drop(
        self, selector: selectors.BaseSelector, connection: _Connection, trouble: str = ""
    ) -> None:
        if trouble:
            self.trouble = f"the connection of {connection.name} {trouble}"
        selector.unregister(connection.stream)
        self._connections.remove(connection)
        connection.stream.close()


def _prepare(stream: socket.socket) -> None:
    """Make a connection non-blocking, and detect a lost sender."""
    stream.setblocking(False)
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEP_ALIVE.items():
        if hasattr(socket, name):  # else the system's defaults apply
            stream.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
