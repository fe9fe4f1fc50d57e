"""Bone names of rigs as their makers name them, and the bodies that they are."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devices.skeleton import Skeleton

_MIRRORED = (
    *(("Left", "Right"), ("left", "right"), ("_L_", "_R_"), ("_l_", "_r_"), (" L ", " R ")),
    *((".L", ".R"), (".l", ".r"), ("FL_", "FR_"), ("BL_", "BR_")),
)


@dataclass(frozen=True)
class Rig:
    """Bones and the plan that they should have.

    bones: chains of bones; each begins with a bone that is already there. Chains of the left side
        have a right one too.
    trunk: its first and last bone.
    skull: the bone that the head turns about, "" for no head.
    arm, leg: of the left, where each segment begins; "" for none.
    words: what its limbs are called.
    """

    bones: tuple[str, ...]
    trunk: str
    skull: str
    arm: str
    leg: str
    words: tuple[str, str] = ("arm", "leg")
    tail: str = ""


def mirrored(name: str) -> str:
    """The name of the bone on the other side; the same name for a bone in the middle."""
    for left, right in _MIRRORED:
        if left in name:
            return name.replace(left, right)
    for left, right in (("_L", "_R"), ("_l", "_r")):
        if name.endswith(left):
            return name.removesuffix(left) + right
    if name[:2] in ("L_", "l_") or (name[0] == "l" and name[1:2].isupper()):
        return {"l": "r", "L": "R"}[name[0]] + name[1:]
    return name


def skeleton_of(rig: Rig) -> Skeleton:
    """The rig's bones: the trunk upright, all limbs straight, the left at +X."""
    parents: dict[str, str | None] = {}
    places: dict[str, np.ndarray] = {}
    for number, chain in enumerate(rig.bones):
        names = [name.replace("~", " ") for name in chain.split()]
        if number == 0:
            parents[names[0]], places[names[0]] = None, np.array([0.0, 1.0, 0.0])
        for side in (1, -1):
            own = names if side > 0 else [mirrored(name) for name in names]
            if side < 0 and own == names:
                continue
            sided = names != [mirrored(name) for name in names]
            way = np.array([side * 0.1, -0.02 * number, 0.01]) if sided else [0.0, 0.1, 0.0]
            for above, name in pairwise(own):
                if name not in parents:
                    parents[name], places[name] = above, places[above] + way
    names = list(parents)
    above = [-1 if (parent := parents[name]) is None else names.index(parent) for name in names]
    return Skeleton(tuple(names), np.array(above), np.array([places[name] for name in names]))


