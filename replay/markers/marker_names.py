"""The place on a body that each marker's name means, in the common marker sets.

Read are Vicon's Plug-in Gait and its kin (CMU, HDM05), OptiTrack's Baseline and Conventional, the
sets of OpenSim's models and of OpenCap, the IOR set of Leardini et al. 2007, and the key points of
Pose2Sim, which are joint centres. Prefixes of subjects ("Anna:LASI", "Anna_LASI") are left out.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

_OF_A_SIDE = {
    "asis": "ASI ASIS IAS FWT ASISSTUDY WAISTFRONT",
    "psis": "PSI PSIS IPS BWT PSISSTUDY WAISTBACK",
    "hip": "HJC HJCSTUDY FEP HIPCENTER HIPCENTRE",
    "hip point": "HIP",
    "knee": "KJC FEO KNEE KNEECENTER KNEECENTRE",
    "knee out": "KNE KNEEOUT KNEELAT KNEESTUDY LFC FLE LKNE KNEL LKNEE KNEELATERAL",
    "knee in": "KNM KNEEIN KNEEMED MKNEESTUDY MFC FME MKNE KNEM MKNEE KNEEMEDIAL",
    "ankle": "AJC TIO ANKLE ANKLECENTER ANKLECENTRE",
    "ankle out": "ANK ANKLEOUT ANKLELAT ANKLESTUDY LMAL FAL LANKLE ANKLELATERAL",
    "ankle in": "ANKM ANKLEIN ANKLEMED MANKLESTUDY MMAL TAM MANKLE ANKLEMEDIAL",
    "heel": "HEE HEEL CAL CALC CALCSTUDY FCC HEELBACK",
    "toe": "TOE BIGTOE TOESTUDY TOETIP TOES",
    "toe in": "MT1 FM1 TOEIN TOEMED 1META FOREFOOTIN",
    "toe out": "MT5 FM5 TOEOUT TOELAT 5META 5METASTUDY SMALLTOE FOREFOOTOUT",
    "shoulder": "SJC SHOULDER SHOULDERCENTER SHOULDERCENTRE",
    "acromion": "SHO ACR ACROMION ACROMIUM SHOULDERTOP SHOULDERSTUDY SAE ACJ",
    "elbow": "EJC ELBOW ELBOWCENTER ELBOWCENTRE",
    "elbow out": "ELB ELBOWOUT LEL ELBOWLAT LELBOWSTUDY HLE ELBOWLATERAL",
    "elbow in": "ELBM ELBOWIN MEL ELBOWMED MELBOWSTUDY HME MELB ELBOWMEDIAL",
    "wrist": "WJC WRIST WRISTCENTER WRISTCENTRE",
    "wrist thumb": "WRA WRISTIN FARADIUS LWRISTSTUDY RSP RAD WRISTLAT WRISTRADIUS",
    "wrist little": "WRB WRISTOUT FAULNA MWRISTSTUDY USP ULN WRISTMED WRISTULNA",
    "knuckle": "FIN HM2 HM3 MCP3 HANDOUT KNUCKLE",
    "head front": "FHD FRONTHEAD FHEAD HEADFRONT",
    "head back": "BHD BACKHEAD BHEAD HEADBACK",
    "ear": "EAR",
}
_OF_THE_MIDDLE = {
    "sacrum": "SACR SACRUM VSACRAL VSACRUM SACRAL SAC WAISTBACK",
    "c7": "C7 CV7 C7STUDY SPINETOP BACKTOP",
    "clavicle": "CLAV SJN CLAVICLE",
    "sternum": "STRN STERNUM SXS CHEST",
    "t10": "T10 TV10 TV8 T8 T9",
    "pelvis": "HIP HIPS MIDHIP PELVIS PELO CENTREHIP CENTERHIP",
    "neck": "NECK",
    "head": "HEAD HEADTOP TOPHEAD HTOP HEADCENTER HEADCENTRE",
    "nose": "NOSE",
}
_WITH_A_SIDE_WITHIN = {
    "WAISTLFRONT": "left asis",
    "WAISTRFRONT": "right asis",
    "WAISTLBACK": "left psis",
    "WAISTRBACK": "right psis",
    "HEADL": "left head front",
    "HEADR": "right head front",
    "HEADFRONT": "nose",
}
_SIDES = {"left": ("LEFT", "L"), "right": ("RIGHT", "R")}
_NO_LETTER = re.compile(r"[^A-Z0-9]")
_MOST_LETTERS = 64


def _table() -> dict[str, str]:
    table: dict[str, str] = {}
    for place, names in _OF_A_SIDE.items():
        for side, marks in _SIDES.items():
            for mark in marks:
                for name in names.split():
                    table.setdefault(mark + name, f"{side} {place}")
                    table.setdefault(name + mark, f"{side} {place}")
    for place, names in _OF_THE_MIDDLE.items():
        table |= dict.fromkeys(names.split(), place)
    return table | _WITH_A_SIDE_WITHIN


_PLACES = _table()


@dataclass(frozen=True, slots=True)
class Subject:
    """The known markers of one subject.

    Attributes:
        name: the prefix of its markers; perhaps empty.
        markers: the column of the first marker at each place: "left asis", "c7".
    """

    name: str
    markers: dict[str, int]


def place_of(name: str) -> str | None:
    """The place that a marker's name without a prefix means, or None: "LASI" is "left asis"."""
    if len(name) > _MOST_LETTERS:
        return None
    return _PLACES.get(_NO_LETTER.sub("", name.upper()))


def subjects(names: Sequence[str]) -> list[Subject]:
    """The subjects among the markers of a file, the one of whom most is known first."""
    shared = _shared_prefix(names)
    found: dict[str, dict[str, int]] = {}
    for column, name in enumerate(names):
        subject, _, plain = name.removeprefix(shared).rpartition(":")
        place = place_of(plain)
        if place is not None:
            found.setdefault(subject or shared.rstrip("_"), {}).setdefault(place, column)
    return sorted((Subject(*each) for each in found.items()), key=lambda one: -len(one.markers))


def _shared_prefix(names: Sequence[str]) -> str:
    """What most names begin with, up to an underscore: "Anna_" of "Anna_LASI"; "" if nothing."""
    plain = sum(place_of(name.rpartition(":")[2]) is not None for name in names)
    counted = Counter(name.rpartition("_")[0] for name in names if "_" in name)
    shared, count = counted.most_common(1)[0] if counted else ("", 0)
    return f"{shared}_" if count > max(plain, 2) else ""
