"""The fields of a session's JSON, read one by one and checked."""

from __future__ import annotations

import math
import re
from typing import Any

from devices.errors import InputError

MOST_PARTS = 100_000  # of each kind

Json = dict[str, Any]

_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_. -]{0,119}")


def objects(fields: Json, name: str) -> list[Json]:
    """Return the objects of a list.

    Raises:
        InputError: it is no list, is too long, or holds anything else.
    """
    values = items(fields, name)
    if not all(isinstance(value, dict) for value in values):
        raise InputError(f"`{name}` of the session holds what is no object")
    return values


def item(fields: Json, name: str) -> Json:
    """Return an object.

    Raises:
        InputError: it is none.
    """
    value = fields.get(name)
    if not isinstance(value, dict):
        raise InputError(f"`{name}` of the session is no object")
    return value


def items(fields: Json, name: str, length: int | None = None) -> list[Any]:
    """Return a list, of `length` items where that is given.

    Raises:
        InputError: it is no list, or of another length.
    """
    values = fields.get(name)
    if (
        not isinstance(values, list)
        or len(values) > MOST_PARTS
        or length not in (None, len(values))
    ):
        raise InputError(f"`{name}` of the session is no list of the right length")
    return values


def text(fields: Json, name: str) -> str:
    """Return a text.

    Raises:
        InputError: it is none, or is too long.
    """
    value = fields.get(name)
    if not isinstance(value, str) or len(value) > 1000:
        raise InputError(f"`{name}` of the session is no text")
    return value


def file_name(fields: Json, name: str) -> str:
    """Return the name of a file inside the session: no path leads out of it.

    Raises:
        InputError: it is none.
    """
    value = text(fields, name)
    if not _FILE.fullmatch(value) or ".." in value:
        raise InputError(f"`{name}` of the session is no name of a file: {value[:60]!r}")
    return value


def whole(fields: Json, name: str) -> int:
    """Return a whole number from 0: see `checked_whole`."""
    return checked_whole(fields.get(name))


def checked_whole(value: object) -> int:
    """Return a whole number from 0.

    Raises:
        InputError: it is none, or too large.
    """
    if type(value) is not int or not 0 <= value < 1 << 31:
        raise InputError(f"expected a whole number in the session, got {value!r:.40}")
    return value


def number(fields: Json, name: str) -> float:
    """Return a number: see `checked_number`."""
    return checked_number(fields.get(name))


def checked_number(value: object) -> float:
    """Return a number that is finite.

    Raises:
        InputError: it is none, or too large.
    """
    if type(value) not in (int, float) or not abs(value) < 1e12:  # type: ignore[arg-type]  # type() does not narrow, and bool must not pass
        raise InputError(f"expected a number in the session, got {value!r:.40}")
    number = float(value)  # type: ignore[arg-type]  # as above
    if not math.isfinite(number):
        raise InputError("expected a finite number in the session")
    return number


def flag(fields: Json, name: str) -> bool:
    """Return a switch.

    Raises:
        InputError: it is neither true nor false.
    """
    value = fields.get(name)
    if not isinstance(value, bool):
        raise InputError(f"`{name}` of the session is neither true nor false")
    return value
