"""Write frames to an MCAP file so that a crash loses less than a second."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Self

from devices.errors import InputError
from devices.skeleton import MOST_SECONDS, Skeleton, SkeletonFrame
from replay.mcap.frame_json import (
    FRAME_SCHEMA,
    PERFORMER_TOPIC,
    SKELETON_NAME,
    SKELETON_SCHEMA,
    SKELETON_TOPIC,
    SOURCE_NAME,
    encode_frame,
    encode_skeleton,
)
from replay.mcap.record_writer import McapRecordWriter

SYNC_SECONDS = 0.5


class McapWriter:
    """Writes frames to a native recording; a context manager.

    Written frames are passed to the system every half second (of `clock`, or of the performers'
    time, whichever is sooner) and after each 1 MiB; a separate thread flushes them to the disk, so
    that no frame waits for it.

    Args:
        path: of the file; an existing file is replaced.
        skeleton: of every frame.
        source: facts about the origin of the frames, as short texts.
        clock: host monotonic time [s].

    Attributes:
        frames: number of frames written so far.
        safe: number of them that were passed to the system, and so survive a crash of ours.
        moved: whether the file no longer lies at `path`; it is written nevertheless.

    Raises:
        InputError: the file cannot be created or written; the message names it.
    """

    def __init__(
        self,
        path: Path,
        skeleton: Skeleton,
        *,
        source: Mapping[str, str] | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.path = path
        self.skeleton = skeleton
        self.frames = self.safe = 0
        self.moved = False
        self._clock = clock
        self._channels: dict[int, int] = {}
        self._disk: Future[None] | None = None
        self._synced = (clock(), -math.inf)
        self._closed = False
        try:
            self._sink = McapRecordWriter(path)
        except OSError as error:
            raise InputError(f"cannot write {path}: {error.strerror or error}") from error
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="mcap-fsync")
        try:
            self._guard(lambda: self._begin(dict(source or {})))
            self.sync()
        except BaseException:
            self._release()
            raise

    def write(self, frame: SkeletonFrame, sequence: int | None = None) -> None:
        """Append one frame.

        Args:
            frame: of the skeleton.
            sequence: number of the frame among all that came, so that a reader detects missing
                frames; by default, when no frame is lost, the number of frames written before.

        Raises:
            ValueError: the frame's joints are not the skeleton's, or its time is beyond
                `MOST_SECONDS`.
            InputError: the disk is full, or the file is gone.
        """
        if len(frame.positions) != len(self.skeleton.names) or not abs(frame.time) <= MOST_SECONDS:
            raise ValueError(
                f"Expected a frame of {len(self.skeleton.names)} joints at a time that is known, "
                f"got {len(frame.positions)} at {frame.time}"
            )
        self._guard(lambda: self._append(frame, self.frames if sequence is None else sequence))
        self.frames += 1
        synced_clock, synced_time = self._synced
        if self._clock() - synced_clock >= SYNC_SECONDS or frame.time - synced_time >= SYNC_SECONDS:
            self._synced = (self._clock(), frame.time)
            self.sync()

    def sync(self) -> None:
        """Pass everything to the system now, and to the disk soon.

        Raises:
            InputError: the disk is full or the file is gone, now or at an earlier call.
        """
        self._guard(self._sink.flush)
        self.safe = self.frames
        if not self._sink.regular:
            return
        self.moved = not self._in_place()
        if os.fstat(self._sink.descriptor).st_nlink == 0:
            raise InputError(
                f"cannot write {self.path}: it was deleted during the recording; record again"
            )
        if self._disk is not None:
            if not self._disk.done():
                return
            self._guard(self._disk.result)
        self._disk = self._thread.submit(os.fsync, self._sink.descriptor)

    def close(self) -> None:
        """Write the index and close the file; may be called twice.

        Raises:
            InputError: the disk is full or the file is gone.
        """
        if self._closed:
            return
        try:
            self._guard(self._finish)
        finally:
            self._release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _begin(self, source: dict[str, str]) -> None:
        """Write header, source and skeleton, which reach the disk at once, and the schemas."""
        if source:
            self._sink.metadata(SOURCE_NAME, source)
        self._sink.metadata(SKELETON_NAME, {"json": encode_skeleton(self.skeleton)})
        schema = self._sink.schema(str(SKELETON_SCHEMA["title"]), json.dumps(SKELETON_SCHEMA))
        self._skeleton_channel = self._sink.channel(SKELETON_TOPIC, schema)
        self._schema = self._sink.schema(str(FRAME_SCHEMA["title"]), json.dumps(FRAME_SCHEMA))
        _sync_folder(self.path)

    def _append(self, frame: SkeletonFrame, sequence: int) -> None:
        arrival = frame.arrival if abs(frame.arrival) <= MOST_SECONDS else frame.time
        log_time, publish_time = _nanoseconds(arrival), _nanoseconds(frame.time)
        if self.frames == 0:
            text = encode_skeleton(self.skeleton).encode()
            self._sink.message(
                self._skeleton_channel,
                text,
                log_time=log_time,
                publish_time=publish_time,
                sequence=0,
            )
        if frame.performer not in self._channels:
            topic = f"{PERFORMER_TOPIC}{frame.performer}"
            self._channels[frame.performer] = self._sink.channel(topic, self._schema)
        self._sink.message(
            self._channels[frame.performer],
            encode_frame(frame),
            log_time=log_time,
            publish_time=publish_time,
            sequence=sequence % (1 << 32),
        )

    def _in_place(self) -> bool:
        try:
            return os.path.samestat(self.path.stat(), os.fstat(self._sink.descriptor))
        except OSError:
            return False

    def _finish(self) -> None:
        self._sink.finish()
        self.safe = self.frames
        if self._sink.regular:
            os.fsync(self._sink.descriptor)

    def _release(self) -> None:
        self._closed = True
        self._thread.shutdown()
        self._guard(self._sink.close)

    def _guard(self, write: Callable[[], object]) -> None:
        try:
            write()
        except OSError as error:
            raise InputError(f"cannot write {self.path}: {error.strerror or error}") from error


def _sync_folder(path: Path) -> None:
    """Flush the new file's directory entry: a power cut would otherwise lose the name."""
    if os.name == "nt":  # folders cannot be opened there; they are journalled
        return
    with suppress(OSError):  # some network file systems cannot
        folder = os.open(path.absolute().parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _nanoseconds(seconds: float) -> int:
    """MCAP's time: an integer from 0 to 2^64; the exact seconds are in the message."""
    return min(max(round(seconds * 1e9), 0), (1 << 64) - 1)
