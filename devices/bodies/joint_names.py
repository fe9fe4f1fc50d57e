"""Derive the side and body part of a joint from its name, for many naming conventions.

A name is split into words (camel case, digits, separators, name spaces, prefixes of rigs). The
word for the side is removed, and the rest is looked up in the tables below. The tables cover Kinect
v1, v2 and Azure, CMU (ASF and the BVH conversions), Bandai-Namco, Mixamo, MotionBuilder, MakeHuman,
DAZ, 3ds Max Biped, Unity and VRM humanoids, Unreal, Rigify, Rokoko, Xsens, OptiTrack, SMPL,
OpenPose, MediaPipe, Leap Motion and OpenXR.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from itertools import pairwise


class Side(StrEnum):
    """The side of the performer's own body."""

    LEFT = "left"
    RIGHT = "right"
    CENTRE = "centre"


class Kind(StrEnum):
    """The part of the body that begins at a joint: UPPER_ARM at the shoulder, FOOT at the ankle."""

    ROOT = "root"
    HIPS = "hips"
    SPINE = "spine"
    CHEST = "chest"
    NECK = "neck"
    HEAD = "head"
    SHOULDER = "shoulder"
    UPPER_ARM = "upper arm"
    LOWER_ARM = "lower arm"
    HAND = "hand"
    THUMB = "thumb"
    INDEX = "index finger"
    MIDDLE = "middle finger"
    RING = "ring finger"
    LITTLE = "little finger"
    FINGER = "finger"
    UPPER_LEG = "upper leg"
    LOWER_LEG = "lower leg"
    FOOT = "foot"
    TOES = "toes"
    TAIL = "tail"
    WING = "wing"
    FIN = "fin"
    FACE = "face"
    HELPER = "helper"


class LimbName(StrEnum):
    """Which limb of a creature a name says: one of two pairs of legs, a wing or a fin."""

    PLAIN = ""
    FORE = "foreleg"
    MIDDLE = "middle leg"
    HIND = "hind leg"
    WING = "wing"
    FIN = "fin"


FINGERS = (Kind.THUMB, Kind.INDEX, Kind.MIDDLE, Kind.RING, Kind.LITTLE, Kind.FINGER)


@dataclass(frozen=True, slots=True)
class BodyPart:
    """The part of the body that begins at a joint.

    kind: the part.
    side: the performer's own left or right, or the centre.
    tip: the joint only ends the part (head top, finger tip, end site) and moves nothing.
    word: the word of the name that determined the part. "shoulder", "hip", "leg" and "foot"
        mean different joints in different conventions; `devices.bodies.joint_labels` resolves
        them.
    number: the first number in the name, or None ("finger2-1" has 2).
    limb: the limb that the name says; plain for a person's arms and legs.
    """

    kind: Kind
    side: Side = Side.CENTRE
    tip: bool = False
    word: str = ""
    number: int | None = None
    limb: LimbName = LimbName.PLAIN


def _listed(words: str) -> list[str]:
    return words.split()


