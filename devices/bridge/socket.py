"""ZeroMQ sockets for both ends of a bridge: bounded queues, keep-alive, encryption, reconnection.

Source: https://libzmq.readthedocs.io/en/latest/zmq_setsockopt.html and zmq_socket_monitor.html.
"""

from __future__ import annotations

from enum import Enum

import zmq
from zmq.utils.monitor import recv_monitor_message

from devices.bridge.keys import PublisherKeys, SubscriberKeys
from devices.bridge.messages import MAX_MESSAGE

DOMAIN = "bunraku"
_IDLE, _PROBES = 1, 2  # [s] of silence before each of so many probes of the other machine
_DEAD = 2000  # [ms] without an answer to what was sent, after which a connection counts as broken
_RECONNECT = (100, 1000)  # [ms] first and longest pause before the next attempt
_LINGER = 100  # [ms] that closing waits for the last message
_QUEUE = 1000  # messages that wait to be read
_TO_SEND = (
    2400  # messages that wait to be sent: twice the credit of a lossless subscriber, and more
)

Socket = zmq.Socket[bytes]
Context = zmq.Context[Socket]


class Handshake(Enum):
    """The result of an attempt to connect."""

    DONE = "done"
    KEY_REFUSED = "the key is not among those that are allowed"
    FAILED = "one side has keys and the other has none, or the keys do not belong together"


_OUTCOMES = {
    zmq.Event.HANDSHAKE_SUCCEEDED: Handshake.DONE,
    zmq.Event.HANDSHAKE_FAILED_AUTH: Handshake.KEY_REFUSED,
    zmq.Event.HANDSHAKE_FAILED_PROTOCOL: Handshake.FAILED,
    zmq.Event.HANDSHAKE_FAILED_NO_DETAIL: Handshake.FAILED,
}


def bridge_socket(
    context: Context, kind: int, endpoint: str, keys: PublisherKeys | SubscriberKeys | None
) -> Socket:
    """Return a socket for `endpoint`: a ROUTER at the publisher, a DEALER at the subscriber.

    With `keys` of a publisher only its allowed subscribers can connect, provided that an
    authenticator runs in this context; without an authenticator none can.
    """
    socket = context.socket(kind)
    socket.linger = _LINGER
    socket.ipv6 = "[" in endpoint
    socket.maxmsgsize = MAX_MESSAGE
    socket.rcvhwm = _QUEUE
    # The credit bounds the frames to a subscriber that is honest; of one that never reads, the rest
    # is dropped.
    socket.sndhwm = _TO_SEND
    # The system finds out that the other machine is gone. ZeroMQ's own heartbeats would, too, but
    # libzmq ends the whole process where one is due on a connection that failed while its reader
    # was behind (zeromq/libzmq#4364): any subscriber could do that.
    socket.tcp_keepalive, socket.tcp_keepalive_idle = 1, _IDLE
    socket.tcp_keepalive_intvl, socket.tcp_keepalive_cnt = _IDLE, _PROBES
    socket.setsockopt(zmq.TCP_MAXRT, _DEAD)
    socket.reconnect_ivl, socket.reconnect_ivl_max = _RECONNECT
    if kind == zmq.DEALER:
        socket.immediate = True  # a call queued until a connection exists would carry an old time
    if keys is not None:
        socket.curve_publickey, socket.curve_secretkey = keys.public, keys.secret
    if isinstance(keys, SubscriberKeys):
        socket.curve_serverkey = keys.bridge
    if isinstance(keys, PublisherKeys):
        socket.curve_server = True
        socket.zap_domain = DOMAIN.encode()
        socket.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)
    return socket


class Handshakes:
    """Observes the handshakes of a socket.

    Attributes:
        monitor: socket to poll beside the observed one.
    """

    def __init__(self, socket: Socket) -> None:
        self._socket = socket
        self.monitor: Socket = socket.get_monitor_socket(sum(_OUTCOMES))

    def news(self) -> list[Handshake]:
        """Return the results since the last call."""
        found = []
        while self.monitor.poll(0):
            found.append(_OUTCOMES[zmq.Event(recv_monitor_message(self.monitor)["event"])])
        return found

    def close(self) -> None:
        """Stop observing; call before the socket is closed."""
        self._socket.disable_monitor()
        self.monitor.close()


def tcp_endpoint(host: str, port: int | str) -> str:
    """Return a TCP address in ZeroMQ's notation."""
    return f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"


def bound_endpoint(socket: Socket) -> str:
    """Return the address at which a socket listens, with the port that the system chose."""
    return str(socket.getsockopt_string(zmq.LAST_ENDPOINT))
