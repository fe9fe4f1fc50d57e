"""What names of columns and landmarks mean: group, landmark, axis."""

from __future__ import annotations

import re

from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS

TIMES = {  # how many of its unit are a second; None where the name does not say
    **dict.fromkeys(("t", "time", "timestamp", "ts", "timestamps"), None),
    **dict.fromkeys(("t_s", "time_s", "seconds", "timestamp_s", "time_sec", "time_seconds"), 1.0),
    **dict.fromkeys(("timestamp_sec", "timestamp_seconds", "secs", "sec"), 1.0),
    **dict.fromkeys(("t_ms", "time_ms", "timestamp_ms", "milliseconds", "ms"), 1e3),
    **dict.fromkeys(("timestamp_us", "time_us", "t_us", "timestamp_usec", "microseconds"), 1e6),
    **dict.fromkeys(("timestamp_ns", "time_ns", "t_ns", "nanoseconds"), 1e9),
}
FRAMES = tuple("frame frame_id frame_number frame_index frame_idx frame_no frame_num".split())
PEOPLE = tuple("person person_id person_index pose_id performer track_id subject".split())
SURE = tuple("visibility confidence presence score vis conf v c".split())
_AXIS = {"x": "x", "y": "y", "z": "z"} | dict.fromkeys(SURE, "v")
_ANY_AXIS = "|".join(sorted(_AXIS, key=len, reverse=True))
_PREFIX = re.compile(
    r"^(?:(?:mediapipe|mp|pose|landmarks?|lm|body|kp|keypoints?|joint|point|skeleton|p)_?)+"
    r"(?=\d|[a-z])"
)
_HAND = re.compile(r"^(left|right|l|r)_?h(?:and)?_(?:landmarks?_|lm_?)?")
_PLACES = (
    re.compile(rf"^(?P<axis>{_ANY_AXIS})_?(?P<name>\d{{1,3}})$"),
    re.compile(rf"^(?P<name>\d{{1,3}})_?(?P<axis>{_ANY_AXIS})$"),
    re.compile(rf"^(?P<name>[a-z_]+)_(?P<axis>{_ANY_AXIS})$"),
    re.compile(rf"^(?P<axis>{_ANY_AXIS})_(?P<name>[a-z_]+)$"),
)
_ALIKE = {"left_foot": "left_foot_index", "right_foot": "right_foot_index"}
_HAND_ALIKE = {"pinky_finger": "pinky", "index": "index_finger", "middle": "middle_finger"}
_HAND_ALIKE |= {"ring": "ring_finger"}


def snake(text: str) -> str:
    """A name in small letters and underscores: "leftWrist.X" is "left_wrist_x"."""
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text.strip().strip("'\""))
    return re.sub(r"[^a-z0-9]+", "_", parted.lower()).strip("_")


def pose_name(text: str) -> str | None:
    """The pose landmark that a name means, or None."""
    name = snake(text)
    for plain in (name, _PREFIX.sub("", name)):
        candidate = _ALIKE.get(plain, plain)
        if candidate in POSE_LANDMARKS:
            return candidate
    return None


def hand_name(text: str) -> str | None:
    """The hand landmark that a name means, or None."""
    name = snake(text)
    name = next((name[len(p) :] for p in ("hand_landmark_", "hand_") if name.startswith(p)), name)
    stem, _, joint = name.rpartition("_")
    name = f"{_HAND_ALIKE.get(stem, stem)}_{joint}" if stem else name
    return name if name in HAND_LANDMARKS else None


def landmark_of(text: str) -> tuple[str, str] | None:
    """The group and landmark that a name means: ("image", "nose"), ("left", "wrist").

    The landmark is a bare number where it has no name.
    """
    name = snake(text)
    if name.isdecimal() and len(name) <= 3:
        return "image", name
    group = "image"
    words = name.split("_")
    if "world" in words:
        group, name = "world", "_".join(word for word in words if word != "world")
    if (hand := _HAND.match(name)) is not None:
        side = "left" if hand[1][0] == "l" else "right"
        rest = name[hand.end() :]
        if rest.isdecimal() and int(rest) < len(HAND_LANDMARKS):
            return side, HAND_LANDMARKS[int(rest)]
        found = hand_name(rest)
        return None if found is None else (side, found)
    if (pose := pose_name(name)) is not None:
        return group, pose
    bare = _PREFIX.sub("", name)
    if bare.isdecimal() and len(bare) <= 3:
        return group, bare
    found = hand_name(name)
    return None if found is None else ("right", found)


def column_of(header: str) -> tuple[str, str, str] | None:
    """Group, landmark and axis (x, y, z, v) of a column's header; None if it is no landmark's."""
    name = snake(header)
    hand = _HAND.match(name)
    before, rest = (name[: hand.end()], name[hand.end() :]) if hand else ("", name)
    world = "world" in rest.split("_")
    rest = "_".join(word for word in rest.split("_") if word not in ("world", "m"))
    for candidate in (rest, _PREFIX.sub("", rest)):
        for pattern in _PLACES:
            if (match := pattern.match(candidate)) is None:
                continue
            landmark = landmark_of(f"{before}{'world_' if world else ''}{match['name']}")
            if landmark is not None:
                return *landmark, _AXIS[match["axis"]]
    return None
