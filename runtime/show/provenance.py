"""Where a recording's frames came from, for whoever finds the file later."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from urllib.parse import urlsplit


def provenance(origin: str) -> dict[str, str]:
    """Facts for the head of a recording that begins now.

    Args:
        origin: the device's address, of which a password is left out, or the name of a file.

    Returns:
        ``origin``, ``program``, and the same moment on two clocks: ``began``, UTC as ISO 8601, and
        ``host_clock`` [s], the monotonic clock of the frames, so that frames can be dated.
    """
    try:
        program = f"bunraku {version('bunraku')}"
    except PackageNotFoundError:
        program = "bunraku"
    return {
        "origin": _without_password(origin),
        "program": program,
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
