"""Names of body parts in words for people."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np

from devices.bodies.body_plan import BodyPlan, Chain
from devices.skeleton import Skeleton

OF_SEVERAL = re.compile(r"([^\W\d_]+)[ ._-]?(\d+)[ ._-](\d+)")  # tentacle4.9: the tenth bone of one
OF_ONE = re.compile(r"([^\W\d_]+)[ ._-]?(\d+)")  # mantle7: the eighth bone of the only one
NO_WORDS = ("node", "joint", "bone")  # which tell nobody anything
ASIDE = 0.15  # of the skeleton's size from its middle, from which a part lies to one side


def part_name(skeleton: Skeleton, plan: BodyPlan | None, chain: Chain) -> str:
    """Return what a chain is: "left arm", "right wing", else what the name of its last joint tells.

    A chain that goes on beyond the part that it shares most joints with is called by that part.

    Numbered chains are counted, "tentacle 4 of 8, upper left"; one whose name tells nothing is
    called by its place, "limb, upper left".
    """
    tip = chain[-1]
    parts = {} if plan is None else plan.in_words()
    for words, part in parts.items():
        if tip in part[1:] or part == chain:
            return words
    shared = {words: len(set(part[1:]).intersection(chain[1:])) for words, part in parts.items()}
    most = max(shared, key=shared.__getitem__, default="")
    return most if shared.get(most) else _in_words(_Key(skeleton), tip)


class _Key:
    """A skeleton as a key of a cache: by what it is, and not by what it is like."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton

    def __hash__(self) -> int:
        return id(self.skeleton)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and other.skeleton is self.skeleton


@lru_cache(maxsize=512)
def _in_words(key: _Key, tip: int) -> str:
    """What the name of a joint tells of the chain that it ends."""
    skeleton = key.skeleton
    name = skeleton.names[tip]
    several, one = OF_SEVERAL.fullmatch(name), OF_ONE.fullmatch(name)
    if several is not None and several[1].lower() not in NO_WORDS:
        matches = [OF_SEVERAL.fullmatch(other) for other in skeleton.names]
        count = len({match[2] for match in matches if match and match[1] == several[1]})
        return f"{several[1]} {several[2]} of {count}{_place(skeleton, tip, ', ')}"
    if (several or one) is None:
        return name
    if one is not None and one[1].lower() not in NO_WORDS:
        return one[1]
    return f"limb{_place(skeleton, tip, ', ')}"


def _place(skeleton: Skeleton, joint: int, before: str) -> str:
    """Where a joint lies, such as "upper left", after some words; empty in the middle."""
    low, high = skeleton.rest_positions.min(axis=0), skeleton.rest_positions.max(axis=0)
    aside = skeleton.rest_positions[joint] - (low + high) / 2.0
    slack = ASIDE * float(np.max(high - low))
    words = (
        ("upper", "lower")[int(aside[1] < 0.0)] if abs(aside[1]) > slack else "",
        ("front", "rear")[int(aside[2] < 0.0)] if abs(aside[2]) > slack else "",
        ("left", "right")[int(aside[0] < 0.0)] if abs(aside[0]) > slack else "",
    )
    place = " ".join(word for word in words if word)
    return before + place if place else ""
