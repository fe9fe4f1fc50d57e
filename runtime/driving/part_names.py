"""Names of parts of a body, in words for people."""

from __future__ import annotations

from devices.bodies.body_plan import BodyPlan, Chain
from devices.skeleton import Skeleton


def part_name(skeleton: Skeleton, plan: BodyPlan | None, chain: Chain) -> str:
    """Return what a chain is: "left arm", "right wing", else the name of its last joint."""
    tip = chain[-1]
    for words, part in plan.in_words().items() if plan is not None else ():
        if tip in part[1:] or part == chain:
            return words
    return skeleton.names[tip]
