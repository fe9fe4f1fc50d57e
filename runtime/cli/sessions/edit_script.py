"""Checks the fields of one edit of a script, and does it to a session."""

from __future__ import annotations

import inspect
import json
import math
from typing import Any

from devices.errors import InputError
from runtime.session.document import Session
from runtime.session.edits import EDITS
from runtime.session.files.codec import as_json, from_json

_TIMES = ("start", "end", "at", "time", "ease_in", "ease_out")
_NODES = tuple[int, ...] | None


def edited(session: Session, edit: dict[str, Any], where: str) -> Session:
    """Return the session after one edit.

    Args:
        session: before it.
        edit: the name of the edit as `"edit"`, and its fields.
        where: the edit stands, for messages.

    Raises:
        InputError: it names no edit, has other fields than the edit, or cannot be done.
    """
    name = edit.get("edit")
    if not isinstance(name, str) or name not in EDITS:
        wrong = f"no edit is called {_said(name)}" if "edit" in edit else 'it has no "edit"'
        raise InputError(f"{where}: {wrong}; there are: {', '.join(EDITS)}")
    kinds = _kinds(name)
    given = {field: value for field, value in edit.items() if field != "edit"}
    if set(given) != set(kinds):
        raise InputError(
            f"{where}: {_said(name)} takes {', '.join(kinds)}; "
            f"it has {', '.join(given) or 'nothing'}"
        )
    for field, kind in kinds.items():
        if expected := _wrong(field, kind, given[field]):
            raise InputError(
                f'{where}: "{field}" of {_said(name)} is {expected}, not {_said(given[field])}'
            )
    values = [tuple(v) if isinstance(v := given[field], list) else v for field in kinds]
    performances = {take.performance.key: take.performance for take in session.takes}
    try:
        # Read as a file is, so that no session is written that cannot be read.
        return from_json(as_json(EDITS[name](session, *values)), performances.__getitem__)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _kinds(name: str) -> dict[str, Any]:
    """The type of each field of an edit, in the order of its parameters."""
    parameters = list(inspect.signature(EDITS[name], eval_str=True).parameters.values())[1:]
    number = "take" if name == "rename" else "clip"
    return {
        number if parameter.name == "number" else parameter.name: parameter.annotation
        for parameter in parameters
    }


def _wrong(field: str, kind: Any, value: object) -> str:
    """What a field of this type is to be, in words; empty where the value is that."""
    if kind == _NODES:
        right = value is None or (isinstance(value, list) and all(map(_is_whole, value)))
        return "" if right else "a list of numbers of nodes, or null for all"
    if kind is bool:
        return "" if isinstance(value, bool) else "true or false"
    if kind is str:
        return "" if isinstance(value, str) else "a text"
    if kind is int:
        return "" if _is_whole(value) else "a whole number"
    if value is None and kind is not float:
        return ""
    words = "seconds, 0 or more" if field in _TIMES else "a number"
    least = 0.0 if field in _TIMES else -math.inf
    right = type(value) in (int, float) and least <= value < math.inf  # type: ignore[operator]  # type() does not narrow, and bool must not pass
    return "" if right else words if kind is float else f"{words}, or null"


def _is_whole(value: object) -> bool:
    return type(value) is int


def _said(value: object) -> str:
    """A value as the script has it."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 40 else f"{text[:39]}…"
