"""ZeroMQ sockets as both ends of a bridge use them: bounded, watched, guarded, and soon back.

Source: https://libzmq.readthedocs.io/en/latest/zmq_setsockopt.html and zmq_socket_monitor.html.
"""

from __future__ import annotations

from enum import Enum

import zmq
from zmq.utils.monitor import recv_monitor_message

from devices.bridge.keys import PublisherKeys, SubscriberKeys
from devices.bridge.messages import MAX_MESSAGE

DOMAIN = "bunraku"
_SIGN_OF_LIFE = 500  # [ms] between ZeroMQ's own heartbeats
_DEAD = 2000  # [ms] without one, after which a connection is taken for broken
_RECONNECT = (100, 1000)  # [ms] first and longest pause before the next attempt
_LAST_WORD = 100  # [ms] that closing waits for what was said last
_QUEUE = 1000  # messages that wait to be read

Socket = zmq.Socket[bytes]
Context = zmq.Context[Socket]


class Handshake(Enum):
    """What became of an attempt to get into connection."""

    DONE = "done"
    KEY_REFUSED = "the key is not among those that are allowed"
    FAILED = "one side has keys and the other has not, or they do not belong together"


_OUTCOMES = {
    zmq.Event.HANDSHAKE_SUCCEEDED: Handshake.DONE,
    zmq.Event.HANDSHAKE_FAILED_AUTH: Handshake.KEY_REFUSED,
    zmq.Event.HANDSHAKE_FAILED_PROTOCOL: Handshake.FAILED,
    zmq.Event.HANDSHAKE_FAILED_NO_DETAIL: Handshake.FAILED,
}


def bridge_socket(
    context: Context, kind: int, endpoint: str, keys: PublisherKeys | SubscriberKeys | None
) -> Socket:
    """A socket for `endpoint`, a ROUTER at the bridge and a DEALER at the stage.

    With `keys` of a bridge only the stages in it are let in, provided that an authenticator runs in
    this context; without one nobody is.
    """
    socket = context.socket(kind)
    socket.linger = _LAST_WORD
    socket.ipv6 = "[" in endpoint
    socket.maxmsgsize = MAX_MESSAGE
    socket.rcvhwm = _QUEUE
    socket.sndhwm = 0  # what is under way is bounded by the stage's credit
    socket.heartbeat_ivl = _SIGN_OF_LIFE
    socket.heartbeat_timeout = _DEAD
    socket.reconnect_ivl, socket.reconnect_ivl_max = _RECONNECT
    if kind == zmq.DEALER:
        socket.immediate = True  # a call that waits for a connection asks for an old time
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
    """Watches what becomes of a socket's handshakes.

    Attributes:
        monitor: can be polled beside the socket.
    """

    def __init__(self, socket: Socket) -> None:
        self._socket = socket
        self.monitor: Socket = socket.get_monitor_socket(sum(_OUTCOMES))

    def news(self) -> list[Handshake]:
        """What has happened since the last call."""
        found = []
        while self.monitor.poll(0):
            found.append(_OUTCOMES[zmq.Event(recv_monitor_message(self.monitor)["event"])])
        return found

    def close(self) -> None:
        """Stop watching; before the socket is closed."""
        self._socket.disable_monitor()
        self.monitor.close()


def tcp_endpoint(host: str, port: int | str) -> str:
    """ZeroMQ's way of writing a TCP address."""
    return f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"


def bound_endpoint(socket: Socket) -> str:
    """Where a socket listens, with the port that the system gave it."""
    return str(socket.getsockopt_string(zmq.LAST_ENDPOINT))
