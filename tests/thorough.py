"""How much is tried: a share by default, everything where `BUNRAKU_THOROUGH` is set, as CI does."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Sequence
from typing import TypeVar

Case = TypeVar("Case")

THOROUGH = bool(os.environ.get("BUNRAKU_THOROUGH"))


def examples(count: int) -> int:
    """How many examples hypothesis makes of a test that is thorough with `count`."""
    return count if THOROUGH else max(count // 4, 10)


def third_of(cases: Iterable[Case]) -> list[Case]:
    """Every third of many cases of one kind."""
    return list(cases)[:: 1 if THOROUGH else 3]


def combined(*choices: Sequence[object]) -> list[tuple[object, ...]]:
    """All combinations; by default only so many that each choice is made once."""
    if THOROUGH:
        return list(itertools.product(*choices))
    longest = max(map(len, choices))
    return [tuple(each[index % len(each)] for each in choices) for index in range(longest)]
