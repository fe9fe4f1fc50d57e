"""Files of a show that may fail while the show goes on, and what was written to each."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self, runtime_checkable

from devices.errors import InputError
from runtime.output.output import Output, PerformedFrame

_UNITS = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


@dataclass(frozen=True, slots=True)
class Kept:
    """What a show left of one file or folder.

    Attributes:
        path: where it lies.
        said: what it holds, in words.
        fault: why it is not whole; empty if it is.
    """

    path: Path
    said: str
    fault: str = ""

    def __str__(self) -> str:
        return f"{self.path}: {self.said}"


@runtime_checkable
class Approximate(Protocol):
    """An output whose file differs from the performance."""

    @property
    def error(self) -> str:
        """By how much it differs, in words; empty until it is known."""
        ...


class KeptFile:
    """An output of files that, when its disk fails, stops alone: one line, and the show goes on.

    Args:
        path: the file or folder.
        output: writes it; it is closed with this output.
        at_the_end: whether nothing is written before `close`.
        tell: takes one line that reports a failure.

    Attributes:
        fault: why the file is not whole; empty if it is.
    """

    def __init__(
        self, path: Path, output: Output, *, at_the_end: bool, tell: Callable[[str], None]
    ) -> None:
        self.fault = ""
        self._path = path
        self._output = output
        self._at_the_end = at_the_end
        self._tell = tell
        self._written = 0

    @property
    def pictures_a_second(self) -> float:
        """Pictures per second that the output needs."""
        return self._output.pictures_a_second

    def write(self, frame: PerformedFrame) -> None:
        """Write one frame, unless the file has failed."""
        if self.fault:
            return
        try:
            self._output.write(frame)
        except InputError as error:
            self._fail(f"{error}; the show goes on without it")
            with suppress(InputError):  # the disk is still full; what lies there stays readable
                self._output.close()
        else:
            self._written += frame.picture is not None or self.pictures_a_second == 0.0

    def close(self) -> None:
        """Finish the file; may be called twice."""
        if self.fault:
            return
        try:
            self._output.close()
        except InputError as error:
            self._fail(str(error))

    @property
    def kept(self) -> Kept:
        """What lies there once the output is closed."""
        counted = counting(self._written, "frame" if self.pictures_a_second == 0.0 else "picture")
        if self.fault and self._at_the_end:
            return Kept(self._path, "not written", self.fault)
        if self.fault:
            said = f"stopped after {counted}, {size_of(self._path)} kept"
            return Kept(self._path, said, self.fault)
        error = self._output.error if isinstance(self._output, Approximate) else ""
        return Kept(self._path, ", ".join(filter(None, (counted, size_of(self._path), error))))

    def _fail(self, fault: str) -> None:
        self.fault = fault
        self._tell(fault)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def size_of(path: Path) -> str:
    """The size of a file, or of the numbered pictures in a folder, in words."""
    try:
        if path.is_dir():
            numbered = (each for each in path.iterdir() if re.fullmatch(r"\d{6,}\.png", each.name))
            size = sum(each.stat().st_size for each in numbered)
        else:
            size = path.stat().st_size if path.exists() else 0
    except OSError:  # it vanished
        return "size unknown"
    for unit, name in _UNITS:
        if size >= unit:
            return f"{size / unit:.1f} {name}"
    return counting(size, "byte")


def counting(count: int, thing: str) -> str:
    """A number of things in words."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def millimetres(metres: float) -> str:
    """A length in millimetres for reading; two digits below ten."""
    return f"{1e3 * metres:.2g}" if metres < 0.01 else f"{1e3 * metres:.0f}"