RIGS = {
    "Mixamo": Rig(
        (
            "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck "
            "mixamorig:Head mixamorig:HeadTop_End",
            "mixamorig:Spine2 mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm "
            "mixamorig:LeftHand mixamorig:LeftHandMiddle1 mixamorig:LeftHandMiddle2",
            "mixamorig:LeftHand mixamorig:LeftHandThumb1 mixamorig:LeftHandThumb2",
            "mixamorig:Hips mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot "
            "mixamorig:LeftToeBase mixamorig:LeftToe_End",
        ),
        "mixamorig:Hips mixamorig:Spine2",
        "mixamorig:Head",
        "mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand",
        "mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot",
    ),
    "VRoid": Rig(
        (
            "Root J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck "
            "J_Bip_C_Head J_Adj_C_HairRoot J_Sec_Hair1_01",
            "J_Bip_C_Head J_Adj_L_FaceEye",
            "J_Bip_C_UpperChest J_Sec_L_Bust1 J_Sec_L_Bust2",
            "J_Bip_C_UpperChest J_Bip_L_Shoulder J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand "
            "J_Bip_L_Middle1 J_Bip_L_Middle2",
            "J_Bip_L_UpperArm J_Sec_L_TopsUpperArmOuter_end_01",
            "J_Bip_C_Hips J_Bip_L_UpperLeg J_Bip_L_LowerLeg J_Bip_L_Foot J_Bip_L_ToeBase",
            "J_Bip_L_UpperLeg J_Sec_L_SkirtFront0_01 J_Sec_L_SkirtFront1_01",
        ),
        "J_Bip_C_Hips J_Bip_C_UpperChest",
        "J_Bip_C_Head",
        "J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand",
        "J_Bip_L_UpperLeg J_Bip_L_LowerLeg J_Bip_L_Foot",
    ),
    "VRM": Rig(
        (
            "hips spine chest upperChest neck head",
            "upperChest leftShoulder leftUpperArm leftLowerArm leftHand leftMiddleProximal",
            "hips leftUpperLeg leftLowerLeg leftFoot leftToes",
        ),
        "hips upperChest",
        "head",
        "leftUpperArm leftLowerArm leftHand",
        "leftUpperLeg leftLowerLeg leftFoot",
    ),
    "Unreal": Rig(
        (
            "root pelvis spine_01 spine_02 spine_03 spine_04 spine_05 neck_01 neck_02 head",
            "spine_05 clavicle_l upperarm_l lowerarm_l hand_l middle_metacarpal_l middle_01_l",
            "upperarm_l upperarm_twist_01_l",
            "lowerarm_l lowerarm_twist_01_l",
            "pelvis thigh_l calf_l foot_l ball_l",
            "thigh_l thigh_twist_01_l",
            "root ik_foot_root ik_foot_l",
            "root ik_hand_root ik_hand_gun ik_hand_l",
        ),
        "pelvis spine_05",
        "head",
        "upperarm_l lowerarm_l hand_l",
        "thigh_l calf_l foot_l",
    ),
    "Rigify": Rig(
        (
            "root DEF-spine DEF-spine.001 DEF-spine.002 DEF-spine.003 DEF-spine.004 DEF-spine.005 "
            "DEF-spine.006",
            "DEF-spine.006 DEF-jaw DEF-chin",
            "DEF-spine.003 DEF-shoulder.L DEF-upper_arm.L DEF-upper_arm.L.001 DEF-forearm.L "
            "DEF-forearm.L.001 DEF-hand.L DEF-f_middle.01.L DEF-f_middle.02.L",
            "DEF-hand.L DEF-thumb.01.L DEF-thumb.02.L",
            "DEF-spine.003 DEF-breast.L",
            "DEF-spine DEF-pelvis.L DEF-thigh.L DEF-thigh.L.001 DEF-shin.L DEF-shin.L.001 "
            "DEF-foot.L DEF-toe.L",
        ),
        "DEF-spine DEF-spine.003",
        "DEF-spine.006",
        "DEF-upper_arm.L DEF-forearm.L DEF-hand.L",
        "DEF-thigh.L DEF-shin.L DEF-foot.L",
    ),
    "Rigify quadruped": Rig(
        (
            "DEF-spine.004 DEF-spine.005 DEF-spine.006 DEF-spine.007 DEF-spine.008 DEF-spine.009 "
            "DEF-spine.010 DEF-spine.011",
            "DEF-spine.004 DEF-spine.003 DEF-spine.002 DEF-spine.001 DEF-spine",
            "DEF-spine.011 DEF-jaw",
            "DEF-spine.011 DEF-ear.L DEF-ear.L.001",
            "DEF-spine.008 DEF-shoulder.L DEF-front_thigh.L DEF-front_thigh.L.001 DEF-front_shin.L "
            "DEF-front_shin.L.001 DEF-front_foot.L DEF-front_toe.L",
            "DEF-spine.004 DEF-pelvis.L DEF-thigh.L DEF-thigh.L.001 DEF-shin.L DEF-shin.L.001 "
            "DEF-foot.L DEF-toe.L",
        ),
        "DEF-spine.004 DEF-spine.008",
        "DEF-spine.011",
        "DEF-front_thigh.L DEF-front_shin.L DEF-front_foot.L",
        "DEF-thigh.L DEF-shin.L DEF-foot.L",
        ("foreleg", "hind leg"),
        "DEF-spine.004 DEF-spine",
    ),
    "Rigify horse": Rig(
        (
            "spine spine.001 spine.002 spine.003 spine.004 head",
            "spine tail.001 tail.002 tail.003",
            "spine.003 shoulder.L upper_arm.L forearm.L forefoot.L f_toe.L f_hoof.L",
            "spine pelvis.L thigh.L lower_leg.L hind_foot.L r_toe.L r_hoof.L",
        ),
        "spine spine.003",
        "head",
        "upper_arm.L forearm.L forefoot.L",
        "thigh.L lower_leg.L hind_foot.L",
        tail="spine tail.003",
    ),
    "CMU": Rig(
        (
            "Hips LowerBack Spine Spine1 Neck Neck1 Head",
            "Spine1 LeftShoulder LeftArm LeftForeArm LeftHand LeftFingerBase LeftHandIndex1",
            "Hips LHipJoint LeftUpLeg LeftLeg LeftFoot LeftToeBase",
            "Hips RHipJoint RightUpLeg",
        ),
        "Hips Spine1",
        "Head",
        "LeftArm LeftForeArm LeftHand",
        "LeftUpLeg LeftLeg LeftFoot",
    ),
    "Character Studio": Rig(
        (
            "Bip01 Bip01~Pelvis Bip01~Spine Bip01~Spine1 Bip01~Spine2 Bip01~Neck Bip01~Head "
            "Bip01~HeadNub",
            "Bip01~Head Bip01~Ponytail1 Bip01~Ponytail11",
            "Bip01~Neck Bip01~L~Clavicle Bip01~L~UpperArm Bip01~L~Forearm Bip01~L~Hand "
            "Bip01~L~Finger1 Bip01~L~Finger11",
            "Bip01~L~Hand Bip01~L~Finger0 Bip01~L~Finger01",
            "Bip01~L~Forearm Bip01~L~ForeTwist",
            "Bip01~Pelvis Bip01~L~Thigh Bip01~L~Calf Bip01~L~Foot Bip01~L~Toe0 Bip01~L~Toe0Nub",
        ),
        "Bip01~Pelvis Bip01~Spine2",
        "Bip01~Head",
        "Bip01~L~UpperArm Bip01~L~Forearm Bip01~L~Hand",
        "Bip01~L~Thigh Bip01~L~Calf Bip01~L~Foot",
    ),
    "MakeHuman": Rig(
        (
            "root spine05 spine04 spine03 spine02 spine01 neck01 neck02 neck03 head jaw tongue00",
            "spine01 clavicle.L shoulder01.L upperarm01.L upperarm02.L lowerarm01.L lowerarm02.L "
            "wrist.L metacarpal2.L finger3-1.L finger3-2.L",
            "root pelvis.L upperleg01.L upperleg02.L lowerleg01.L lowerleg02.L foot.L toe1-1.L",
        ),
        "root spine01",
        "head",
        "upperarm01.L lowerarm01.L wrist.L",
        "upperleg01.L lowerleg01.L foot.L",
    ),
    "DAZ Genesis 8": Rig(
        (
            "hip abdomenLower abdomenUpper chestLower chestUpper neckLower neckUpper head "
            "upperTeeth",
            "hip pelvis lThighBend lThighTwist lShin lFoot lMetatarsals lToe lSmallToe1",
            "chestUpper lCollar lShldrBend lShldrTwist lForearmBend lForearmTwist lHand lCarpal2 "
            "lMid1 lMid2",
        ),
        "hip chestUpper",
        "head",
        "lShldrBend lForearmBend lHand",
        "lThighBend lShin lFoot",
    ),
    "DAZ Genesis 9": Rig(
        (
            "hip pelvis spine1 spine2 spine3 spine4 neck1 neck2 head",
            "pelvis l_thigh l_shin l_foot l_metatarsal l_toes",
            "l_thigh l_thightwist1 l_thightwist2",
            "spine4 l_shoulder l_upperarm l_forearm l_hand l_mid1 l_mid2",
            "l_upperarm l_upperarmtwist1 l_upperarmtwist2",
        ),
        "hip spine4",
        "head",
        "l_upperarm l_forearm l_hand",
        "l_thigh l_shin l_foot",
    ),
    "Kinect": Rig(
        (
            "SpineBase SpineMid SpineShoulder Neck Head",
            "SpineShoulder ShoulderLeft ElbowLeft WristLeft HandLeft HandTipLeft",
            "WristLeft ThumbLeft",
            "SpineBase HipLeft KneeLeft AnkleLeft FootLeft",
        ),
        "SpineBase SpineShoulder",
        "Head",
        "ShoulderLeft ElbowLeft WristLeft",
        "HipLeft KneeLeft AnkleLeft",
    ),
    "Truebones eagle": Rig(
        (
            "Hips Bip01_Pelvis Bip01_Spine Bip01_Spine1 Bip01_Neck Bip01_Neck1 Bip01_Head BN_Jaw",
            "Bip01_Pelvis BN_Tail_01 BN_Tail_02",
            "Bip01_Spine1 BN_Wing_L_01 BN_Wing_L_02 BN_Wing_L_03 BN_Wing_L_04 BN_Wing_L_05",
            "Bip01_Pelvis Bip01_L_Thigh Bip01_L_Calf Bip01_L_HorseLink Bip01_L_Foot BN_Toe_L_00",
        ),
        "Hips Bip01_Spine1",
        "Bip01_Head",
        "BN_Wing_L_01 BN_Wing_L_03 BN_Wing_L_04",
        "Bip01_L_Thigh Bip01_L_Calf Bip01_L_HorseLink",
        ("wing", "leg"),
        "Bip01_Pelvis BN_Tail_02",
    ),
    "dog with four letters": Rig(
        (
            "pelvis spine1 spine2 neck head muzzle nose",
            "head FL_ear",
            "pelvis tail1 tail2 tail3",
            "spine2 FL_shoulder FL_upperleg FL_lowerleg FL_paw FL_toe",
            "pelvis BL_thigh BL_calf BL_hock BL_paw BL_toe",
        ),
        "pelvis spine2",
        "head",
        "FL_upperleg FL_lowerleg FL_paw",
        "BL_thigh BL_calf BL_hock",
        ("foreleg", "hind leg"),
        "pelvis tail3",
    ),
    "cat with words": Rig(
        (
            "Hips Spine Chest Neck Head Jaw",
            "Hips Tail Tail1 Tail2",
            "Head Whisker_L",
            "Chest Front_Scapula_L Front_Upper_Leg_L Front_Lower_Leg_L Front_Paw_L Front_Toes_L",
            "Hips Hind_Thigh_L Hind_Shin_L Hind_Paw_L Hind_Toes_L",
        ),
        "Hips Chest",
        "Head",
        "Front_Upper_Leg_L Front_Lower_Leg_L Front_Paw_L",
        "Hind_Thigh_L Hind_Shin_L Hind_Paw_L",
        ("foreleg", "hind leg"),
        "Hips Tail2",
    ),
    "game hare": Rig(
        (
            "Root Hips Spine1 Spine2 Neck Head",
            "Head Ear.l Ear_end.l",
            "Spine2 Shoulder.l FrontUpperLeg.l FrontLowerLeg.l FrontFoot.l",
            "Hips BackUpperLeg.l BackLowerLeg.l BackFoot.l",
        ),
        "Hips Spine2",
        "Head",
        "FrontUpperLeg.l FrontLowerLeg.l",
        "BackUpperLeg.l BackLowerLeg.l",
        ("foreleg", "hind leg"),
    ),
    "dragon": Rig(
        (
            "Hips Spine Spine1 Spine2 Neck Neck1 Neck2 Head Horn_C",
            "Head Horn_L Horn_End_L",
            "Hips Tail1 Tail2 Tail3",
            "Spine1 Wing_Shoulder_L Wing_UpperArm_L Wing_Forearm_L Wing_Finger1_L",
            "Spine1 FrontLeg_Clavicle_L FrontLeg_Thigh_L FrontLeg_Shin_L FrontLeg_Foot_L "
            "FrontLeg_Toe_L",
            "Hips BackLeg_Thigh_L BackLeg_Shin_L BackLeg_Foot_L BackLeg_Toe_L",
        ),
        "Hips Spine1",
        "Head",
        "FrontLeg_Thigh_L FrontLeg_Shin_L FrontLeg_Foot_L",
        "BackLeg_Thigh_L BackLeg_Shin_L BackLeg_Foot_L",
        ("foreleg", "hind leg"),
        "Hips Tail3",
    ),
    "wyvern": Rig(
        (
            "Hips Spine Spine1 Neck Head Jaw",
            "Spine1 Wing_UpperArm_L Wing_Forearm_L Wing_Hand_L Wing_Finger1_L Wing_Finger2_L",
            "Wing_Hand_L Wing_Membrane_L",
            "Hips Thigh_L Calf_L Foot_L Toe_L",
        ),
        "Hips Spine1",
        "Head",
        "Wing_UpperArm_L Wing_Forearm_L Wing_Hand_L",
        "Thigh_L Calf_L Foot_L",
        ("wing", "leg"),
    ),
    "angel": Rig(
        (
            "Hips Spine Chest Neck Head",
            "Chest LeftShoulder LeftArm LeftForeArm LeftHand LeftHandMiddle1",
            "Chest LeftWing1 LeftWing2 LeftWing3",
            "Hips LeftUpLeg LeftLeg LeftFoot LeftToeBase",
        ),
        "Hips Chest",
        "Head",
        "LeftArm LeftForeArm LeftHand",
        "LeftUpLeg LeftLeg LeftFoot",
    ),
    "fish": Rig(
        (
            "Body Spine1 Spine2 Head Jaw",
            "Body Tail1 Tail2 Tail3",
            "Spine1 Dorsal_Fin Dorsal_Fin_end",
            "Spine2 Pectoral_Fin1_L Pectoral_Fin2_L Pectoral_Fin3_L",
            "Body Pelvic_Fin_L Pelvic_Fin2_L",
        ),
        "Body Spine2",
        "Head",
        "Pectoral_Fin1_L Pectoral_Fin2_L",
        "",
        ("fin", "leg"),
        "Body Tail3",
    ),
    "dinosaur without arms": Rig(
        (
            "Pelvis Spine1 Spine2 Neck1 Neck2 Head Jaw",
            "Pelvis Tail1 Tail2",
            "Pelvis Thigh_L Shin_L Foot_L Toe_L",
        ),
        "Pelvis Spine2",
        "Head",
        "",
        "Thigh_L Shin_L Foot_L",
        tail="Pelvis Tail2",
    ),
}
