"""Hands by the names of their fingers, and two hands as the arms of a body."""

from __future__ import annotations

from devices.bodies.body_plan import SIDES
from devices.bodies.hand_plan import NAMED, body_of_hands, hands_by_names
from devices.bodies.joint_names import Kind, Side
from devices.bodies.plan_by_names import plan_by_names
from devices.builtin.body import builtin_skeleton
from devices.leap.joints import HAND_PARENTS, hand_skeleton
from devices.mediapipe.joints import HAND_LANDMARKS, landmark_skeleton

TIPS = [name for name in HAND_PARENTS if name.endswith("tip")]
LANDMARKS = [f"{side}_{name}" for side in ("left", "right") for name in HAND_LANDMARKS]


def test_a_hand_has_five_fingers_on_its_palm_and_the_arm_that_carries_it() -> None:
    skeleton = hand_skeleton(HAND_PARENTS)
    (hand,) = hands_by_names(skeleton)
    assert hand.side is Side.CENTRE
    assert [skeleton.names[joint] for joint in hand.arm] == ["elbow", "wrist", "palm"]
    assert tuple(hand.fingers) == NAMED
    index = [skeleton.names[joint] for joint in hand.fingers[Kind.INDEX]]
    assert index == ["palm", "index_mcp", "index_pip", "index_dip", "index_tip"]
    assert hand.knuckle == skeleton.index("middle_mcp")
    assert plan_by_names(skeleton) is None


def test_fingers_of_which_only_tips_are_seen_are_fingers_too() -> None:
    (hand,) = hands_by_names(hand_skeleton(TIPS))
    assert all(len(finger) == 2 for finger in hand.fingers.values())
    assert hand.knuckle is None


def test_two_hands_before_a_chest_are_the_arms_of_a_body() -> None:
    skeleton = hand_skeleton(HAND_PARENTS, ("left", "right"))
    plan = plan_by_names(skeleton)
    assert plan is not None
    for side in SIDES:
        arm = plan.arms[side]
        names = [[skeleton.names[joint] for joint in chain] for chain in arm.segments]
        elbow, wrist, palm, knuckle = (
            f"{side}_{joint}" for joint in ("elbow", "wrist", "palm", "middle_mcp")
        )
        assert names == [["hands", elbow], [elbow, wrist], [wrist, palm, knuckle]]
        thumb = plan.fingers[side, Kind.THUMB]
        assert skeleton.names[thumb[0]] == f"{side}_thumb_pip"
    without = plan_by_names(hand_skeleton(TIPS, ("left", "right")))
    assert without is not None
    assert [len(chain) for chain in without.arms[Side.LEFT].segments] == [2, 2]


def test_two_hands_without_a_chest_point_the_arms_where_they_point() -> None:
    skeleton = landmark_skeleton(LANDMARKS)
    plan = body_of_hands(skeleton)
    assert plan is not None
    arm = [skeleton.names[joint] for joint in plan.arms[Side.LEFT].chain]
    assert arm == ["left_wrist", "left_middle_finger_mcp"]
    assert body_of_hands(landmark_skeleton(LANDMARKS[: len(HAND_LANDMARKS)])) is None


def test_the_hands_of_a_body_are_carried_by_its_arms() -> None:
    skeleton = builtin_skeleton()
    right, left = hands_by_names(skeleton)
    assert (right.side, left.side) == (Side.RIGHT, Side.LEFT)
    assert [skeleton.names[joint] for joint in left.arm[:3]] == [
        "ShoulderLeft",
        "ElbowLeft",
        "WristLeft",
    ]
