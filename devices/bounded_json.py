"""Parses JSON from untrusted senders without taking many times its size in memory."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

MOST_MEMORY = 1 << 30  # [bytes] that a document may take, or `MOST_TIMES` its own size
MOST_TIMES = 8
# What CPython takes at most for each: a list with its place in another one, an object with one
# member, and what a comma or colon separates: a number or a short text.
_BYTES = {"[": 96, "{": 208, ",": 32, ":": 32}


def parse_json(text: bytes | str, *, parse_constant: Callable[[str], Any] | None = None) -> Any:
    """Parse a JSON document whose content takes a bounded multiple of its size.

    Args:
        text: the document; bytes are UTF-8, UTF-16 or UTF-32.
        parse_constant: of `json.loads`: what NaN and infinities become.

    Raises:
        ValueError: it is no JSON, is nested too deeply, has a number of thousands of digits, or
            would take too much memory.
    """
    check_json(text)
    try:
        return json.loads(text, parse_constant=parse_constant)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def check_json(text: bytes | str) -> None:
    """Refuse one or more JSON documents whose content would take too much memory.

    Raises:
        ValueError: it would.
    """
    if isinstance(text, str):
        taken = sum(size * text.count(sign) for sign, size in _BYTES.items())
    else:
        taken = sum(size * text.count(sign.encode()) for sign, size in _BYTES.items())
    if taken > max(MOST_MEMORY, MOST_TIMES * len(text)):
        raise ValueError(f"its content would take {taken >> 20} MiB of memory")
