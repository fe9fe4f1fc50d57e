"""Plans of bodies by the names of their joints: rigs, recordings, and whatever else there is."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.bodies.body_plan import SEGMENTS_IN_WORDS, SIDES, BodyPlan
from devices.bodies.joint_names import Side
from devices.bodies.plan_by_names import plan_by_names
from devices.kinect.joints import KINECT_AZURE, KINECT_V1, KINECT_V2
from devices.skeleton import Skeleton
from replay.formats import read_recording
from runtime.characters.open_character import load_character
from tests.devices.bodies.rigs_by_name import RIGS, Rig, mirrored, skeleton_of


def plan_of(skeleton: Skeleton) -> BodyPlan:
    plan = plan_by_names(skeleton)
    assert plan is not None
    return plan


def names(skeleton: Skeleton, joints: tuple[int, ...]) -> list[str]:
    return [skeleton.names[joint] for joint in joints]


def starts(skeleton: Skeleton, plan: BodyPlan, pair: str, side: Side) -> list[str]:
    limb = getattr(plan, pair)[side]
    return names(skeleton, tuple(segment[0] for segment in limb.segments))


def well_formed(skeleton: Skeleton, plan: BodyPlan) -> None:
    """Every part is a chain of bones, limbs lead away from the trunk, and no bone is shared."""
    tree = skeleton.tree
    parts = plan.in_words()
    bones = []
    for chain in parts.values():
        for near, far in pairwise(chain):
            assert tree.parents[far] == near or tree.parents[near] == far
            bones.append({near, far})
    thumbs = [words for words in parts if any(words.endswith(kind) for kind in ("thumb", "finger"))]
    if not thumbs:
        assert len({frozenset(bone) for bone in bones}) == len(bones)
    for limb in (*plan.arms.values(), *plan.legs.values()):
        assert all(tree.parents[far] == near for near, far in pairwise(limb.chain))
        assert all(a[-1] == b[0] for a, b in pairwise(limb.segments))
        assert limb.upper[0] not in limb.chain[1:]
    if plan.head:
        assert plan.head[0] == plan.trunk[-1]
        assert plan.skull in plan.head


@pytest.mark.parametrize("name", RIGS)
def test_each_convention_gives_its_body(name: str) -> None:
    rig = RIGS[name]
    skeleton = skeleton_of(rig)
    plan = plan_of(skeleton)
    well_formed(skeleton, plan)
    assert " ".join(names(skeleton, (plan.trunk[0], plan.trunk[-1]))) == rig.trunk.replace("~", " ")
    skull = "" if plan.skull is None else skeleton.names[plan.skull]
    assert skull == rig.skull.replace("~", " ")
    for pair, wanted in (("arms", rig.arm), ("legs", rig.leg)):
        left = [part.replace("~", " ") for part in wanted.split()]
        if not left:
            assert not getattr(plan, pair)
            continue
        assert starts(skeleton, plan, pair, Side.LEFT) == left
        assert starts(skeleton, plan, pair, Side.RIGHT) == [mirrored(part) for part in left]
    assert (plan.arm_word, plan.leg_word) == rig.words
    tail = (plan.tail[0], plan.tail[-1]) if plan.tail else ()
    assert " ".join(names(skeleton, tail)) == rig.tail


def test_parts_are_called_what_people_call_them() -> None:
    plan = plan_of(skeleton_of(RIGS["cat with words"]))
    limbs = [f"{side} {word}" for word in ("foreleg", "hind leg") for side in ("left", "right")]
    assert list(plan.in_words()) == ["trunk", "head", *limbs, "tail"]
    assert SEGMENTS_IN_WORDS[plan.arm_word] == ("upper foreleg", "lower foreleg", "forefoot")
    human = plan_of(skeleton_of(RIGS["Mixamo"])).in_words()
    assert {"left arm", "right leg", "left thumb", "right middle finger"} <= set(human)


def test_a_spider_has_no_plan() -> None:
    legs = tuple(
        f"body Leg_{pair}_1_L Leg_{pair}_2_L Leg_{pair}_3_L Leg_{pair}_Tip_L" for pair in "ABCD"
    )
    assert plan_by_names(skeleton_of(Rig(("hips body head", *legs), "", "", "", ""))) is None


@pytest.mark.parametrize("middle", ["Mid", "Middle", "mid"])
def test_an_insect_has_no_plan(middle: str) -> None:
    legs = tuple(
        f"thorax {pair}_Leg_1_L {pair}_Leg_2_L {pair}_Leg_3_L" for pair in ("Front", middle, "Hind")
    )
    rig = Rig(("abdomen thorax head", *legs), "", "", "", "")
    assert plan_by_names(skeleton_of(rig)) is None
    without = Rig((*rig.bones[:2], rig.bones[3]), "", "", "", "")
    assert plan_of(skeleton_of(without)).arm_word == "foreleg"


def test_a_hand_and_an_arm_alone_have_no_plan() -> None:
    fingers = ("thumb", "index", "middle", "ring", "pinky")
    hand = Rig(("palm index_mcp", *(f"palm {f}_mcp {f}_pip {f}_tip" for f in fingers)), *[""] * 4)
    assert plan_by_names(skeleton_of(hand)) is None
    arm = Skeleton(
        ("LeftForeArm", "LeftHand", "RightUpperArm", "RightForeArm", "LeftUpperArm"),
        np.array([-1, 0, 0, 2, 0]),
        np.eye(5)[:, :3],
    )
    assert plan_by_names(arm) is None


def test_limbs_that_are_named_alike_are_divided_by_shape() -> None:
    for name, words in (("mannequin", "arm"), ("trex", "arm")):
        character = load_character(name)
        skeleton, plan = character.skeleton, character.plan
        assert plan is not None
        well_formed(skeleton, plan)
        assert plan.arm_word == words
        for side in SIDES:
            for pair in (plan.arms, plan.legs):
                assert [len(segment) > 1 for segment in pair[side].segments] == [True] * 3
                tip = skeleton.names[pair[side].chain[-1]]
                assert tip.startswith(side)
                assert not skeleton.children[pair[side].chain[-1]]
    mannequin = load_character("mannequin")
    assert mannequin.plan is not None
    rest = mannequin.skeleton.rest_positions
    assert starts(mannequin.skeleton, mannequin.plan, "legs", Side.LEFT)[2] == "left_leg6"
    assert rest[mannequin.plan.skull or 0, 1] == pytest.approx(1.4, abs=0.05)


@pytest.mark.parametrize("name", ["squid", "cactus"])
def test_characters_without_limbs_have_no_plan(name: str) -> None:
    assert load_character(name).plan is None


@pytest.mark.parametrize(
    ("file", "trunk", "skull", "arm", "leg", "word"),
    [
        (
            "m2m_rig-human.glb",
            "pelvis spine_03",
            "head",
            "upperarm_l lowerarm_l hand_l",
            "thigh_l calf_l foot_l",
            "arm",
        ),
        (
            "m2m_rig-fox.glb",
            "Hips Spine_2.001",
            "Head",
            "Front_Leg_Upper_L Front_Leg_Lower_L Front_Leg_Ankle_L",
            "Back_Leg_Upper_L Back_Leg_Lower_L Back_Leg_Ankle_L",
            "foreleg",
        ),
        (
            "m2m_rig-bird.glb",
            "hips spine_1",
            "head",
            "wing_1_L wing_3_L wing_5_L",
            "UpperLeg_L LowerLeg_L AnkleLeg_L",
            "wing",
        ),
        (
            "khronos_Fox.glb",
            "b_Hip_01 b_Spine02_03",
            "b_Head_05",
            "b_LeftUpperArm_09 b_LeftForeArm_010",
            "b_LeftLeg01_015 b_LeftLeg02_016 b_LeftFoot01_017",
            "arm",
        ),
        (
            "raylib_robot_RobotExpressive.glb",
            "Hips Torso",
            "Head",
            "UpperArm.L LowerArm.L Palm2.L",
            "UpperLeg.L LowerLeg.L",
            "arm",
        ),
    ],
)
def test_shared_rigs(
    shared: Path, file: str, trunk: str, skull: str, arm: str, leg: str, word: str
) -> None:
    character = load_character(shared / "rig" / file)
    skeleton, plan = character.skeleton, character.plan
    assert plan is not None
    well_formed(skeleton, plan)
    assert " ".join(names(skeleton, (plan.trunk[0], plan.trunk[-1]))) == trunk
    assert skeleton.names[plan.skull or 0] == skull
    for pair, wanted in (("arms", arm), ("legs", leg)):
        left = [part.replace("~", " ") for part in wanted.split()]
        assert starts(skeleton, plan, pair, Side.LEFT) == left
    assert plan.arm_word == word


@pytest.mark.parametrize("file", ["m2m_rig-spider.glb", "m2m_rig-snake.glb"])
def test_names_of_spider_and_snake_rigs_give_no_plan(shared: Path, file: str) -> None:
    assert plan_by_names(load_character(shared / "rig" / file).skeleton) is None


@pytest.mark.parametrize("skeleton", [KINECT_V1, KINECT_V2, KINECT_AZURE])
def test_depth_cameras_see_bodies(skeleton: Skeleton) -> None:
    plan = plan_of(skeleton)
    well_formed(skeleton, plan)
    assert starts(skeleton, plan, "arms", Side.LEFT) == ["ShoulderLeft", "ElbowLeft", "WristLeft"]
    assert starts(skeleton, plan, "legs", Side.RIGHT) == ["HipRight", "KneeRight", "AnkleRight"]
    assert len(plan.head) > 1


def test_all_shared_recordings_of_people_have_a_whole_plan_with_the_left_at_their_left(
    shared: Path,
) -> None:
    people = [
        path
        for path in sorted((shared / "bvh").glob("*.bvh"))
        if path.stem != "pybvh_full_precision_frame_time"
    ]
    assert len(people) > 10
    for path in people:
        skeleton = read_recording(path).skeleton
        plan = plan_of(skeleton)
        well_formed(skeleton, plan)
        assert len(plan.arms) == len(plan.legs) == 2, path.stem
        assert len(plan.trunk) > 1, path.stem
        assert plan.head, path.stem
        rest = skeleton.rest_positions
        for pair in (plan.arms, plan.legs):
            assert all(len(pair[side].segments) >= 2 for side in SIDES), path.stem
            assert rest[pair[Side.LEFT].upper[0], 0] > rest[pair[Side.RIGHT].upper[0], 0], path.stem


@pytest.mark.parametrize(
    ("file", "arms"), [("leap_view_v1/sample.ldj", 0), ("leapjs_playback/three-claps.json.lz", 2)]
)
def test_two_hands_of_shared_recordings_are_arms(shared: Path, file: str, arms: int) -> None:
    plan = plan_by_names(read_recording(shared / "leap" / file).skeleton)
    assert len(plan.arms if plan else ()) == arms


WORDS = st.sampled_from(
    "hips root spine spine.001 neck head upperarm lowerarm hand arm thigh calf foot toe leg wing "
    "fin front_leg tail thumb middle jaw shoulder twist bone".split()
)
PARTS = st.tuples(WORDS, st.sampled_from(["", "_L", "_R", "_tip_L", "_end"]))


@given(st.lists(st.tuples(PARTS, st.integers(0, 40), st.integers(0, 26)), min_size=1, max_size=40))
def test_any_names_on_any_tree_give_a_plan_of_chains_or_none(
    joints: list[tuple[tuple[str, str], int, int]],
) -> None:
    called = tuple(f"{word}{number}{side}" for number, ((word, side), _, _) in enumerate(joints))
    parents = [-1, *(parent % number for number, (_, parent, _) in enumerate(joints) if number)]
    rest = np.array([[code % 3, code // 3 % 3, code // 9] for _, _, code in joints], dtype=float)
    skeleton = Skeleton(called, np.array(parents), rest)
    plan = plan_by_names(skeleton)
    if plan is not None:
        assert len(plan.arms) == 2 or len(plan.legs) == 2
        well_formed(skeleton, plan)
