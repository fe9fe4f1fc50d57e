"""Atomic file writing, and one-line errors for files that cannot be written."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from devices.errors import InputError

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn file system errors within this block into one clear line about `path`.

    Raises:
        InputError: in place of any OSError; it names the file and the system's reason.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        remedy = "free some space or choose" if error.errno in _FULL else "choose"
        raise InputError(f"cannot write {path}: {reason}; {remedy} another place") from error


def check_writable(path: Path) -> None:
    """Check, before a show, that a file can be written at `path`; leave nothing behind.

    Raises:
        InputError: the folder is missing or is no folder, `path` is itself a folder, or the system
            does not allow files there.
    """
    with writing(path):
        if path.is_dir():
            raise InputError(f"cannot write {path}: it is a folder; give the name of a file")
        if not path.parent.is_dir():
            raise InputError(
                f"cannot write {path}: there is no folder {path.parent}; make it first"
            )
        if path.is_file():
            with path.open("ab"):
                return
        if path.exists():  # a device or a pipe, which may block when opened
            return
        probe = _beside(path)
        probe.touch(exist_ok=False)
        probe.unlink()


def check_suffix(path: Path, known: tuple[str, ...]) -> str:
    """Return the lower-case suffix of `path`, which must be one of `known`.

    Raises:
        InputError: the suffix is not known; the message lists the known ones.
    """
    suffix = path.suffix.lower()
    if suffix not in known:
        raise InputError(
            f"cannot write {path}: its name must end in one of {', '.join(known)} "
            f"to say what to write"
        )
    return suffix


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path, and rename it to `path` when the block ends without an error.

    An older file at `path` stays until then. After an error it stays, and the temporary file is
    removed. A device such as ``/dev/stdout`` is written directly.

    Raises:
        InputError: the file cannot be written.
    """
    target = path.resolve()  # so that a link stays a link
    if target.exists() and not target.is_file():
        with writing(path):
            yield target
        return
    partial = _beside(target)
    try:
        with writing(path):
            yield partial
            partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)


def _beside(path: Path) -> Path:
    """Return a free, hidden name in the folder of `path`, with the same suffix."""
    return path.with_name(f".{os.getpid()}-{secrets.token_hex(4)}{path.suffix}")
