"""Names of parts of a body, in words for people."""

from __future__ import annotations

from devices.bodies.body_plan import BodyPlan, Chain, Limb
from devices.skeleton import Skeleton


def part_name(skeleton: Skeleton, plan: BodyPlan | None, chain: Chain) -> str:
    """Return what a chain is: "left arm", "right wing", else the name of its last joint."""
    if plan is not None:
        limbs = [(f"{side} {plan.arm_word}", limb) for side, limb in plan.arms.items()]
        limbs += [(f"{side} {plan.leg_word}", limb) for side, limb in plan.legs.items()]
        for name, limb in limbs:
            if chain[-1] in _nodes(limb):
                return name
        for name, part in (("head", plan.head[1:]), ("trunk", plan.trunk), ("tail", plan.tail[1:])):
            if chain[-1] in part:
                return name
    return skeleton.names[chain[-1]]


def _nodes(limb: Limb) -> set[int]:
    return {node for segment in limb.segments for node in segment}
