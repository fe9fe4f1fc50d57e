"""Names and shapes of bodies: what each joint is taken for, and which ones `--source` chooses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.bodies.joint_labels import heading_joints, hips_joint, label_joints
from devices.bodies.joint_names import Kind, Side, part_of_name
from devices.bodies.source_joints import PRESETS, available_presets, source_joints, source_tree
from devices.errors import InputError
from devices.kinect.joints import KINECT_AZURE, KINECT_V1, KINECT_V2
from devices.skeleton import Skeleton

LIMB = ("shoulder", "upper arm", "lower arm", "hand", "upper leg", "lower leg", "foot", "toes")

# One body in the words of each convention: clavicle, upper arm, lower arm, hand, upper leg, lower
# leg, foot, toes on the left ("" where it has none), then hips, spine, chest, neck, head.
CONVENTIONS = {
    "Kinect v2": "- ShoulderLeft ElbowLeft WristLeft HipLeft KneeLeft AnkleLeft FootLeft "
    "SpineBase SpineMid SpineShoulder Neck Head",
    "Azure Kinect": "ClavicleLeft ShoulderLeft ElbowLeft WristLeft HipLeft KneeLeft AnkleLeft "
    "FootLeft Pelvis SpineNavel SpineChest Neck Head",
    "CMU ASF": "lclavicle lhumerus lradius lwrist lfemur ltibia lfoot ltoes "
    "pelvis lowerback thorax upperneck head",
    "MotionBuilder": "LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg LeftFoot "
    "LeftToeBase Hips Spine Chest Neck Head",
    "animated drawings": "LeftCollar LeftShoulder LeftElbow LeftWrist LeftHip LeftKnee LeftAnkle "
    "LeftToe Hips lowerback Chest Neck Head",
    "Mixamo": "mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand "
    "mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot mixamorig:LeftToeBase "
    "mixamorig:Hips mixamorig:Spine mixamorig:Chest mixamorig:Neck mixamorig:Head",
    "Bandai-Namco": "Shoulder_L UpperArm_L LowerArm_L Hand_L UpperLeg_L LowerLeg_L Foot_L Toes_L "
    "Hips Spine Chest Neck Head",
    "DAZ": "lCollar lShldr lForeArm lHand lThigh lShin lFoot lToe hip abdomen chest neck head",
    "MakeHuman": "clavicle.L upperarm01.L lowerarm01.L wrist.L upperleg01.L lowerleg01.L foot.L "
    "toe1-1.L pelvis spine02 chest neck01 head",
    "MakeHuman CMU": "lcollar lshoulder lelbow lhand lhip lknee lfoot toe1-1.l "
    "hip abdomen chest neck head",
    "Biped": "Bip01_L_Clavicle Bip01_L_UpperArm Bip01_L_Forearm Bip01_L_Hand Bip01_L_Thigh "
    "Bip01_L_Calf Bip01_L_Foot Bip01_L_Toe0 Bip01_Pelvis Bip01_Spine Chest Bip01_Neck Bip01_Head",
    "VRM": "leftShoulder leftUpperArm leftLowerArm leftHand leftUpperLeg leftLowerLeg leftFoot "
    "leftToes hips spine upperChest neck head",
    "VRoid": "J_Bip_L_Shoulder J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand J_Bip_L_UpperLeg "
    "J_Bip_L_LowerLeg J_Bip_L_Foot J_Bip_L_ToeBase J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest "
    "J_Bip_C_Neck J_Bip_C_Head",
    "Unreal": "clavicle_l upperarm_l lowerarm_l hand_l thigh_l calf_l foot_l ball_l "
    "pelvis spine_01 chest neck_01 head",
    "Rigify": "DEF-shoulder.L DEF-upper_arm.L DEF-forearm.L DEF-hand.L DEF-thigh.L DEF-shin.L "
    "DEF-foot.L DEF-toe.L DEF-hips DEF-spine.001 DEF-chest DEF-neck DEF-head",
    "Rokoko": "leftShoulder leftUpperArm leftLowerArm leftHand leftUpLeg leftLeg leftFoot leftToe "
    "hip spine chest neck head",
    "OptiTrack": "LShoulder LUArm LFArm LHand LThigh LShin LFoot LToe Hip Ab Chest Neck Head",
    "SMPL": "L_Collar L_Shoulder L_Elbow L_Wrist L_Hip L_Knee L_Ankle L_Foot "
    "Pelvis Spine1 chest Neck Head",
    "MediaPipe": "- left_shoulder left_elbow left_wrist left_hip left_knee left_ankle "
    "left_foot_index mid_hip spine mid_shoulder neck head",
}


def mirrored(name: str) -> str:
    for left, right in (
        *(("Left", "Right"), ("left", "right"), ("_L_", "_R_"), ("_L", "_R"), ("_l", "_r")),
        *((".L", ".R"), (".l", ".r"), ("L_", "R_")),
    ):
        if left in name:
            return name.replace(left, right)
    return {"l": "r", "L": "R"}[name[0]] + name[1:]


def body(convention: str) -> tuple[Skeleton, dict[str, str]]:
    """A T-posed skeleton with the names of a convention, and what each name should be."""
    words = CONVENTIONS[convention].split()
    left = dict(zip(LIMB, words[:8], strict=True))
    hips, _, chest = words[8:11]
    heights = [0.95, 1.15, 1.4, 1.5, 1.6]
    joints = [(name, y, 0.0) for name, y in zip(words[8:], heights, strict=True)]
    parents = dict(zip(words[9:], words[8:], strict=False))
    meaning = dict(zip(words[8:], ("hips", "spine", "chest", "neck", "head"), strict=True))
    for side in ("left", "right"):
        sign = 1 if side == "left" else -1
        for kinds, start, path in (
            (LIMB[:4], chest, [(1.4, 0.05), (1.4, 0.2), (1.4, 0.45), (1.4, 0.7)]),
            (LIMB[4:], hips, [(0.9, 0.1), (0.5, 0.1), (0.1, 0.1), (0.02, 0.15)]),
        ):
            above = start
            for kind, (y, x) in zip(kinds, path, strict=True):
                if left[kind] == "-":
                    continue
                name = left[kind] if side == "left" else mirrored(left[kind])
                joints.append((name, y, sign * x))
                parents[name], above = above, name
                meaning[name] = f"{side} {kind}"
    names = [name for name, _, _ in joints]
    indices = [names.index(parents[name]) if name in parents else -1 for name in names]
    return Skeleton(tuple(names), indices, [(x, y, 0.0) for _, y, x in joints]), meaning


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_each_convention_names_the_same_body(convention: str) -> None:
    skeleton, meaning = body(convention)
    for name, part in zip(skeleton.names, label_joints(skeleton), strict=True):
        assert part is not None, name
        said = part.kind if part.side is Side.CENTRE else f"{part.side} {part.kind}"
        assert said == meaning[name], name


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_each_convention_has_every_preset_of_a_body_without_fingers(convention: str) -> None:
    skeleton, meaning = body(convention)
    assert set(available_presets(skeleton)) == set(PRESETS) - {"hand", "left-hand", "right-hand"}
    arm = [meaning[skeleton.names[j]] for j in source_joints(skeleton, "left-arm")]
    assert arm == ["left upper arm", "left lower arm", "left hand"]
    assert len(source_joints(skeleton, "legs")) == 8
    pairs = [
        (meaning[skeleton.names[left]], meaning[skeleton.names[right]])
        for left, right in heading_joints(skeleton)
    ]
    assert pairs == [
        ("left upper leg", "right upper leg"),
        ("left upper arm", "right upper arm"),
    ]


@pytest.mark.parametrize(
    ("name", "kind", "side", "tip"),
    [
        ("LeftHandThumb1", Kind.THUMB, Side.LEFT, False),
        ("rRing1", Kind.RING, Side.RIGHT, False),
        ("rMid2", Kind.MIDDLE, Side.RIGHT, False),
        ("mixamorig7:HeadTop_End", Kind.HEAD, Side.CENTRE, True),
        ("Hand_L_end", Kind.HAND, Side.LEFT, True),
        ("index_mcp", Kind.INDEX, Side.CENTRE, False),
        ("left_ring_tip", Kind.RING, Side.LEFT, True),
        ("upperarm_twist_01_l", Kind.HELPER, Side.LEFT, False),
        ("__Clavicle_L", Kind.HELPER, Side.CENTRE, False),
        ("LHipJoint", Kind.HIPS, Side.LEFT, False),
        ("BN_Tail_03", Kind.TAIL, Side.CENTRE, False),
        ("eye.l", Kind.FACE, Side.LEFT, False),
        ("CC_Base_NeckTwist01", Kind.NECK, Side.CENTRE, False),
        ("L5", Kind.SPINE, Side.CENTRE, False),
        ("T8", Kind.CHEST, Side.CENTRE, False),
    ],
)
def test_single_names(name: str, kind: Kind, side: Side, tip: bool) -> None:
    part = part_of_name(name)
    assert part is not None
    assert (part.kind, part.tip) == (kind, tip)
    assert part.side is side or kind is Kind.HELPER


@given(st.text(max_size=30))
def test_any_name_at_all_is_survived(name: str) -> None:
    part_of_name(name)


def test_numbered_fingers_are_told_apart_from_one_and_from_zero() -> None:
    from_one = Skeleton(
        ("wrist.L", *(f"finger{n}-1.L" for n in range(1, 6))), [-1, 0, 0, 0, 0, 0], np.eye(6)[:, :3]
    )
    from_zero = Skeleton(
        ("Bip01 L Hand", *(f"Bip01 L Finger{n}" for n in range(5))),
        [-1] + [0] * 5,
        np.eye(6)[:, :3],
    )
    fingers = [Kind.THUMB, Kind.INDEX, Kind.MIDDLE, Kind.RING, Kind.LITTLE]
    for skeleton in (from_one, from_zero):
        assert [part.kind for part in label_joints(skeleton)[1:] if part] == fingers
        assert "left-hand" in available_presets(skeleton)


def test_nameless_bodies_are_told_by_their_shape() -> None:
    named, meaning = body("MotionBuilder")
    nameless = Skeleton(
        tuple(f"bone{i}" for i in range(len(named.names))), named.parents, named.rest_positions
    )
    labels = label_joints(nameless)
    for name, part in zip(named.names, labels, strict=True):
        if meaning[name].split()[-1] in ("arm", "leg", "hips"):
            assert part is not None, name
            assert meaning[name].startswith(part.side) or part.kind is Kind.HIPS
    assert {"arms", "legs", "left-arm"} <= set(available_presets(nameless))


def test_a_chain_of_unknown_joints_is_kept_whole() -> None:
    tentacle = Skeleton(
        tuple(f"bone{i}" for i in range(8)), range(-1, 7), [(0, i, 0) for i in range(8)]
    )
    assert available_presets(tentacle) == ("whole",)
    assert source_joints(tentacle, "whole") == list(range(8))
    assert heading_joints(tentacle) == []
    assert hips_joint(tentacle) == 0


def test_whole_leaves_out_faces_thumbs_and_hand_tips() -> None:
    names = {KINECT_AZURE.names[j] for j in source_joints(KINECT_AZURE, "whole")}
    assert names == {
        name
        for name in KINECT_AZURE.names
        if not name.startswith(("Nose", "Eye", "Ear", "HandTip", "Thumb"))
    }


def test_whole_keeps_every_leg_and_the_trunk_of_a_creature() -> None:
    names = ["hips", "spine", "head", "nose_1", "nose_2", "ear", "tail_1"]
    parents = [-1, 0, 1, 2, 3, 2, 0]
    places = [(0, 1, 0), (0, 1, 0.5), (0, 1, 1), (0, 0.8, 1.2), (0, 0.4, 1.3), (0.05, 1, 1)]
    places.append((0, 0.9, -0.3))
    for side, x in (("L", 0.2), ("R", -0.2)):
        for legs, start, z in (("Front", 1, 0.6), ("Back", 0, 0.0)):
            above = start
            for part, y in (("Upper", 0.9), ("Lower", 0.5), ("Foot", 0.1)):
                names.append(f"{legs}_Leg_{part}_{side}")
                parents.append(above)
                places.append((x, y, z))
                above = len(names) - 1
    skeleton = Skeleton(tuple(names), parents, places)
    kept = {skeleton.names[j] for j in source_joints(skeleton, "whole")}
    assert kept == set(names) - {"ear"}


def test_whole_drops_twist_segments_but_not_the_joints_of_a_spiders_leg() -> None:
    skeleton, _ = body("Rigify")
    names = [*skeleton.names, "DEF-thigh.L.001"]
    parents = [*skeleton.parents, skeleton.index("DEF-thigh.L")]
    rest = [*skeleton.rest_positions, (0.1, 0.7, 0.0)]
    twisted = Skeleton(tuple(names), parents, rest)
    assert "DEF-thigh.L.001" not in {names[j] for j in source_joints(twisted, "whole")}
    legs = [f"leg_{which}_{n}_{side}" for side in "lr" for which in "abc" for n in (1, 2, 3)]
    starts = [0 if n % 3 == 0 else n for n in range(len(legs))]
    places = [(0.1 * n, 0.1 * (n % 3), 0) for n in range(1, len(legs) + 1)]
    spider = Skeleton(("hips", *legs), [-1, *starts], [(0, 0, 0), *places])
    assert len(source_joints(spider, "whole")) == 1 + len(legs)


def test_sources_are_named_by_beginnings_and_without_name_spaces() -> None:
    skeleton, _ = body("Mixamo")
    called = source_joints(skeleton, "leftforearm, HEAD, mixamorig:Hi")
    assert {skeleton.names[j] for j in called} == {
        "mixamorig:LeftForeArm",
        "mixamorig:Head",
        "mixamorig:Hips",
    }
    assert KINECT_V2.index("Head") in source_joints(KINECT_V2, "left-arm,Head")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("Elbow", "matches 2 joints: ElbowLeft, ElbowRight"),
        ("wing", "is not a joint of this performer; presets: whole, upper, arms"),
        ("hand", "has no 'hand'; --source can be: whole, upper, arms"),
        (" , ", "--source is empty"),
    ],
)
def test_sources_that_are_not_there_are_answered_with_what_is(source: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        source_joints(KINECT_V1, source)


def test_two_arms_meet_at_the_chest() -> None:
    parents, joints = source_tree(KINECT_V2, source_joints(KINECT_V2, "arms"))
    assert KINECT_V2.names[joints[0]] == "SpineShoulder"
    assert parents[0] == -1
    assert np.count_nonzero(parents == 0) == 2
    assert len(joints) == 9


def test_a_tree_skips_what_is_not_chosen() -> None:
    wrist, hips = KINECT_V2.index("WristLeft"), KINECT_V2.index("SpineBase")
    parents, joints = source_tree(KINECT_V2, [wrist, hips])
    assert joints == [hips, wrist]
    assert parents.tolist() == [-1, 0]
    with pytest.raises(InputError, match="no joint"):
        source_tree(KINECT_V2, [])


@given(st.sets(st.integers(0, 31), min_size=1))
def test_any_choice_of_joints_gives_one_tree_that_keeps_ancestry(chosen: set[int]) -> None:
    parents, joints = source_tree(KINECT_AZURE, chosen)
    assert chosen <= set(joints)
    assert len(set(joints) - chosen) <= 1
    tree = Skeleton(tuple(map(str, joints)), parents, np.zeros((len(joints), 3)))
    assert tree.order
    for joint, parent in zip(joints, parents, strict=True):
        if parent >= 0:
            above = int(KINECT_AZURE.parents[joint])
            while above != joints[parent]:
                assert above not in joints
                above = int(KINECT_AZURE.parents[above])
