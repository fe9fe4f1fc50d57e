"""One line to whoever runs the show, while it goes on."""

from __future__ import annotations

import sys
from contextlib import suppress

from tqdm import tqdm


def warn(line: str) -> None:
    """Say `line` on standard error at once, from any thread, without tearing a progress bar.

    Never raises: a show goes on when nobody listens.
    """
    if sys.stderr is not None:
        with suppress(OSError, ValueError):
            tqdm.write(f"bunraku: warning: {' '.join(line.split())}", file=sys.stderr)
            sys.stderr.flush()