_WORDS: dict[Kind, str] = {
    Kind.ROOT: "root reference armature origin worldroot jointroot skeleton master global",
    Kind.HIPS: "hips hip pelvis hipcenter hipcentre spinebase hipjoint buttock midhip cog",
    Kind.SPINE: "spine spinemid spinenavel abdomen abdomenlower abdomenupper lowerback torso waist "
    "belly navel ab stomach back backbone lumbar spinelower body",
    Kind.CHEST: "chest upperchest spinechest spineshoulder shouldercenter shouldercentre thorax "
    "sternum upperback chestlower chestupper ribcage ribs midshoulder midshoulders spineupper",
    Kind.NECK: "neck lowerneck upperneck neckbase necklower neckupper",
    Kind.HEAD: "head skull scull headcenter",
    Kind.SHOULDER: "shoulder shldr clavicle collar collarbone scapula clav",
    Kind.UPPER_ARM: "arm upperarm uparm uarm humerus shoulderbend shldrbend bicep",
    Kind.LOWER_ARM: "forearm lowerarm loarm lowarm farm radius ulna elbow forearmbend",
    Kind.HAND: "hand wrist palm lowerhand",
    Kind.THUMB: "thumb",
    Kind.INDEX: "index pointer forefinger indexfinger",
    Kind.MIDDLE: "middle middlefinger",
    Kind.RING: "ring ringfinger",
    Kind.LITTLE: "little pinky pinkie littlefinger pinkyfinger",
    Kind.FINGER: "finger fingers fingerbase metacarpal fingertip pointable carpal",
    Kind.UPPER_LEG: "upleg upperleg thigh femur uleg thighbend",
    Kind.LOWER_LEG: "leg lowerleg lowleg loleg shin calf tibia knee crus stifle",
    Kind.FOOT: "foot ankle tarsal hock paw hoof horselink cannon",
    Kind.TOES: "toe toes toebase ball footindex metatarsal metatarsals bigtoe football smalltoe "
    "fetlock pastern",
    Kind.TAIL: "tail",
    Kind.WING: "wing",
    Kind.FIN: "fin flipper",
    Kind.FACE: "face eye eyes eyelid eyebrow brow ear nose mouth jaw lip lips teeth tooth tongue "
    "cheek chin lid levator oris orbicularis temporalis oculi risorius special forehead nasal "
    "nostril headset pupil snout whisker ears muzzle beak bill horn horns antler antlers antenna "
    "antennae feeler mandible tusk fang crest mane",
    Kind.HELPER: "twist roll helper ik fk pole target ctrl control effector socket weapon prop "
    "hair ponytail bangs beard hat breast boob bust skirt cape cloth sleeve secondary sec heel "
    "deltoid pectoral glute attach attachment locator camera marker collider holder "
    "feather feathers membrane",
}
_KIND_OF_WORD = {word: kind for kind, words in _WORDS.items() for word in words.split()}
# Words searched for inside a name of several words, before and after pairs of neighbouring words
# are tried: "LeftHandThumb1" is a thumb, "thigh_twist_l" a helper, "upper_leg_front" an upper leg.
_FIRST = (
    *_WORDS[Kind.HELPER].split(),
    *(word for kind in FINGERS for word in _WORDS[kind].split()),
    *_WORDS[Kind.FACE].split(),
    *_WORDS[Kind.TAIL].split(),
)
_LAST = _listed(
    "toe toes metatarsal elbow wrist palm knee ankle forearm thigh shin calf clavicle collar neck "
    "head chest spine pelvis hips foot hand shoulder shldr leg arm hip"
)
_NOISE = set(
    _listed(
        "bip bn def org mch mixamorig cc base j jnt joint bone valvebiped sk rig char character "
        "biped f d actor skel tracker n b m x bvh npc"
    )
)
_SIDES = (
    *((mark, Side.LEFT) for mark in ("left", "lft", "l")),
    *((mark, Side.RIGHT) for mark in ("right", "rgt", "rt", "r")),
)
_CENTRE = {"center", "centre", "mid", "c"}
_END = {"end", "nub", "tip", "top", "endsite", "site", "leaf"}
_SPLIT = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
_PREFIX = re.compile(r"^(Bip\d+|ValveBiped|CC_Base|mixamorig\d*)[ _.]+", re.IGNORECASE)
# The pair of legs that a name says, alone ("front_thigh", "FL_foot") or joined with a word of the
# leg ("foreleg").
_PAIRS = {
    **dict.fromkeys(("front", "fore", "frnt"), LimbName.FORE),
    **dict.fromkeys(("mid", "middle"), LimbName.MIDDLE),
    **dict.fromkeys(("hind", "back", "rear"), LimbName.HIND),
}
_CORNERS = {
    letter + side: (pair, side)
    for letter, pair in (
        ("f", LimbName.FORE),
        ("b", LimbName.HIND),
        ("h", LimbName.HIND),
        ("r", LimbName.HIND),
    )
    for side in ("l", "r")
}
_OF_A_LEG = {
    *(word for kind in (Kind.UPPER_LEG, Kind.LOWER_LEG) for word in _WORDS[kind].split()),
    *(word for kind in (Kind.FOOT, Kind.TOES) for word in _WORDS[kind].split()),
    *("hip", "pelvis", "shoulder", "scapula", "legs"),
}
_OF_A_MIDDLE_LEG = {"leg", *_WORDS[Kind.UPPER_LEG].split(), "lowerleg", "shin", "tibia", "knee"}
_ONLY_OF_PAIRS = {"upper": "upperleg", "lower": "lowerleg"}  # "rear_l_upper"
_OTHER_FINS = {"dorsal", "pelvic", "anal", "caudal", "ventral", "tail"}
_VERTEBRA = re.compile(r"^[LTC]\d{1,2}$")  # Xsens: L5, L3, T12, T8


