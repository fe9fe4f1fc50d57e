"""Takes: recording a show's performer begins and ends while the show runs, each time into a file of
its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Self

from devices.errors import InputError
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder

MOST = 9999  # takes beside one another


class Takes:
    """Records a stream whenever it is asked to, and never over a file that is there.

    A take that cannot be begun is told and the show goes on. Ending one never waits for the disk:
    what is still to be written goes there from threads of their own, and `close` waits for them.

    Args:
        stream: what is recorded.
        path: the takes are called ``take-1.mcap`` and so on, beside ``take.mcap``.
        open_recorder: opens the file of a take.
        tell: takes one line on what is wrong.
        waits: whether the stream itself may wait for the disk, so that no frame is lost.
    """

    def __init__(
        self,
        stream: RecordedStream,
        path: Path,
        open_recorder: Callable[[Path], Recorder],
        *,
        tell: Callable[[str], None],
        waits: bool = False,
    ) -> None:
        self._stream = stream
        self._path = path
        self._open = open_recorder
        self._tell = tell
        self._waits = waits
        self._recorder: Recorder | None = None
        self._ending: list[threading.Thread] = []

    @property
    def recording(self) -> bool:
        """Whether frames go to a file that is all right."""
        return self._recorder is not None and not self._recorder.fault

    def record(self, recorder: Recorder) -> None:
        """Let every frame from now on go to `recorder`, which ends with this take."""
        self.stop()
        self._recorder = recorder
        self._stream.keep = recorder.write if self._waits else recorder.offer

    def start(self) -> None:
        """Begin a take in a file that was not there, unless one is being recorded."""
        if self.recording:
            return
        try:
            self.record(self._open(_fresh(self._path)))
        except InputError as error:
            self._tell(f"{error}; the show goes on without being recorded")

    def stop(self) -> None:
        """End the take, if one is being recorded."""
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return
        self._stream.keep = None
        self._ending = [thread for thread in self._ending if thread.is_alive()]
        self._ending.append(threading.Thread(target=recorder.close, name="take"))
        self._ending[-1].start()

    def close(self) -> None:
        """End the take and wait until all are written; may be called twice."""
        self.stop()
        for thread in self._ending:
            thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def set_aside(path: Path, tell: Callable[[str], None]) -> None:
    """Give the take that is at `path`, if there is one, a name of its own: it cannot be made again.

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
    tell(f"{path} was there from earlier and is called {kept.name} now")


def _fresh(beside: Path) -> Path:
    """An empty file beside a take, under the first name that nothing had."""
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
