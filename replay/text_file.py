"""Reads text files in any common encoding: UTF-8, UTF-16, Shift-JIS, Latin-1."""

from __future__ import annotations

from pathlib import Path

from devices.errors import InputError

MOST_BYTES = 512 << 20
_MARKS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))
_CONTROLS = bytes(range(0x80, 0xA0))  # control characters in Latin-1, first bytes in Shift-JIS


def file_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """Return a file of at most `most` bytes.

    Raises:
        InputError: the file cannot be read or is larger.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(most + 1)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if len(raw) > most:
        raise InputError(f"{path}: larger than {most >> 20} MiB; split the recording")
    return raw


def file_text(path: Path, most: int = MOST_BYTES) -> str:
    """Return the text of a file of at most `most` bytes.

    Raises:
        InputError: the file cannot be read or is larger.
    """
    return decoded(file_bytes(path, most))


def decoded(raw: bytes) -> str:
    """Return a text without its byte order mark, lines ended by "\\n"; what is no text becomes �.

    Without a mark it is UTF-16 if every second byte is zero, else UTF-8, else Shift-JIS if it holds
    bytes that are control characters in Latin-1, else Latin-1.
    """
    return _characters(raw).replace("\r\n", "\n").replace("\r", "\n")


def without_mark(raw: bytes) -> bytes:
    """Return bytes in UTF-8 without a byte order mark; those without any mark as they are."""
    marked = any(raw.startswith(mark) for mark, _ in _MARKS)
    return decoded(raw).encode(errors="replace") if marked else raw


def _characters(raw: bytes) -> str:
    for mark, encoding in _MARKS:
        if raw.startswith(mark):
            return raw[len(mark) :].decode(encoding, errors="replace")
    start = raw[:64]
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if len(start) >= 4 and not any(start[first::2]) and all(start[1 - first :: 2]):
            return raw.decode(encoding, errors="replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        pass
    if raw.translate(None, _CONTROLS) != raw:
        try:
            return raw.decode("cp932")
        except UnicodeDecodeError:
            pass
    return raw.decode("latin-1")
