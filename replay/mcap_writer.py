"""The recorder: every frame to an MCAP file at once, so that a crash costs less than a second."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Self

from mcap.writer import CompressionType, Writer

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from replay.mcap_file import (
    FRAME_SCHEMA,
    PERFORMER_TOPIC,
    SKELETON_NAME,
    SKELETON_SCHEMA,
    SKELETON_TOPIC,
    encode_frame,
    encode_skeleton,
)

CHUNK_BYTES = 32 * 1024
SYNC_SECONDS = 0.5


class McapWriter:
    """Writes frames to a native recording; a context manager. Layout: see `replay.mcap_file`.

    What has been written is handed to the system when a chunk of 32 KiB is full and every half
    second (of `clock`, or of the performers' time, whichever is sooner), and to the disk from a
    thread of its own, so that no frame waits for it.

    Raises:
        InputError: the file cannot be made or written; the message names it.
    """

    def __init__(
        self, path: Path, skeleton: Skeleton, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.path = path
        self.skeleton = skeleton
        self._clock = clock
        self._channels: dict[int, int] = {}
        self._disk: Future[None] | None = None
        self._synced = (clock(), -math.inf)
        self.frames = 0
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise InputError(f"cannot write {path}: {error.strerror or error}") from error
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="mcap-fsync")
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        try:
            self._begin()
        except BaseException:
            self._release()
            raise

    def write(self, frame: SkeletonFrame) -> None:
        """Append one frame.

        Raises:
            ValueError: the frame's joints are not the skeleton's, or its time is not finite.
            InputError: the disk is full or gone.
        """
        if len(frame.positions) != len(self.skeleton.names) or not math.isfinite(frame.time):
            raise ValueError(
                f"Expected a frame of {len(self.skeleton.names)} joints at a finite time, "
                f"got {len(frame.positions)} at {frame.time}"
            )
        self._guard(lambda: self._append(frame))
        self.frames += 1
        synced_clock, synced_time = self._synced
        if self._clock() - synced_clock >= SYNC_SECONDS or frame.time - synced_time >= SYNC_SECONDS:
            self.sync()
            self._synced = (self._clock(), frame.time)

    def sync(self) -> None:
        """Hand everything to the system now, and to the disk soon.

        Raises:
            InputError: the disk is full or gone, now or at an earlier call.
        """
        self._guard(self._writer.flush)
        if self._disk is not None:
            if not self._disk.done():
                return
            self._guard(self._disk.result)
        self._disk = self._thread.submit(os.fsync, self._file.fileno())

    def close(self) -> None:
        """Write the index and close the file; may be called twice.

        Raises:
            InputError: the disk is full or gone.
        """
        if self._file.closed:
            return
        try:
            self._guard(self._finish)
        finally:
            self._release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _begin(self) -> None:
        """Header and skeleton, at once on their way to the disk, and the schemas."""
        text = {"json": encode_skeleton(self.skeleton)}
        self._guard(lambda: self._writer.start(profile="", library="bunraku"))
        self._guard(lambda: self._writer.add_metadata(SKELETON_NAME, text))
        skeleton_schema = _register(self._writer, SKELETON_SCHEMA)
        self._skeleton_channel = self._writer.register_channel(
            SKELETON_TOPIC, "json", skeleton_schema
        )
        self._frame_schema = _register(self._writer, FRAME_SCHEMA)
        self.sync()

    def _append(self, frame: SkeletonFrame) -> None:
        arrival = frame.arrival if math.isfinite(frame.arrival) else frame.time
        clocks = {"log_time": _nanoseconds(arrival), "publish_time": _nanoseconds(frame.time)}
        if self.frames == 0:
            text = encode_skeleton(self.skeleton).encode()
            self._writer.add_message(self._skeleton_channel, data=text, **clocks)
        if frame.performer not in self._channels:
            self._channels[frame.performer] = self._writer.register_channel(
                f"{PERFORMER_TOPIC}{frame.performer}", "json", self._frame_schema
            )
        self._writer.add_message(
            self._channels[frame.performer],
            data=encode_frame(frame),
            sequence=self.frames % (1 << 32),
            **clocks,
        )

    def _finish(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.flush()
        os.fsync(self._file.fileno())

    def _release(self) -> None:
        self._thread.shutdown()
        self._guard(self._file.close)

    def _guard(self, write: Callable[[], object]) -> None:
        try:
            write()
        except OSError as error:
            raise InputError(f"cannot write {self.path}: {error.strerror or error}") from error


def _register(writer: Writer, schema: dict[str, object]) -> int:
    number: int = writer.register_schema(
        str(schema["title"]), "jsonschema", json.dumps(schema).encode()
    )
    return number


def _nanoseconds(seconds: float) -> int:
    """MCAP's clock: a whole number from 0 to 2^64; the exact seconds are in the message."""
    return min(max(round(seconds * 1e9), 0), (1 << 64) - 1)
