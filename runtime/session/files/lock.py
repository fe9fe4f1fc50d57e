"""A lock on the folder of an open session: one program at a time works in it."""

from __future__ import annotations

import errno
import os
import sys
import weakref
from contextlib import suppress
from pathlib import Path

from devices.errors import InputError
from runtime.output.files.whole_file import writing

NAME = "lock"
_TRIES = 8  # as another program may be removing the folder
_HELD = {errno.EACCES, errno.EAGAIN, errno.EWOULDBLOCK, errno.EDEADLK}

if sys.platform == "win32":
    import msvcrt

    def _take(file: int) -> None:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _take(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


class FolderLock:
    """Holds a folder until it is released, collected, or its process ends, however that ends.

    The operating system holds the lock, not the file, so a crash leaves none behind. Where the file
    system knows no locks, nothing is locked.

    Args:
        folder: that is to be held; made if it is not there.

    Raises:
        InputError: another program holds it, or it cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder / NAME
        for _ in range(_TRIES):
            with writing(folder):
                folder.mkdir(parents=True, exist_ok=True)
                try:
                    file = os.open(self._file, os.O_RDWR | os.O_CREAT, 0o666)
                except FileNotFoundError:
                    continue  # another program has just removed the folder
            self._release = weakref.finalize(self, os.close, file)
            if not _taken(file):
                break
            if self._is_there(file):
                return
            self._release()  # what is locked was removed by the program that held it
        self._release()
        raise InputError(f"another program has this session open and works in {folder}: close it")

    def release(self) -> None:
        """Let others have the folder; may be called twice."""
        self._release()

    def remove(self) -> None:
        """Delete the folder, which holds nothing else any more, and let others have its name."""
        if sys.platform == "win32":  # which deletes no open file
            self._release()
        self._file.unlink(missing_ok=True)
        with suppress(OSError):  # another program is there already
            self._file.parent.rmdir()
        self._release()

    def _is_there(self, file: int) -> bool:
        with suppress(OSError):
            return os.path.samestat(os.fstat(file), self._file.stat())
        return False


def _taken(file: int) -> bool:
    """Lock a file; whether nobody else holds it."""
    try:
        _take(file)
    except OSError as error:
        return error.errno not in _HELD
    return True
