"""Read the text files of Kinect data sets: lines, fields and rows of numbers."""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from replay.text_file import file_bytes

Array = NDArray[np.float64]

MOST_BYTES = 128 * 2**20
MOST_LINES = 6_000_000


def read_lines(path: Path) -> list[str]:
    """Return all lines of a text file, without a byte order mark.

    Raises:
        InputError: the file cannot be read, is too large, or is not text.
    """
    raw = file_bytes(path, MOST_BYTES)
    if raw.count(b"\n") > MOST_LINES:
        raise InputError(f"{path}: more than {MOST_LINES} lines; split the recording")
    try:
        return raw.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file, byte {error.start} is not UTF-8") from error


def first_rows(head: bytes, separator: str | None) -> list[list[str]]:
    """Return the fields of the whole lines in a file's first bytes; [] if they are not text."""
    lines = head.decode("utf-8-sig", errors="replace")
    if "\ufffd" in lines[:-4] or "\x00" in lines:
        return []
    whole = lines.splitlines()[: None if len(head) < 512 or lines.endswith("\n") else -1]
    return [line.split(separator) for line in whole if line.strip()]


def are_numbers(fields: list[str]) -> bool:
    """Whether every field is a number."""
    try:
        return bool([float(field) for field in fields])
    except ValueError:
        return False


def number_rows(
    path: Path, lines: list[str], columns: int, notes: list[str], separator: str | None = None
) -> Array:
    """Return the lines as numbers (rows, columns), without empty lines and a truncated last line.

    Raises:
        InputError: a line has another number of fields or other text, or there is no line.
    """
    numbers = array("d")
    last = next((at for at in range(len(lines), 0, -1) if lines[at - 1].strip()), 0)
    for at, line in enumerate(lines[:last], 1):
        if not line.strip():
            continue
        fields = line.strip().rstrip(separator).split(separator)
        if len(fields) == columns and are_numbers(fields):
            numbers.extend(map(float, fields))
        elif numbers and at == last:
            notes.append("the last line is truncated and was omitted")
        else:
            raise InputError(f"{path}, line {at}: expected {columns} numbers, got {line[:60]!r}")
    if not numbers:
        raise InputError(f"{path}: holds no frame")
    return np.frombuffer(numbers).reshape(-1, columns).copy()
