"""The file object behind a video, which stays playable when writing fails."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class VideoFile:
    """The file object that FFmpeg writes to, through PyAV's file interface.

    A muxer that fails leaves half a piece behind, and still writes its trailer when it is closed.
    After a failed piece, this class ignores all further writes, and `close` truncates the file to
    the last whole piece.

    Attributes:
        abandoned: whether a piece has failed.
        error: the error of the disk, which PyAV does not always pass on; None if there was none.

    Raises:
        OSError: from every method, when the disk fails.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = path.open("wb", buffering=0)
        self.abandoned = False
        self.error: OSError | None = None
        self._whole = 0  # bytes that can be played

    def write(self, data: bytes) -> int:
        """Write all of `data`, or ignore it once the file is abandoned."""
        rest = memoryview(data)
        try:
            while rest and not self.abandoned:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self.abandoned, self.error = True, error
            raise
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Move to `offset` [bytes] from the start, the current position or the end."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Return the current position [bytes]."""
        return self._file.tell()

    @contextmanager
    def piece(self) -> Iterator[None]:
        """Write a playable piece within this block; if the block fails, the file is abandoned."""
        try:
            yield
        except BaseException:  # even Ctrl-C may interrupt a half-written piece
            self.abandoned = True
            raise
        if not self.abandoned:
            here = self._file.tell()
            self._whole = self._file.seek(0, os.SEEK_END)
            self._file.seek(here)

    def close(self) -> None:
        """Close the file; if it was abandoned, first truncate it to the last whole piece."""
        with self._file:
            if self.abandoned and self._path.is_file():  # and not a device
                self._file.truncate(self._whole)
