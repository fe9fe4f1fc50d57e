"""Lines for the operator of a running show, and the standard streams that they go to."""

from __future__ import annotations

import io
import os
import sys
from contextlib import suppress
from typing import TextIO

from devices.printable import printable


def say(line: str) -> None:
    """Print one line at once, from any thread, without tearing a progress bar.

    Never raises: a show goes on when standard error is closed, or the disk that it goes to is full.
    """
    _write(f"bunraku: {printable(line)}", sys.stderr)


def announce(line: str) -> None:
    """Print what a show does to standard output, without tearing a progress bar; never raises."""
    _write(printable(line), sys.stdout)


def warn(line: str) -> None:
    """Print a warning as `say` prints a line."""
    say(f"warning: {line}")


def open_standard_streams() -> None:
    """Make sure that standard input, output and error are open, so that no file takes their place.

    A name may hold what the terminal's encoding cannot show: it is shown in ASCII.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # the lowest free descriptor is this one
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def abandon(stream: TextIO | None) -> None:
    """Let a standard stream that fails lead nowhere, with all that waits in it."""
    with suppress(OSError, ValueError, AttributeError):  # closed, or None
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())  # type: ignore[union-attr]  # None raises
        os.close(nowhere)


def _write(line: str, stream: TextIO | None) -> None:
    if stream is None:
        return
    from tqdm import tqdm  # noqa: PLC0415  # slow to import, and a refusal needs to be quick

    try:
        tqdm.write(line, file=stream)
        stream.flush()
    except OSError:
        abandon(stream)
    except ValueError:
        pass  # closed
