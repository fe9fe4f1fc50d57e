"""Read the JSON of a glTF file with every type and range checked."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.bounded_json import parse_json
from devices.errors import ContentError

MOST_ENTRIES = 1_000_000
"""No list of a glTF document is longer."""


# What C libraries print for numbers that are none.
_NO_NUMBER = re.compile(
    r"(?<=[\[,:\s])[-+]?(?:nan(?:\([a-z]*\))?|inf(?:inity)?|1\.#[a-z]+)(?=[\s,\]}])", re.IGNORECASE
)


@dataclass(frozen=True, slots=True)
class Entry:
    """One JSON object of the document, and its place in it for messages.

    Every getter raises ContentError when the property has another type or range, or when it is
    missing and there is no default.
    """

    fields: dict[str, Any]
    place: str

    def __contains__(self, name: str) -> bool:
        return name in self.fields

    def wrong(self, what: str) -> ContentError:
        """Make the error that names this entry and its fault."""
        return ContentError(f"{self.place}: {what}; export the model again")

    def whole(self, name: str, default: int | None = None, *, below: int = 1 << 40) -> int:
        """A property that is an integer in [0, below)."""
        value = self.fields.get(name, default)
        if type(value) is not int or not 0 <= value < below:
            raise self.wrong(f"{name} is not a whole number in [0, {below})")
        return value

    def optional(self, name: str) -> int | None:
        """An index that may be missing."""
        return self.whole(name) if name in self.fields else None

    def text(self, name: str, default: str) -> str:
        """A property that is a string."""
        value = self.fields.get(name, default)
        if not isinstance(value, str):
            raise self.wrong(f"{name} is not a text")
        return value

    def flag(self, name: str) -> bool:
        """A property that is true or false; false where it is missing."""
        return self.fields.get(name, False) is True

    def numbers(self, name: str, default: tuple[float, ...]) -> NDArray[np.float64]:
        """As many finite numbers as `default` has."""
        values = self._list(name) if name in self.fields else list(default)
        if len(values) != len(default) or not all(_is_moderate(value) for value in values):
            raise self.wrong(f"{name} is not {len(default)} numbers of a sensible size")
        return np.array(values, dtype=np.float64)

    def number(self, name: str, default: float) -> float:
        """One finite number."""
        value = self.fields.get(name, default)
        if not _is_moderate(value):
            raise self.wrong(f"{name} is not a number of a sensible size")
        return float(value)

    def wholes(self, name: str, *, below: int) -> list[int]:
        """A list of integers in [0, below); empty where it is missing."""
        values = self._list(name)
        if any(type(v) is not int or not 0 <= v < below for v in values):
            raise self.wrong(f"{name} holds what is no index below {below}")
        return values

    def row(self, name: str) -> list[float]:
        """A list of finite numbers; empty where it is missing."""
        values = self._list(name)
        if not all(_is_moderate(value) for value in values):
            raise self.wrong(f"{name} holds what is no number of a sensible size")
        return [float(value) for value in values]

    def child(self, name: str) -> Entry | None:
        """A property that is an object, or None where it is missing."""
        value = self.fields.get(name)
        if value is not None and not isinstance(value, dict):
            raise self.wrong(f"{name} is not an object")
        return None if value is None else Entry(value, f"{self.place}, {name}")

    def extension(self, name: str) -> Entry | None:
        """The object of the extension called `name`, or None."""
        extensions = self.child("extensions")
        return None if extensions is None else extensions.child(name)

    def children(self, name: str) -> list[Entry]:
        """A list of objects; empty where it is missing."""
        values = self._list(name)
        if not all(isinstance(value, dict) for value in values):
            raise self.wrong(f"{name} holds what is no object")
        return [Entry(value, f"{name} {index}") for index, value in enumerate(values)]

    def texts(self, name: str) -> list[str]:
        """A list of strings; empty where it is missing."""
        return [str(value) for value in self._list(name)]

    def _list(self, name: str) -> list[Any]:
        values = self.fields.get(name, [])
        if not isinstance(values, list) or len(values) > MOST_ENTRIES:
            raise self.wrong(f"{name} is not a list of at most {MOST_ENTRIES}")
        return values


def _is_moderate(value: object) -> bool:
    return type(value) in (int, float) and abs(value) < 1e30  # type: ignore[arg-type]  # type() does not narrow, and bool must not pass


def parse_document(content: bytes) -> Entry:
    """Parse a document in UTF-8 JSON, padded perhaps with zero bytes.

    NaN and infinity, which some exporters write as the bounds of accessors, are let through: no
    getter returns them.

    Raises:
        ContentError: it is not JSON, not an object, or not glTF 2.
    """
    try:
        text = content.rstrip(b"\0 \r\n\t").decode("utf-8-sig")
        value = _parsed(text)
    except (ValueError, RecursionError):
        raise ContentError("its JSON is cut short or damaged; export the model again") from None
    if not isinstance(value, dict):
        raise ContentError("its JSON is no glTF document; export the model again")
    document = Entry(value, "the document")
    asset = document.child("asset")
    version = "" if asset is None else str(asset.fields.get("version", ""))
    if not version.startswith("2"):
        raise ContentError(f"is glTF version {version[:20] or 'unknown'}; export it as glTF 2.0")
    return document


def _parsed(text: str) -> Any:
    try:
        return parse_json(text)
    except ValueError:
        mended = _NO_NUMBER.sub("NaN", text)
        if mended == text:
            raise
        return parse_json(mended)
