"""Decode the joint messages of NI mate, OSCeleton, Animata and KinectV2-OSC.

None of them names its format; address and arguments determine it. Received text is never evaluated:
an address is looked up, and ignored if it is unknown.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from devices.kinect.joints import KINECT_V2
from devices.osc.messages import Message
from devices.osc.openni_joints import joint_called, number_in

FARTHEST = 1e5  # units, whatever they are, of a plausible position


class JointFormat(StrEnum):
    """Format of the messages; the value is that of the option ``format``."""

    NIMATE = "nimate"
    OSCELETON = "osceleton"
    ANIMATA = "animata"
    KINECT = "kinect2"


@dataclass(frozen=True, slots=True)
class JointMessage:
    """One joint of one user.

    Attributes:
        format: determines axes and units of position and rotation.
        user: the sender's own number.
        joint: index in KINECT_V2.
        position: in the sender's axes and units, z = 0 in Animata; None if missing.
        rotation: (x, y, z, w) as sent, unit length; None if missing.
    """

    format: JointFormat
    user: int
    joint: int
    position: tuple[float, float, float] | None
    rotation: tuple[float, float, float, float] | None = None


_KINECT = re.compile(r"/?bodies/([0-9]{1,20})/joints/([A-Za-z]{1,20})")
_QUARTZ = re.compile(r"/?joint/[^/]+/[0-9]{1,10}")
_ELSEWHERE = ("orient", "user", "bodies", "osceleton2", "hand")  # other kinds of messages
_JOINT = ("/joint", "joint", "/joint_", "joint_")
_OMNI = re.compile(r"/?(?:[^/]+/)*skeleton[_/]?[0-9]*")
_JOINTS = {name: joint for joint, name in enumerate(KINECT_V2.names)}

# Omni's order is not documented. The order of the sensors' own SDKs, by the number of joints:
_LEFT_ARM_FIRST = (
    *("l_shoulder l_elbow l_hand r_shoulder r_elbow r_hand".split()),
    *("l_hip l_knee l_foot r_hip r_knee r_foot".split()),
)
_NITE = ("head", "neck", "torso", *_LEFT_ARM_FIRST)
OMNI_ORDERS: dict[int, tuple[int, ...]] = {
    len(_NITE): tuple(joint for name in _NITE if (joint := joint_called(name)) is not None),
    len(KINECT_V2.names): tuple(range(len(KINECT_V2.names))),
}


def read_joints(
    message: Message, only: JointFormat | None = None, omni: Sequence[int] = ()
) -> list[JointMessage] | None:
    """Return the joints in a message: [] for other messages, None if it is malformed.

    Args:
        message: as received.
        only: the format to accept; None to detect it from the message.
        omni: the joints of NI mate's Omni list, in its order; empty to derive it from their number.
    """
    kinect = _KINECT.fullmatch(message.address)
    if kinect is not None:
        accepted = _accepts(only, JointFormat.KINECT)
        return _kinect(message, int(kinect[1]), kinect[2]) if accepted else []
    if message.address in _JOINT:
        return _named_by_argument(message, only)
    quartz = only is not JointFormat.NIMATE and _QUARTZ.fullmatch(message.address) is not None
    format = JointFormat.OSCELETON if quartz else JointFormat.NIMATE
    if not _accepts(only, format) or message.address.lstrip("/").split("/", 1)[0] in _ELSEWHERE:
        return []
    if _OMNI.fullmatch(message.address):
        return _omni(message, omni)
    return _named_by_address(message, format)


def _accepts(only: JointFormat | None, format: JointFormat) -> bool:
    return only is None or format is only


def _kinect(message: Message, user: int, name: str) -> list[JointMessage] | None:
    joint = _JOINTS.get(name)
    if joint is None:
        return []
    position = _position(message.arguments) if message.tags == "fff" else None
    return None if position is None else [JointMessage(JointFormat.KINECT, user, joint, position)]


def _named_by_argument(message: Message, only: JointFormat | None) -> list[JointMessage] | None:
    """Decode OSCeleton's ``/joint name user x y z`` and Animata's ``/joint nameUSER x y``."""
    tags, arguments = message.tags, message.arguments
    if tags[:1] != "s" or tags.lstrip("s").lstrip("i") not in ("ff", "fff"):
        return None
    name, numbers = str(arguments[0]), arguments[tags.rindex("f") - tags.count("f") + 1 :]
    user = arguments[1] if tags[1] == "i" else number_in(name)
    joint = joint_called(name)
    assert isinstance(user, int)
    format = JointFormat.ANIMATA if len(numbers) == 2 else JointFormat.OSCELETON
    if format is JointFormat.OSCELETON and only is JointFormat.NIMATE:
        format = JointFormat.NIMATE  # it can write in this style too, in its own axes
    position = _position((*numbers, 0.0)[:3])
    if position is None or len(tags) > 5:
        return None
    if joint is None or not (_accepts(only, format) or only is JointFormat.NIMATE):
        return []
    return [JointMessage(format, user, joint, position)]


def _named_by_address(message: Message, format: JointFormat) -> list[JointMessage] | None:
    """Decode NI mate's formats, distinguished by the number of floats: 3, 4 or 7."""
    joint = joint_called(message.address)
    if joint is None:
        return []
    floats = [
        value for tag, value in zip(message.tags, message.arguments, strict=True) if tag in "fd"
    ]
    users = [
        value for tag, value in zip(message.tags, message.arguments, strict=True) if tag == "i"
    ]
    if len(floats) + len(users) != len(message.tags) or len(users) > 1:
        return None
    user = users[0] if users else number_in(message.address)
    assert isinstance(user, int)
    position = _position(floats[:3]) if len(floats) in (3, 7) else None
    rotation = _rotation(floats[-4:]) if len(floats) in (4, 7) else None
    if position is None and len(floats) != 4:
        return None
    if position is None and rotation is None:
        return []  # a limb whose orientation was not found has four zeros
    return [JointMessage(format, user, joint, position, rotation)]


