"""Writing files that are never half there, and saying in one line why one cannot be written."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from devices.errors import InputError


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn a failure of the file system while `path` is written into one clear line.

    Raises:
        InputError: instead of any OSError; it names the file and the system's reason.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(
            f"cannot write {path}: {reason}; free some space or choose another place"
        ) from error


def check_writable(path: Path) -> None:
    """Make sure, before a show, that a file can be written at `path`; leaves nothing behind.

    Raises:
        InputError: the folder is missing or not a folder, `path` is itself a folder, or the system
            does not let files be made there.
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
    """The lower-case suffix of `path`, which must be one of `known`.

    Raises:
        InputError: it is another; the message lists the known ones.
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
    """A path to write to that becomes `path`, all at once, when the block ends without an error.

    Until then an older file at `path` stays as it is; after an error it still does, and what was
    written is removed. A device such as ``/dev/stdout`` is written directly.

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
    """A name that is free in the folder of `path`, hidden, with the same suffix."""
    return path.with_name(f".{os.getpid()}-{secrets.token_hex(4)}{path.suffix}")
