"""Facts for the head of a recording: where its frames came from, and when."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from urllib.parse import urlsplit

from runtime.version import program_version


def provenance(origin: str) -> dict[str, str]:
    """Return the facts of a recording that begins now.

    Args:
        origin: the device's address, whose password is left out, or the name of a file.

    Returns:
        ``origin``; ``program``; ``began``, now in UTC as ISO 8601; and ``host_clock`` [s], now on
        the monotonic clock of the frames, so that each frame has a date.
    """
    return {
        "origin": _without_password(origin),
        "program": f"bunraku {program_version()}",
        "began": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "host_clock": f"{time.perf_counter():.6f}",
    }


def _without_password(origin: str) -> str:
    try:
        address = urlsplit(origin)
    except ValueError:
        return origin
    user, at, host = address.netloc.rpartition("@")
    return address._replace(netloc=host).geturl() if at and user else origin
