"""Watches what a reader does with a damaged input: it may only read it or refuse it in one line."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from devices.errors import InputError

MOST_SECONDS = 10
MOST_KIB = 2 << 20
"""Of memory that an input may take."""

_STARTS = ("subprocess.Popen", "os.exec", "os.posix_spawn", "os.spawn", "os.system", "os.fork")
_CHANGES = (
    "os.remove",
    "os.rename",
    "os.rmdir",
    "os.mkdir",
    "os.link",
    "os.symlink",
    "os.truncate",
)
_CALLS = ("socket.connect", "socket.bind", "webbrowser.open", "ctypes.dlopen")
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


class _TooLong(BaseException):
    """An input takes longer than `MOST_SECONDS`; no reader may take it for an error of its own."""


class Watch:
    """Runs the readers and decoders on one input after another, and reports what none may do.

    An audit hook stays in the interpreter for good; it is idle between inputs.

    Args:
        scratch: a folder in which readers may write; None for nowhere.
    """

    def __init__(self, scratch: Path | None = None) -> None:
        self._scratch = None if scratch is None else f"{scratch}{os.sep}"
        self._watching = False
        self._seen: list[str] = []
        sys.addaudithook(self._audit)

    def fault(self, read: Callable[[], None]) -> str:
        """What `read` did that it must not do, in one line; empty if nothing."""
        before, peak = self._noise.tell(), _peak_kib()
        self._seen.clear()
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            error = self._run(read)
        faults = [error, *self._seen, *(f"warning: {each.message}" for each in warned)]
        sys.stdout.flush()
        sys.stderr.flush()
        if self._noise.seek(0, os.SEEK_END) != before:
            faults.append("wrote to the terminal")
        if _peak_kib() - peak > MOST_KIB:
            faults.append(f"took {(_peak_kib() - peak) >> 10} MiB")
        return "; ".join(filter(None, faults))

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Standard output and error lead to a file within this block, and an alarm is set up."""
        sys.stdout.flush()
        sys.stderr.flush()
        kept = [os.dup(1), os.dup(2)]
        alarm = signal.signal(signal.SIGALRM, _too_long) if hasattr(signal, "SIGALRM") else None
        written, sys.dont_write_bytecode = sys.dont_write_bytecode, True
        try:
            with tempfile.TemporaryFile() as self._noise:
                os.dup2(self._noise.fileno(), 1)
                os.dup2(self._noise.fileno(), 2)
                yield
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            for descriptor, own in enumerate(kept, 1):
                os.dup2(own, descriptor)
                os.close(own)
            if alarm is not None:
                signal.signal(signal.SIGALRM, alarm)
            sys.dont_write_bytecode = written

    def _run(self, read: Callable[[], None]) -> str:
        try:
            _alarm(MOST_SECONDS)
            self._watching = True
            read()
        except InputError as error:
            return "the refusal has several lines" if "\n" in str(error) else ""
        except _TooLong:
            return f"took longer than {MOST_SECONDS} s"
        except (Exception, RecursionError) as error:  # whatever it is, it is a finding
            where = traceback.extract_tb(error.__traceback__)[-1]
            return f"{type(error).__name__} at {where.filename}:{where.lineno}: {error}"
        finally:
            self._watching = False
            _alarm(0)
        return ""

    def _audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._watching:
            return
        if event == "open":
            _, mode, flags = arguments
            writes = set("wax+") & set(mode) if isinstance(mode, str) else flags & _WRITING
            if writes and not self._is_scratch(arguments[0]):
                self._seen.append(f"opened {arguments[0]!r} for writing")
        elif event.startswith(_CHANGES) and self._is_scratch(arguments[0]):
            return
        elif event.startswith((*_STARTS, *_CHANGES, *_CALLS)):
            self._seen.append(f"{event} {arguments!r:.200}")

    def _is_scratch(self, path: object) -> bool:
        inside = self._scratch
        return inside is not None and f"{os.path.abspath(str(path))}{os.sep}".startswith(inside)  # noqa: PTH100  # follows no links


def _too_long(number: int, frame: FrameType | None) -> None:
    raise _TooLong


def _alarm(seconds: int) -> None:
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _peak_kib() -> int:
    """The most memory that this process has taken [KiB]; 0 where it is not known."""
    try:
        import resource  # noqa: PLC0415  # not on Windows
    except ImportError:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak >> 10 if sys.platform == "darwin" else peak
