"""Messages that come as UDP datagrams; a flood of them leaves the rest of the program its time."""

from __future__ import annotations

import socket
import struct
import threading
import time

from devices.transport.bound_socket import bound_socket
from devices.transport.live_stream import Deliver

LONGEST = 65535  # bytes of a datagram
QUEUE = 4 << 20  # bytes of unread datagrams that the kernel is asked to keep
WAIT = 0.1  # [s] after which the reader looks whether it is closed
SLICE = 0.004  # [s] of work without a pause after which the reader pauses for as long
IDLE = 0.0002  # [s] of waiting for a datagram that count as a pause
_AT_ONCE = getattr(socket, "MSG_DONTWAIT", 0)
_OVERFLOW = 40  # Linux: SO_RXQ_OVFL, each datagram comes with how many were lost before it


class UdpTransport:
    """A bound UDP socket.

    The reader takes at most half of one core's time: when datagrams come faster than they are
    decoded, it pauses as long as it has worked, and the kernel drops what its queue cannot keep.
    Time that it waits for a busy core does not count as work.

    Args:
        host: a name or an address of this machine.
        port: 0 takes any free one.
        scheme: what the user wrote before ``://``; error messages suggest an address with it.

    Attributes:
        host, port: what it is bound to.
        dropped: datagrams that the kernel dropped, where the system counts them.
        trouble: always empty; a socket without a sender is in no trouble.

    Raises:
        InputError: the host is unknown or not this machine's, or the port is taken (the message
            says by whom and names a free one) or forbidden.
    """

    trouble = ""

    def __init__(self, host: str, port: int, *, scheme: str) -> None:
        self.dropped = 0
        self._closing = threading.Event()
        self._socket = bound_socket(host, port, protocol="udp", scheme=scheme)
        self.host, self.port = self._socket.getsockname()[:2]
        self._socket.settimeout(WAIT)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, QUEUE)
        self._ancillary = 0
        if hasattr(socket, "CMSG_SPACE") and hasattr(self._socket, "recvmsg"):
            try:
                self._socket.setsockopt(socket.SOL_SOCKET, _OVERFLOW, 1)
                self._ancillary = socket.CMSG_SPACE(4)
            except OSError:
                pass  # not Linux: what the kernel drops is not counted

    def run(self, deliver: Deliver) -> None:
        """Deliver every datagram with its arrival and sender's address until it is closed."""
        worked, since = 0.0, time.thread_time()
        while not self._closing.is_set():
            asked = time.perf_counter()
            worked, since = worked + time.thread_time() - since, time.thread_time()
            try:
                data, source = self._receive()
            except TimeoutError:
                continue
            except ConnectionError:
                continue  # Windows tells here that an earlier answer found nobody
            except OSError:
                if self._closing.is_set():
                    return
                raise
            arrival = time.perf_counter()
            worked = 0.0 if arrival - asked > IDLE else worked
            deliver(data, arrival, source)
            if worked > SLICE:
                self._closing.wait(worked)
                worked = 0.0

    def send(self, data: bytes, target: tuple[str, int]) -> bool:
        """Send one datagram from the bound port, without waiting; whether the system took it."""
        try:
            return self._socket.sendto(data, _AT_ONCE, target) == len(data)
        except (OSError, OverflowError):
            return False

    def close(self) -> None:
        """Give the port back; may be called twice."""
        self._closing.set()
        self._socket.close()

    def _receive(self) -> tuple[bytes, tuple[str, int]]:
        if not self._ancillary:
            data, source = self._socket.recvfrom(LONGEST)
            return data, source[:2]
        data, notes, _, source = self._socket.recvmsg(LONGEST, self._ancillary)
        for level, kind, value in notes:
            if (level, kind, len(value)) == (socket.SOL_SOCKET, _OVERFLOW, 4):
                (self.dropped,) = struct.unpack("=I", value)
        return data, source[:2]
