"""The time in which a virtual machine's host withheld its processors (steal time)."""

from __future__ import annotations

import os
from pathlib import Path

JIFFY = 1.0 / os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 0.01  # [s] its unit


def stolen_time() -> float:
    """Return the time [s] since the start in which processors had work but waited for the host.

    It is summed over all processors. Source: proc(5), `steal` of /proc/stat.
    """
    with Path("/proc/stat").open(encoding="ascii") as lines:
        return JIFFY * int(lines.readline().split()[8])
