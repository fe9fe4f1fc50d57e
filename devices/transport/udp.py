"""Receives UDP datagrams, with bounded processor time even during a flood."""

from __future__ import annotations

import socket
import struct
import threading
import time

from devices.transport.bound_socket import bound_socket
from devices.transport.live_stream import Deliver

LONGEST = 65535  # bytes of a datagram
QUEUE = 4 << 20  # bytes of unread datagrams that the kernel is asked to keep
WAIT = 0.1  # [s] between checks whether the reader is closed
SLICE = 0.004  # [s] of work without a pause, after which the reader pauses for as long
IDLE = 0.0002  # [s] of waiting for a datagram that counts as a pause
_AT_ONCE = getattr(socket, "MSG_DONTWAIT", 0)
_OVERFLOW = 40  # Linux: SO_RXQ_OVFL, reports with each datagram how many were lost before it


class UdpTransport:
    """A bound UDP socket.

    The reader takes at most half of one core's time: if datagrams come faster than they are
    decoded, it pauses for as long as it has worked, and the kernel drops what exceeds its queue.
    Time spent waiting for a busy core does not count as work.

    Args:
        host: a name or an address of this machine.
        port: 0 takes any free one.
        scheme: the scheme of the address, for suggestions in error messages.

    Attributes:
        host, port: the bound address.
        dropped: datagrams that the kernel dropped, where the system counts them.
        trouble: always empty; silence is no fault of a socket.

    Raises:
        InputError: the host is unknown or not this machine, or the port is taken (the message
            names the process and a free port) or forbidden.
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
                pass  # not Linux: dropped datagrams are not counted

    def run(self, deliver: Deliver) -> None:
        """Deliver every datagram with its arrival and the sender's address until closed."""
        worked, since = 0.0, time.thread_time()
        while not self._closing.is_set():
            asked = time.perf_counter()
            worked, since = worked + time.thread_time() - since, time.thread_time()
            try:
                data, source = self._receive()
            except TimeoutError:
                continue
            except ConnectionError:
                continue  # Windows reports here that an earlier answer was not delivered
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
        """Send one datagram from the bound port, without waiting; return whether it was queued."""
        try:
            return self._socket.sendto(data, _AT_ONCE, target) == len(data)
        except (OSError, OverflowError):
            return False

    def close(self) -> None:
        """Release the port; may be called twice."""
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
