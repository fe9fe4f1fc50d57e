"""Bind a socket to a port of this machine, or explain in one line why that fails."""

from __future__ import annotations

import errno
import os
import socket
from typing import Literal

from devices.errors import InputError
from devices.transport.port_owner import port_owner

PORTS_TO_TRY = 20
BACKLOG = 16  # TCP connections waiting to be accepted

Protocol = Literal["udp", "tcp"]
_KINDS = {"udp": socket.SOCK_DGRAM, "tcp": socket.SOCK_STREAM}


def bound_socket(host: str, port: int, *, protocol: Protocol, scheme: str) -> socket.socket:
    """Return a socket bound to host and port (0 is any free port); a TCP socket listens.

    Args:
        host: a name or an address of this machine.
        port: the port.
        protocol: "udp" or "tcp".
        scheme: the scheme of the address, for suggestions in error messages.

    Raises:
        InputError: the host is unknown or not this machine, or the port is taken (the message
            names the process and a free port) or forbidden.
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
    """Bind, also while connections of an earlier process on this port are still closing."""
    if bound.type == socket.SOCK_STREAM and os.name == "posix":  # elsewhere this shares the port
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
    """The next port that can be bound, or None."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for candidate in range(port + 1, min(port + 1 + PORTS_TO_TRY, 65536)):
        with socket.socket(family, _KINDS[protocol]) as trial:
            try:
                _bind(trial, (host, candidate))
            except OSError:
                continue
            return candidate
    return None
