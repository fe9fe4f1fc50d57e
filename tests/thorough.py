"""How much is tried: a share by default, everything where `BUNRAKU_THOROUGH` is set, as CI does."""

from __future__ import annotations

import os

THOROUGH = bool(os.environ.get("BUNRAKU_THOROUGH"))


def examples(count: int) -> int:
    """How many examples hypothesis makes of a test that is thorough with `count`."""
    return count if THOROUGH else max(count // 4, 10)
