"""What hands drive by their anatomy: hands finger by finger, bodies as a glove puppet's hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from devices.bodies.body_plan import BodyPlan
from devices.bodies.plan_by_names import plan_by_names
from devices.kinect.joints import KINECT_V2
from devices.leap.joints import HAND_PARENTS, hand_skeleton
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.characters.character import Character
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.choices import Choices
from runtime.driving.drivers import DRIVERS, best_driver
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.matching.hand_mapping import mapping_of_hands
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Performer, Pose, rest_state
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import BODY, FRONT_VIEW, make_figure, node

RIGHT = hand_skeleton(HAND_PARENTS)
BOTH = hand_skeleton(HAND_PARENTS, ("left", "right"))
WITHOUT_ELBOWS = hand_skeleton([j for j in HAND_PARENTS if "_" in j], ("left", "right"))


def planned() -> Character:
    figure = make_figure()
    plan = plan_by_names(figure.skeleton)
    assert plan is not None
    return replace(figure, plan=plan)


def a_hand() -> Character:
    """A character whose skeleton is a hand with an arm, in the figure's trunk."""
    rest = RIGHT.rest_positions + np.array([0.0, 1.0, 0.0])
    return replace(make_figure(), skeleton=Skeleton(RIGHT.names, RIGHT.parents, rest))


def pairing(performer: Skeleton, character: Character) -> Pairing:
    puppet = Puppet(character)
    joints = tuple(Performer(performer).joints)
    return Pairing(performer, joints, character, puppet.bound_skeleton, puppet.surface)


def in_names(mapping: Mapping | None, performer: Skeleton, character: Character) -> dict[str, str]:
    """The tip of each driven chain by the tip of what drives it."""
    assert mapping is not None
    names = character.skeleton.names
    return {performer.names[d.source[-1]]: names[d.target[-1]] for d in mapping.drives}


def test_a_hand_moves_a_hand_finger_by_finger_and_the_arm_its_arm() -> None:
    character = a_hand()
    driven = in_names(mapping_of_hands(pairing(RIGHT, character)), RIGHT, character)
    tips = {name: name for name in RIGHT.names if name.endswith("tip")}
    assert driven == {**tips, "palm": "palm"}


def test_of_two_hands_the_right_one_moves_a_hand() -> None:
    character = a_hand()
    driven = in_names(mapping_of_hands(pairing(BOTH, character)), BOTH, character)
    assert driven["right_thumb_tip"] == "thumb_tip"
    assert not any(name.startswith("left") for name in driven)


def test_the_right_arm_of_a_body_moves_the_arm_of_a_hand() -> None:
    character = a_hand()
    mapping = mapping_of_hands(pairing(BODY, character))
    assert mapping is not None
    arm, *fingers = mapping.drives
    assert [BODY.names[joint] for joint in arm.source[:3]] == [
        "ShoulderRight",
        "ElbowRight",
        "WristRight",
    ]
    assert RIGHT.names[arm.target[-1]] == "palm"
    assert len(fingers) == 5
    driven = in_names(mapping_of_hands(pairing(KINECT_V2, character)), KINECT_V2, character)
    assert driven == {"WristRight": "palm"}


def test_a_hand_moves_a_body_as_in_a_glove_puppet() -> None:
    character = planned()
    assert mapping_of_hands(pairing(BODY, character)) is None
    right = in_names(mapping_of_hands(pairing(RIGHT, character)), RIGHT, character)
    assert right["index_pip"] == "head"
    assert (right["thumb_tip"], right["pinky_tip"]) == ("wrist.L", "wrist.R")
    assert right["palm"] == "chest"
    left = hand_skeleton(HAND_PARENTS, left=True)
    assert in_names(mapping_of_hands(pairing(left, character)), left, character)["thumb_tip"] == (
        "wrist.R"
    )
    snake = replace(character, plan=BodyPlan((node("pelvis"), node("chest"))))
    assert mapping_of_hands(pairing(RIGHT, snake)) is None


def captured_at(time: float) -> SkeletonFrame:
    return SkeletonFrame(time, RIGHT.rest_positions, None, np.ones(len(RIGHT.names)))


def session_of(character: Character, driver: str) -> MatchSession:
    performer = Performer(RIGHT)
    puppet = Puppet(character)
    session = MatchSession(
        performer,
        [puppet],
        lambda: FRONT_VIEW,
        Choices(),
        [None],
        make_driver=DRIVERS[driver],
    )
    captured = captured_at(0.0)
    performer.follow(captured)
    session.direct(captured)
    return session


def test_the_anatomy_of_hands_beats_the_pose_and_the_user_beats_both() -> None:
    character = planned()
    wanted = mapping_of_hands(pairing(RIGHT, character))
    assert wanted is not None
    session = session_of(character, "auto")
    assert session.mappings[0].drives == wanted.drives
    assert session.matches[0].candidate is None
    session.next_match()
    session.direct(captured_at(0.1))
    assert session.matches[0].candidate is not None
    assert session_of(character, "relative").mappings[0].drives != wanted.drives


def posed(hands: Skeleton, apart: float) -> Pose:
    """Both hands before the chest, so far [m] apart; the elbows below the shoulders."""
    positions = hands.rest_positions.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        middle = sign * 0.5 * apart
        for joint, place in (
            ("elbow", (0.17 * sign, -0.25, 0.0)),
            ("wrist", (middle + 0.04 * sign, -0.05, 0.2)),
            ("palm", (middle, 0.0, 0.25)),
        ):
            name = f"{side}_{joint}"
            if name in hands.names:
                beyond = list(hands.tree.subtree(hands.index(name)))
                positions[beyond] += positions[0] + place - positions[beyond[0]]
    seen = np.ones(len(hands.names))
    return Performer(hands).follow(SkeletonFrame(0.0, positions, None, seen))


@pytest.mark.parametrize("hands", [BOTH, WITHOUT_ELBOWS], ids=["with elbows", "without"])
def test_two_hands_are_the_arms_and_meet_where_they_meet(hands: Skeleton) -> None:
    driver = best_driver(pairing(hands, planned()))
    assert isinstance(driver, BodyDriver)
    assert {part.name for part in driver.parts} == {"left arm", "right arm"}
    driver.prepare((), rest_state(posed(hands, 0.0)))
    gaps = []
    for apart in (0.0, 0.3):
        nodes = driver.targets(posed(hands, apart)).nodes
        assert nodes is not None
        left, right = nodes.positions[[node("wrist.L"), node("wrist.R")]]
        gaps.append(left[0] - right[0])
    assert abs(gaps[0]) < 0.12
    assert gaps[1] > 0.35
