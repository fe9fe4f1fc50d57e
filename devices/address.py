"""Parse the address of a device, such as ``vmc://127.0.0.1:39539?role=performer``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import SplitResult, parse_qsl

from devices.errors import InputError

LOOPBACK = "127.0.0.1"


def host_and_port(address: SplitResult, port: int) -> tuple[str, int]:
    """Return the host and port of an address; the defaults are this machine and `port`.

    Raises:
        InputError: the port is not a number from 0 to 65535, or the address has further parts.
    """
    try:
        chosen = address.port
    except ValueError:
        raise InputError(
            f"cannot open {address.geturl()!r}: the port is not a number from 0 to 65535"
        ) from None
    if address.username is not None or address.path.strip("/") or address.fragment:
        raise InputError(
            f"cannot open {address.geturl()!r}: expected {address.scheme}://HOST:PORT only, "
            f"as in {address.scheme}://{LOOPBACK}:{port}"
        )
    return address.hostname or LOOPBACK, port if chosen is None else chosen


def options_of(
    address: SplitResult, known: Mapping[str, Callable[[str], Any]] | None = None
) -> dict[str, Any]:
    """Return the options after the question mark, each parsed by its function in `known`.

    Raises:
        InputError: an option is unknown (the message lists the known ones), is given twice, or its
            function raises ValueError.
    """
    parsers = known or {}
    options: dict[str, Any] = {}
    for name, text in parse_qsl(address.query, keep_blank_values=True):
        where = f"cannot open {address.geturl()!r}: option {name!r}"
        if name not in parsers:
            there = ", ".join(parsers) or "none"
            raise InputError(f"{where} is unknown to {address.scheme}://; known options: {there}")
        if name in options:
            raise InputError(f"{where} is given twice; give it once")
        try:
            options[name] = parsers[name](text)
        except ValueError as error:
            raise InputError(f"{where} cannot be {text!r}: {error}") from None
    return options


def positive(text: str) -> float:
    """Parse a finite number above 0.

    Raises:
        ValueError: the text is not such a number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise ValueError("expected a finite number above 0")
    return value


def one_of(*words: str) -> Callable[[str], str]:
    """Return a parser that accepts only the given `words`."""

    def read(text: str) -> str:
        if text not in words:
            raise ValueError(f"expected {' or '.join(words)}")
        return text

    return read
