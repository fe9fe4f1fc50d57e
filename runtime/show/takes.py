"""Takes: recordings that start and end while a show runs, each in a file of its own."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from devices.errors import InputError
from devices.skeleton import SkeletonFrame
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from runtime.output.files.kept_file import Kept, counting, size_of

STARTS, WITHIN = 3, 3.0  # most takes that start within so many seconds
MOST = 9999  # takes in one folder under one name


@dataclass(frozen=True, slots=True)
class RunningTake:
    """A file that is being recorded.

    Attributes:
        path: of the file.
        seconds: [s] since it began, by the host's clock.
        frames: in the file so far.
    """

    path: Path
    seconds: float
    frames: int


class Takes:
    """Starts and ends recordings of a stream; never replaces a file.

    At most `STARTS` takes start in `WITHIN` seconds, whoever asks: a remote control that floods the
    show would fill the folder.

    If a take cannot start, a warning says so and the show goes on. Ending a take does not wait for
    the disk: a thread writes the rest, and `close` waits for it. A recording of the whole show, if
    there is one, goes on beside the takes.

    Args:
        stream: the stream to record.
        path: with ``take.mcap`` the takes are called ``take-1.mcap`` and so on, beside it.
        open_recorder: opens the file of a take.
        tell: takes one line when a take has begun or ended.
        warn: takes one line on a fault.
        whole: records the whole show; it is closed with this. None without.
        waits: whether the stream may wait for the disk, so that no frame is lost.
        clock: host monotonic time [s].

    Attributes:
        kept: what lies where takes were written, in the order in which they ended.
    """

    def __init__(
        self,
        stream: RecordedStream,
        path: Path,
        open_recorder: Callable[[Path], Recorder],
        *,
        tell: Callable[[str], None],
        warn: Callable[[str], None],
        whole: Recorder | None = None,
        waits: bool = False,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._stream = stream
        self._path = path
        self._open = open_recorder
        self._tell, self._warn = tell, warn
        self._whole = whole
        self._waits = waits
        self._clock = clock
        self._started = deque([-math.inf] * STARTS, STARTS)
        self._hurried = False  # whether a start came too soon since the last one
        self._recorder: Recorder | None = None
        self._ending: list[threading.Thread] = []
        self.kept: list[Kept] = []
        self._whole_since = self._since = clock()
        self._keep()

    @property
    def recording(self) -> bool:
        """Whether a take is running without a fault."""
        return self._recorder is not None and not self._recorder.fault

    @property
    def running(self) -> list[RunningTake]:
        """What is being recorded without a fault: the whole show, then the take."""
        every = ((self._whole, self._whole_since), (self._recorder, self._since))
        return [
            RunningTake(recorder.path, self._clock() - since, recorder.frames)
            for recorder, since in every
            if recorder is not None and not recorder.fault
        ]

    def start(self) -> None:
        """Start a take in a new file with the next frame, unless one is running."""
        self._start(None)

    def start_with_newest(self) -> None:
        """Start a take in a new file with the newest frame that came, unless one is running."""
        self._start(self._stream.newest)

    def _start(self, first: SkeletonFrame | None) -> None:
        if self.recording or self._too_soon():
            return
        self.stop()
        try:
            self._recorder = self._open(_fresh(self._path))
        except InputError as error:
            self._warn(f"{error}; the show goes on without this take")
            return
        self._since = self._clock()
        if first is not None:
            (self._recorder.write if self._waits else self._recorder.offer)(first)
        self._keep()
        self._tell(f"recording to {self._recorder.path}")

    def _too_soon(self) -> bool:
        """Whether enough takes started a moment ago; the first start that is left out is told."""
        now = self._clock()
        if now - self._started[0] >= WITHIN:
            self._started.append(now)
            self._hurried = False
            return False
        if not self._hurried:
            self._hurried = True
            self._warn(f"{STARTS} takes began within {WITHIN:g} s: no other one is started yet")
        return True

    def stop(self) -> None:
        """End the running take, if there is one; a recording of the whole show goes on."""
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return
        self._keep()
        self._ending = [thread for thread in self._ending if thread.is_alive()]
        self._ending.append(threading.Thread(target=self._finish, args=(recorder,), name="take"))
        self._ending[-1].start()

    def close(self) -> None:
        """End everything and wait until it is written; may be called twice."""
        self.stop()
        whole, self._whole = self._whole, None
        self._keep()
        if whole is not None:
            self._end(whole)
        for thread in self._ending:
            thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _keep(self) -> None:
        """Pass every frame to the recorders that run from now on."""
        running = [recorder for recorder in (self._whole, self._recorder) if recorder is not None]
        keeps = [recorder.write if self._waits else recorder.offer for recorder in running]

        def keep(frame: SkeletonFrame) -> None:
            for each in keeps:
                each(frame)

        self._stream.keep = keep if keeps else None

    def _finish(self, recorder: Recorder) -> None:
        self._end(recorder)
        if not recorder.fault:
            self._tell(f"recorded {recorder.frames} frames to {recorder.path}")

    def _end(self, recorder: Recorder) -> None:
        recorder.close()
        lost = f", {recorder.lost} lost" if recorder.lost else ""
        said = f"{counting(recorder.frames, 'frame')}{lost}, {size_of(recorder.path)}"
        self.kept.append(Kept(recorder.path, said, recorder.fault))


def set_aside(path: Path, tell: Callable[[str], None]) -> None:
    """Rename an earlier take at `path`, if there is one, so that it is not replaced.

    Raises:
        InputError: it cannot be renamed.
    """
    if not path.is_file() or path.stat().st_size == 0:
        return
    kept = _fresh(path)
    try:
        path.replace(kept)
    except OSError as error:
        kept.unlink()
        raise InputError(f"cannot rename {path}, an earlier take: {error.strerror}") from error
    tell(f"{path} is an earlier take; it is now called {kept.name}")


def _fresh(beside: Path) -> Path:
    """Make an empty file beside a take, under the first free name."""
    for number in range(1, MOST + 1):
        path = beside.with_name(f"{beside.stem}-{number}{beside.suffix}")
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            continue
        except OSError as error:
            raise InputError(f"cannot write {path}: {error.strerror or error}") from error
        return path
    raise InputError(f"there are {MOST} takes beside {beside}; move some away")