def _omni(message: Message, order: Sequence[int]) -> list[JointMessage] | None:
    """Decode NI mate's list of the positions of all joints."""
    tags = message.tags
    users, values = message.arguments[: tags.count("i")], message.arguments[tags.count("i") :]
    if tags.lstrip("i").strip("f") or len(users) > 1 or len(values) % 3:
        return None
    joints = order or OMNI_ORDERS.get(len(values) // 3, ())
    if not joints or len(values) != 3 * len(joints):
        return None
    user = users[0] if users else number_in(message.address)
    assert isinstance(user, int)
    positions = [_position(values[3 * row : 3 * row + 3]) for row in range(len(joints))]
    return [
        JointMessage(JointFormat.NIMATE, user, joint, position)
        for joint, position in zip(joints, positions, strict=True)
        if position is not None
    ]


def _position(values: Sequence[object]) -> tuple[float, float, float] | None:
    """Three numbers, or None if there are not three or the position is implausible."""
    if len(values) != 3:
        return None
    x, y, z = values
    assert isinstance(x, float)
    assert isinstance(y, float)
    assert isinstance(z, float)
    return (x, y, z) if abs(x) + abs(y) + abs(z) < FARTHEST else None  # None for NaN


def _rotation(values: Sequence[object]) -> tuple[float, float, float, float] | None:
    """NI mate's w, x, y, z as x, y, z, w of unit length; None if that is no rotation."""
    w, x, y, z = values
    assert isinstance(w, float)
    assert isinstance(x, float)
    assert isinstance(y, float)
    assert isinstance(z, float)
    square = w * w + x * x + y * y + z * z
    if not 0.25 < square < 4.0:
        return None
    length = square**0.5
    return x / length, y / length, z / length, w / length