@lru_cache(maxsize=16384)
def part_of_name(name: str) -> BodyPart | None:
    """Return the body part that a joint's name alone describes, or None for an unknown name.

    The legs of four-legged creatures are legs here, also the front ones;
    `devices.bodies.joint_labels` makes them arms.
    """
    plain = re.split(r"[:|]", name)[-1].strip()
    if _VERTEBRA.match(plain):
        return BodyPart(Kind.CHEST if plain[0] == "T" else Kind.SPINE, word="spine")
    if plain.startswith("__") or plain.endswith(" parts"):
        # MakeHuman's stub bone before an offset bone; a node where parallel bones separate.
        return BodyPart(Kind.HELPER, word="helper")
    plain = _PREFIX.sub("", plain) or plain
    tokens = [token.lower() for token in _SPLIT.findall(plain)]
    digits = [int(token) for token in tokens if token.isdigit() and len(token) < 4]
    words, limb = _take_pair([token for token in tokens if not token.isdigit()])
    words, side = _take_side(words)
    words, tip = _take_tip(words)
    word = _word_of(words, side)
    if word is None:
        return None
    kind = _KIND_OF_WORD[word]
    if kind is Kind.WING or "wing" in words:
        limb = LimbName.WING
    elif kind is Kind.FIN:
        limb = LimbName.FIN
    return BodyPart(kind, side, tip, word, digits[0] if digits else None, limb)


def _take_pair(words: list[str]) -> tuple[list[str], LimbName]:
    """Remove the word for a pair of legs, where the rest of the name is a part of a leg."""
    if len(words) > 2 and words[0] == "r" and words[-1] in ("l", "r"):
        return words[1:], LimbName.HIND  # a horse of Rigify: "r_toe.L"
    for place, word in enumerate(words):
        rest = [*words[:place], *words[place + 1 :]]
        if word in _CORNERS and not _OF_A_LEG.isdisjoint(rest):
            limb, side = _CORNERS[word]
            return [*rest, side], limb
        limb = _PAIRS.get(word, LimbName.PLAIN)
        known = _OF_A_MIDDLE_LEG if limb is LimbName.MIDDLE else _OF_A_LEG
        if limb is not LimbName.PLAIN and not known.isdisjoint(rest):
            return rest, limb
        if (
            limb is not LimbName.PLAIN
            and word != "back"
            and not _ONLY_OF_PAIRS.keys().isdisjoint(rest)
        ):
            return [_ONLY_OF_PAIRS.get(other, other) for other in rest], limb
        for pair, limb in _PAIRS.items():
            known = _OF_A_MIDDLE_LEG if limb is LimbName.MIDDLE else _OF_A_LEG
            if word.startswith(pair) and word.removeprefix(pair) in known:
                return [*words[:place], word.removeprefix(pair), *words[place + 1 :]], limb
    return words, LimbName.PLAIN


def _take_side(words: list[str]) -> tuple[list[str], Side]:
    """Remove the word for a side, also where it is a prefix: "lhumerus"."""
    whole = "".join(words)
    if whole not in _KIND_OF_WORD:
        for mark, side in _SIDES:
            if whole.startswith(mark) and whole.removeprefix(mark) in _KIND_OF_WORD:
                return [whole.removeprefix(mark)], side  # "LUArm", "LHipJoint"
    for place, word in enumerate(words):
        for mark, side in _SIDES:
            if word == mark:
                return words[:place] + words[place + 1 :], side
            glued = word not in _KIND_OF_WORD and word.startswith(mark)
            rest = word.removeprefix(mark) if glued else word.removesuffix(mark)
            if rest != word and rest in _KIND_OF_WORD and (glued or len(mark) > 1):
                return [*words[:place], rest, *words[place + 1 :]], side
    return words, Side.CENTRE


def _take_tip(words: list[str]) -> tuple[list[str], bool]:
    kept = [word for word in words if word not in _END]
    return (kept, len(kept) < len(words)) if kept else (words, False)


def _word_of(words: list[str], side: Side) -> str | None:
    """The table's word that matches the words of a name, or None."""
    if "".join(words) in _KIND_OF_WORD:
        return "".join(words)  # Kinect: SpineBase, where "base" alone would be noise
    if words == ["mid"] and side is not Side.CENTRE:
        return "middle"  # DAZ: rMid1
    central = any(word in _CENTRE for word in words)
    words = [word for word in words if word not in _CENTRE | _NOISE]
    whole = "".join(words)
    if central and side is Side.CENTRE and whole.rstrip("s") in ("hip", "shoulder"):
        return whole.rstrip("s") + "center"
    if whole in _KIND_OF_WORD:
        return whole
    if "neck" in words:
        return "neck"  # Character Creator's NeckTwist is the neck itself
    pairs = [a + b for a, b in pairwise(words)] + [b + a for a, b in pairwise(words)]
    candidates = []
    if "fin" in words:  # before "pectoral", which alone is a muscle
        candidates.append("fin" if _OTHER_FINS.isdisjoint(words) else "helper")
    candidates += [word for word in _FIRST if word in words]
    candidates += [pair for pair in pairs if pair in _KIND_OF_WORD]
    candidates += [word for word in _LAST if word in words]
    candidates += [word for word in words if word in _KIND_OF_WORD]
    candidates += [word for word in _LAST if len(word) > 3 and word in whole]
    return candidates[0] if candidates else None
