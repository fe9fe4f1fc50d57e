"""What an address such as ``vmc://127.0.0.1:39539?role=performer`` asks for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import SplitResult, parse_qsl

from devices.errors import InputError

LOOPBACK = "127.0.0.1"


def host_and_port(address: SplitResult, port: int) -> tuple[str, int]:
    """Host and port of an address; this machine only, and `port`, where it does not say.

    Raises:
        InputError: the port is no number from 0 to 65535, or there is more than host and port.
    """
    try:
        chosen = address.port
    except ValueError:
        raise InputError(
            f"cannot open {address.geturl()!r}: the port is no number from 0 to 65535"
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
    """The options behind the question mark, each read by its reader in `known`.

    Raises:
        InputError: an option is not known (the message lists those that are), comes twice, or its
            reader raises ValueError.
    """
    readers = known or {}
    options: dict[str, Any] = {}
    for name, text in parse_qsl(address.query, keep_blank_values=True):
        where = f"cannot open {address.geturl()!r}: option {name!r}"
        if name not in readers:
            there = ", ".join(readers) or "none"
            raise InputError(f"{where} is not known to {address.scheme}://; there are: {there}")
        if name in options:
            raise InputError(f"{where} is there twice; give it once")
        try:
            options[name] = readers[name](text)
        except ValueError as error:
            raise InputError(f"{where} cannot be {text!r}: {error}") from None
    return options


def positive(text: str) -> float:
    """A finite number above 0.

    Raises:
        ValueError: it is none.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise ValueError("expected a finite number above 0")
    return value


def one_of(*words: str) -> Callable[[str], str]:
    """A reader that takes one of `words`."""

    def read(text: str) -> str:
        if text not in words:
            raise ValueError(f"expected {' or '.join(words)}")
        return text

    return read
