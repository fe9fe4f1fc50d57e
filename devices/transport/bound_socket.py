"""A socket bound to a port of this machine, or one line on why there is none and what to do."""

from __future__ import annotations

import errno
import os
import socket
from typing import Literal

from devices.errors import InputError
from devices.transport.port_owner import port_owner

PORTS_TO_TRY = 20
BACKLOG = 16  # TCP connections that wait to be accepted

Protocol = Literal["udp", "tcp"]
_KINDS = {"udp": socket.SOCK_DGRAM, "tcp": socket.SOCK_STREAM}


def bound_socket(host: str, port: int, *, protocol: Protocol, scheme: str) -> socket.socket:
    """A socket bound to host and port (0 is any free one); one of TCP listens.

    Args:
        scheme: what the user wrote before ``://``; error messages suggest an address with it.

    Raises:
        InputError: the host is unknown or not this machine's, or the port is taken (the message
            says by whom and names a free one) or forbidden.
    """
    where = f"{scheme}://{host}:{port}"
    try:
        family, _, _, _, target = socket.getaddrinfo(host, port, type=_KINDS[protocol])[0]
    except (OSError, UnicodeError):
        raise InputError(
            f"cannot open {where}: no host is called {host!r}; "
            "use 127.0.0.1, 0.0.0.0, or this machine's own address"
        ) from None
    bound = socket.socket(family, _KINDS[protocol])
    try:
        _bind(bound, target)
        if protocol == "tcp":
            bound.listen(BACKLOG)
    except OSError as error:
        bound.close()
        reason = _reason(error, host, port, protocol, scheme)
        raise InputError(f"cannot open {where}: {reason}") from None
    return bound


def _bind(bound: socket.socket, target: tuple[object, ...]) -> None:
    """Bind, also where connections of a show that was there just now are still dying away."""
    if bound.type == socket.SOCK_STREAM and os.name == "posix":  # elsewhere it lets others in
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    bound.bind(target)


def _reason(error: OSError, host: str, port: int, protocol: Protocol, scheme: str) -> str:
    kind = protocol.upper()
    if error.errno == errno.EADDRINUSE:
        owner = port_owner(port, protocol)
        holder = f"{owner.name} (process {owner.process})" if owner else "another program"
        other = _free_port(host, port, protocol)
        use = f"use another port, e.g. {scheme}://{host}:{other}" if other else "use another port"
        return f"{kind} port {port} is taken by {holder}; close it, or {use}"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{host} is no address of this machine; use 127.0.0.1, or 0.0.0.0 for all of them"
    if error.errno == errno.EACCES:
        return f"{kind} port {port} needs more rights than this user has; use one from 1024"
    return f"{error.strerror or error}; use another port or host"


def _free_port(host: str, port: int, protocol: Protocol) -> int | None:
    """The next port that can be bound."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for candidate in range(port + 1, min(port + 1 + PORTS_TO_TRY, 65536)):
        with socket.socket(family, _KINDS[protocol]) as trial:
            try:
                _bind(trial, (host, candidate))
            except OSError:
                continue
            return candidate
    return None
