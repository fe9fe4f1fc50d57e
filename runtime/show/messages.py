"""Lines on standard error for the operator of a running show."""

from __future__ import annotations

import sys
from contextlib import suppress

from tqdm import tqdm


def say(line: str) -> None:
    """Print one line at once, from any thread, without tearing a progress bar.

    Never raises: a show goes on when standard error is closed.
    """
    if sys.stderr is not None:
        with suppress(OSError, ValueError):
            tqdm.write(f"bunraku: {' '.join(line.split())}", file=sys.stderr)
            sys.stderr.flush()


def announce(line: str) -> None:
    """Print what a show does to standard output, without tearing a progress bar; never raises."""
    if sys.stdout is not None:
        with suppress(OSError, ValueError):
            tqdm.write(" ".join(line.split()), file=sys.stdout)
            sys.stdout.flush()


def warn(line: str) -> None:
    """Print a warning as `say` prints a line."""
    say(f"warning: {line}")
