"""A file that a video library writes, kept playable when writing it fails."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class VideoFile:
    """The file as FFmpeg sees it, through PyAV's file interface.

    A muxer that fails has left half a piece behind, and would go on writing its trailer when it is
    closed. Once a piece has failed nothing reaches the file any more, and `close` cuts it back to
    where it was last known to be whole.

    Attributes:
        abandoned: whether a piece has failed.
        error: why the disk failed, which PyAV does not always pass on; None while it has not.

    Raises:
        OSError: from every method, when the disk fails.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = path.open("wb", buffering=0)
        self.abandoned = False
        self.error: OSError | None = None
        self._whole = 0  # bytes up to where everything can be played

    def write(self, data: bytes) -> int:
        """Write all of `data`, or pretend to once the file is abandoned."""
        rest = memoryview(data)
        try:
            while rest and not self.abandoned:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self.abandoned, self.error = True, error
            raise
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Move to `offset` [bytes] from the start, the current place or the end."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """The current place [bytes]."""
        return self._file.tell()

    @contextmanager
    def piece(self) -> Iterator[None]:
        """A block that writes a piece which can be played; if it fails the file is abandoned."""
        try:
            yield
        except BaseException:  # even Ctrl-C may have come between two halves of a piece
            self.abandoned = True
            raise
        if not self.abandoned:
            here = self._file.tell()
            self._whole = self._file.seek(0, os.SEEK_END)
            self._file.seek(here)

    def close(self) -> None:
        """Close the file; what came after the last whole piece goes if it was abandoned."""
        with self._file:
            if self.abandoned and self._path.is_file():  # and not a device
                self._file.truncate(self._whole)
