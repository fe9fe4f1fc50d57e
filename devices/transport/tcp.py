"""Messages that come as TCP streams: we listen, senders connect, and a header tells how long.

All connections are read by one thread. What one of them does, be it silence, a reset, an end in
the middle of a message, or bytes that are no message, is no matter to the others.
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

LONGEST = 1 << 20  # bytes of a message, or a header that states more is not believed
CHUNK = 1 << 14  # bytes that are read from one connection before the others have their turn
WAIT = 0.1  # [s] after which the reader looks whether it is closed
SLICE = 0.004  # [s] of work without a pause after which the reader pauses for as long
IDLE = 0.0002  # [s] of waiting for bytes that count as a pause
# A machine that lost its power says no goodbye: asked after 2 s of silence, it is gone after 5.
_KEEP_ALIVE = {"TCP_KEEPIDLE": 2, "TCP_KEEPINTVL": 1, "TCP_KEEPCNT": 3}


@dataclass(frozen=True, slots=True)
class Framing:
    """How a stream is cut into messages, each of which begins with a header.

    Attributes:
        name: of the protocol, for people.
        header: bytes of a header.
        length: bytes of a whole message, by its header; None where that is no header.
    """

    name: str
    header: int
    length: Callable[[bytes], int | None]


def take_messages(data: bytearray, framing: Framing) -> tuple[list[bytes], bool]:
    """The whole messages at the front of `data`, taken off it; and whether the rest may be one."""
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
        stream: does not block.
        name: host and port, for people.
        source: its machine, and the lowest number that no other connection of it has: a sender that
            connects again is the same one, with the same decoder and performers. Not the tuple of
            an address, since `Senders` lets senders of datagrams take each other's places.
        heard: when it connected or its newest bytes came [s].
        data: the beginning of a message.
        vouched: whether a message came.
    """

    stream: socket.socket
    name: str
    source: str
    heard: float
    data: bytearray = field(default_factory=bytearray)
    vouched: bool = False


class TcpTransport:
    """A listening TCP socket and the connections that it accepted, `MOST_SENDERS` at most.

    A connection too many takes the place of the one that was silent longest, if for `FORGOTTEN`
    seconds, and is closed otherwise. The reader takes at most half of one core's time, as
    `UdpTransport` does; TCP then holds the senders back.

    Args:
        host: a name or an address of this machine.
        port: 0 takes any free one.
        scheme: what the user wrote before ``://``; error messages suggest an address with it.
        framing: of the protocol.

    Attributes:
        host, port: what it listens at.
        dropped: always 0; TCP loses nothing.
        trouble: why a connection was closed; empty again with the first message of another.

    Raises:
        InputError: the host is unknown or not this machine's, or the port is taken (the message
            says by whom and names a free one) or forbidden.
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
        """Deliver every message, with the arrival of its last byte, until it is closed."""
        with selectors.DefaultSelector() as selector:
            try:
                selector.register(self._listener, selectors.EVENT_READ)
                self._serve(selector, deliver)
            except (OSError, ValueError):
                if not self._closing.is_set():  # or the listener was closed under our hands
                    raise
            finally:
                for connection in tuple(self._connections):
                    self._drop(selector, connection)

    def close(self) -> None:
        """Give the port back; `run` then closes the connections; may be called twice."""
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
                elif key.data in self._connections:  # or it just gave way to another
                    self._read(selector, key.data, deliver)
            if worked > SLICE:
                self._closing.wait(worked)
                worked = 0.0

    def _accept(self, selector: selectors.BaseSelector) -> None:
        try:
            stream, (host, port, *_) = self._listener.accept()
        except (BlockingIOError, ConnectionError):
            return  # whoever it was has gone
        except OSError as error:
            if not self._closing.wait(WAIT):  # it would be ready, and fail, again at once
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
        """Close the connection that was silent longest, if for long; whether that was so."""
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
        if messages and not connection.vouched:
            connection.vouched = True
            self.trouble = ""
        for message in messages:
            deliver(message, connection.heard, connection.source)
        if not sound:  # where the next message begins, nothing tells
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
    """Let a connection neither block nor outlive its sender for long."""
    stream.setblocking(False)
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEP_ALIVE.items():
        if hasattr(socket, name):  # or the system's own patience holds
            stream.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
