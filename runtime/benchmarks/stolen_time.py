"""Time that a virtual machine's host took away from it."""

from __future__ import annotations

import os
from pathlib import Path

JIFFY = 1.0 / os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 0.01  # [s] what is counted in


def stolen_time() -> float:
    """For how long [s] processors with work to do have waited for the host since the start.

    The sum over all of them. Source: proc(5), `steal` of /proc/stat.
    """
    with Path("/proc/stat").open(encoding="ascii") as lines:
        return JIFFY * int(lines.readline().split()[8])
