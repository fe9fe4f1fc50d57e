"""Weights of a face's blend shapes by name: checked, and renamed for a mirrored face.

A name is kept as its sender writes it: VRM's ("Joy", "happy"), ARKit's 52 ("jawOpen", also called
Perfect Sync), or a character's own. `runtime.characters.morphs` knows which of them mean the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import lru_cache

MOST_BLENDS = 512
"""Blend shapes of one face."""

LONGEST_NAME = 64
"""Letters of a name."""

Blends = Mapping[str, float]
"""Weights in [0, 1] by name; nobody writes to one that is in a frame, because frames cross threads.
"""


def blend_weight(name: object, value: object) -> float | None:
    """Return the weight of a blend shape, clipped to [0, 1]; None for what is refused.

    Refused are names that are no printable text of 1 to `LONGEST_NAME` letters, and weights that
    are no finite numbers.
    """
    if not (isinstance(name, str) and 0 < len(name) <= LONGEST_NAME and name.isprintable()):
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return min(max(float(value), 0.0), 1.0) if _is_moderate(value) else None


def checked_blends(pairs: Iterable[tuple[object, object]]) -> Blends | None:
    """Return the accepted ones of these names and weights, at most `MOST_BLENDS`; None for none."""
    blends: dict[str, float] = {}
    for name, value in pairs:
        weight = blend_weight(name, value)
        if weight is not None:
            blends[str(name)] = weight
        if len(blends) == MOST_BLENDS:
            break
    return blends or None


def mirrored_blends(blends: Blends) -> Blends:
    """Return the weights with left and right exchanged."""
    return {mirrored_name(name): weight for name, weight in blends.items()}


@lru_cache(maxsize=4 * MOST_BLENDS)
def mirrored_name(name: str) -> str:
    """Return the name of the same blend shape on the other side; itself for one of the middle.

    Known are "Left" and "Right" anywhere in a name, as in "eyeBlinkLeft", and the endings "_L" and
    "_R"; gazes ("LookLeft") are exchanged by the same rule.
    """
    for left, right in (("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT")):
        for one, other in ((left, right), (right, left)):
            if one in name:
                return name.replace(one, other)
    ends = {"_L": "_R", "_R": "_L", "_l": "_r", "_r": "_l"}
    return name[:-2] + ends[name[-2:]] if name[-2:] in ends else name


def _is_moderate(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer of JSON may be longer than any float
        return False
