"""The resident memory of this process."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from devices.errors import InputError


def resident_memory() -> int:
    """Return the memory of this process that is in RAM now [bytes].

    Raises:
        InputError: this system is not Linux.
    """
    if not sys.platform.startswith("linux"):
        raise InputError("resident memory is measured on Linux only; run this benchmark there")
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
