"""Records the frames of a running show: queues each frame at once, writes on another thread."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Self

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from replay.mcap.writer import SYNC_SECONDS, McapWriter

WAITING = 16_384
"""Largest number of frames that wait for the disk, about 80 MB of 59 joints: a minute of four
performers at 60 Hz while the disk does not respond."""


class Recorder:
    """Records frames to an MCAP file; faults of the disk do not affect the caller.

    Frames wait in a bounded queue that a thread empties. When the disk fails, the file is kept up
    to that point, `tell` gets one line at once, and later frames are counted as lost. The file's
    sequence skips the numbers of lost frames, so that a reader detects them.

    Args:
        path: of the file; an existing file is replaced.
        skeleton: of every frame.
        source: see `McapWriter`.
        tell: takes one line that describes a fault, from any thread; it must not raise.
        waiting: largest number of frames that may wait for the disk.

    Raises:
        InputError: the file cannot be created.
    """

    def __init__(
        self,
        path: Path,
        skeleton: Skeleton,
        *,
        source: Mapping[str, str] | None = None,
        tell: Callable[[str], None],
        waiting: int = WAITING,
    ) -> None:
        self.path = path
        self._writer = McapWriter(path, skeleton, source=source)
        self._tell = tell
        self._queue: queue.Queue[tuple[int, SkeletonFrame] | None] = queue.Queue(waiting)
        self._lock = threading.Lock()
        self._offered = self._overrun = self._unwritten = 0
        self._fault = ""
        self._moved = self._closed = False
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    @property
    def frames(self) -> int:
        """Number of frames in the file."""
        return self._writer.safe if self._fault else self._writer.frames

    @property
    def lost(self) -> int:
        """Number of frames that came and are not in the file, by a slow or failed disk."""
        return self._overrun + self._unwritten + self._writer.frames - self.frames

    @property
    def fault(self) -> str:
        """Why the recording stopped early; empty if it did not."""
        return self._fault

    def offer(self, frame: SkeletonFrame) -> None:
        """Record a frame without waiting; if the queue is full, the frame is lost and counted."""
        with self._lock:
            if self._closed:
                return
            number, self._offered = self._offered, self._offered + 1
            try:
                self._queue.put_nowait((number, frame))
            except queue.Full:
                self._overrun += 1
                if self._overrun == 1:
                    self._tell(
                        f"the disk is too slow for {self.path}: frames are missing in the recording"
                    )

    def write(self, frame: SkeletonFrame) -> None:
        """Record a frame, waiting for room: for a source that can wait, such as a recording."""
        with self._lock:
            if self._closed:
                return
            number, self._offered = self._offered, self._offered + 1
        self._queue.put((number, frame))

    def close(self) -> None:
        """Write what waits and finish the file; report faults, raise none. May be called twice."""
        with self._lock:
            closed, self._closed = self._closed, True
        if closed:
            return
        self._queue.put(None)
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _run(self) -> None:
        while (entry := self._next()) is not None:
            if self._fault:
                self._unwritten += 1
            else:
                self._keep(*entry)
        try:
            self._writer.close()
        except InputError as error:
            self._fail(error)

    def _next(self) -> tuple[int, SkeletonFrame] | None:
        """The next frame, None at the end; while none comes, sync the file to the disk."""
        while True:
            try:
                return self._queue.get(timeout=SYNC_SECONDS)
            except queue.Empty:
                if not self._fault:
                    self._attempt(self._writer.sync)

    def _keep(self, number: int, frame: SkeletonFrame) -> None:
        written = self._writer.frames
        self._attempt(lambda: self._writer.write(frame, number))
        self._unwritten += self._writer.frames == written

    def _attempt(self, write: Callable[[], None]) -> None:
        try:
            write()
        except InputError as error:
            self._fail(error)
        except ValueError:
            pass  # a frame that cannot be written; the next one may be valid
        except Exception as error:  # a defect in here must not end the show
            self._fail(InputError(f"cannot write {self.path}: {error!r}; please report this"))
        if self._writer.moved and not (self._moved or self._fault):
            self._moved = True
            self._tell(f"{self.path} was moved; the recording continues in the moved file")

    def _fail(self, error: InputError) -> None:
        if not self._fault:
            kept = f", its first {self._writer.safe} frames are kept" if self.path.exists() else ""
            self._fault = f"{error}; the recording has stopped{kept}"
            self._tell(self._fault)
