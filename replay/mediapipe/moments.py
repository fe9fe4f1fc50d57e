"""The landmarks in a text file: people and landmark groups at each moment, with the file's facts.

Groups are "world" (pose [m]), "image" (pose in the image, or in a space that is not named), "left"
and "right" (hands).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from devices.errors import InputError
from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS

Point = tuple[float, float, float, float]
"""x, y, z and confidence; NaN where a number is missing."""

Points = dict[str, Point]
"""Points by the name of their landmark, or its number until `name_numbers`."""

GROUPS = ("world", "image", "left", "right")
MAX_FRAMES = 1_000_000


@dataclass(slots=True)
class Moment:
    """One frame.

    Attributes:
        time: as the file has it, of the unit `LandmarkText.second`; None if it has none.
        frame: its number; None if it has none.
        people: the points of each person by group.
    """

    time: float | None = None
    frame: float | None = None
    people: dict[int, dict[str, Points]] = field(default_factory=dict)

    def add(self, group: str, points: Points, person: int = 0) -> None:
        """Add some points; those of a landmark that is known already are left out."""
        if points:
            known = self.people.setdefault(person, {}).setdefault(group, {})
            known |= {name: point for name, point in points.items() if name not in known}


@dataclass(slots=True)
class LandmarkText:
    """What a file holds.

    Attributes:
        moments: in the order of the file.
        second: of its times in one second; None if their unit is not said.
        rate: frames per second that it states, or None.
        size: width and height of the image [pixels] that it states, or None.
        notes: assumptions that were made.
    """

    moments: list[Moment]
    second: float | None = None
    rate: float | None = None
    size: tuple[float, float] | None = None
    notes: list[str] = field(default_factory=list)


def point(values: Sequence[float]) -> Point:
    """A point from x, y, z and confidence, as many as there are."""
    x, y, z, sure = (*values, *[math.nan] * 4)[:4]
    return x, y, 0.0 if math.isnan(z) else z, 1.0 if math.isnan(sure) else sure


def bounded(count: int) -> None:
    """Refuse more frames than are read.

    Raises:
        InputError: there are more than `MAX_FRAMES`.
    """
    if count > MAX_FRAMES:
        raise InputError(f"it holds more than {MAX_FRAMES} frames")


def name_numbers(text: LandmarkText) -> None:
    """Give landmarks that have numbers in place of names their names, everywhere in a text.

    21 numbers are a hand, 42 are two, all others begin with the 33 of a pose. Most programs that
    write tables count from 1, MediaPipe itself from 0; a file without number 0 counts from 1.
    """
    for group in ("image", "world"):
        known = [
            groups[group] for m in text.moments for groups in m.people.values() if group in groups
        ]
        numbers = {int(name) for points in known for name in points if name.isdecimal()}
        if not numbers:
            continue
        meant = _meaning(numbers, group, text.notes)
        for moment in text.moments:
            for person, groups in moment.people.items():
                points = groups.pop(group, {})
                moment.add(group, {n: p for n, p in points.items() if not n.isdecimal()}, person)
                for name, found in points.items():
                    if name.isdecimal() and int(name) in meant:
                        place, landmark = meant[int(name)]
                        moment.add(place, {landmark: found}, person)


def _meaning(numbers: set[int], group: str, notes: list[str]) -> dict[int, tuple[str, str]]:
    """The group and landmark that each number means."""
    first = 0 if 0 in numbers or not {1, len(POSE_LANDMARKS)} & numbers else 1
    if first:
        notes.append("landmarks are counted from 1")
    count, hand = len(numbers), len(HAND_LANDMARKS)
    if count not in (hand, 2 * hand) or max(numbers) - first + 1 != count:
        return {first + place: (group, name) for place, name in enumerate(POSE_LANDMARKS)}
    sides = ("right",) if count == hand else ("left", "right")
    notes.append(
        "a hand of no known side was taken as the right one (--mirror-input)"
        if count == hand
        else "two hands of no known side were taken as the left and the right one"
    )
    return {
        first + place: (side, name)
        for place, (side, name) in enumerate((s, n) for s in sides for n in HAND_LANDMARKS)
    }
