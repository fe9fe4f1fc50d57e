"""Read the skeleton of an ASF file (Acclaim): bones, their axes, their tree.

Source: University of Wisconsin, "Acclaim ASF/AMC", and the skeletons of the CMU database.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError

Array = NDArray[np.float64]

MOST_BONES = 1000
_INCH = 0.0254


@dataclass(slots=True)
class Bone:
    """A bone of an ASF file, or its root, which has no length.

    Attributes:
        name: as the file has it.
        parent: number of the bone that it hangs on, -1 for the root.
        vector: (3,) from its start to its end at rest, in the file's unit and world.
        axis: its angles [rad] about the axes of `axis_order`, the first one turned first.
        axis_order: three of x, y, z.
        motion: its channels in the order of their numbers: tx, ty, tz, rx, ry, rz, l.
    """

    name: str
    parent: int = -1
    vector: Array = field(default_factory=lambda: np.zeros(3))
    axis: Array = field(default_factory=lambda: np.zeros(3))
    axis_order: str = "xyz"
    motion: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class AsfSkeleton:
    """The bones of a file, parents first; the first is the root.

    Attributes:
        bones: all of them.
        place: (3,) of the root at rest.
        metres: of the file's unit, if its length is CMU's.
    """

    bones: list[Bone]
    place: Array
    metres: float | None


def read_asf(text: str) -> AsfSkeleton:
    """Read the text of an ASF file.

    Raises:
        ContentError: it is damaged.
    """
    sections = _sections(text)
    degrees, length = True, 1.0
    for words in sections.get("units", []):
        if words[0] == "angle":
            degrees = not words[-1].lower().startswith("rad")
        elif words[0] == "length":
            length = _numbers(words[1:], 1)[0]
    root, place = _root(sections.get("root", []), degrees)
    bones = {"root": root} | _bones(sections.get("bonedata", []), degrees)
    ordered = _in_order(sections.get("hierarchy", []), bones)
    return AsfSkeleton(ordered, place, _INCH / length if abs(length - 0.45) < 1e-6 else None)


def _sections(text: str) -> dict[str, list[list[str]]]:
    """The lines of each section, in words."""
    sections: dict[str, list[list[str]]] = {}
    own: list[list[str]] = []
    for line in text.split("\n"):
        words = line.partition("#")[0].split()
        if not words:
            continue
        if words[0].startswith(":"):
            own = sections.setdefault(words[0][1:].lower(), [])
            words = words[1:]
        if words:
            own.append(words)
    return sections


def _root(lines: list[list[str]], degrees: bool) -> tuple[Bone, Array]:
    root, place = Bone("root", motion=("tx", "ty", "tz", "rx", "ry", "rz")), np.zeros(3)
    for words in lines:
        match words[0].lower():
            case "order":
                root.motion = tuple(word.lower() for word in words[1:7])
            case "axis":
                root.axis_order = _order(words[1:])
            case "position":
                place = _numbers(words[1:], 3)
            case "orientation":
                root.axis = _angles(words[1:], degrees)
    return root, place


def _bones(lines: list[list[str]], degrees: bool) -> dict[str, Bone]:
    bones: dict[str, Bone] = {}
    bone, direction, length = Bone(""), np.zeros(3), 0.0
    for words in lines:
        match words[0].lower():
            case "begin":
                bone, direction, length = Bone(""), np.zeros(3), 0.0
            case "name":
                bone.name = words[-1]
            case "direction":
                direction = _numbers(words[1:], 3)
            case "length":
                length = _numbers(words[1:], 1)[0]
            case "axis":
                bone.axis, bone.axis_order = _angles(words[1:], degrees), _order(words[4:])
            case "dof":
                bone.motion = tuple(word.lower() for word in words[1:8])
            case "end" if bone.name:
                bone.vector = direction * length
                if len(bones) >= MOST_BONES:
                    raise ContentError(f"its skeleton has more than {MOST_BONES} bones")
                bones[bone.name] = bone
    return bones


def _in_order(lines: list[list[str]], bones: dict[str, Bone]) -> list[Bone]:
    """The bones of the tree, parents first, with the numbers of their parents."""
    children: dict[str, list[str]] = {}
    for words in lines:
        if words[0] not in ("begin", "end"):
            children.setdefault(words[0], []).extend(words[1:])
    ordered, places = [bones["root"]], {"root": 0}
    for bone in ordered:  # grows
        for name in children.get(bone.name, []):
            if name not in bones or name in places:
                raise ContentError(f"its tree is damaged at {name[:40]!r}")
            places[name] = len(ordered)
            bones[name].parent = places[bone.name]
            ordered.append(bones[name])
    if len(ordered) < 2:
        raise ContentError("its skeleton has no bones")
    return ordered


def _order(words: list[str]) -> str:
    order = words[0].lower() if words else "xyz"
    if sorted(order) != ["x", "y", "z"]:
        raise ContentError(f"its axis order {order[:8]!r} is none of x, y, z")
    return order


def _angles(words: list[str], degrees: bool) -> Array:
    angles = _numbers(words, 3)
    return np.radians(angles) if degrees else angles


def _numbers(words: list[str], count: int) -> Array:
    try:
        numbers = np.array([float(word[:40]) for word in words[:count]])
    except ValueError:
        raise ContentError(f"{' '.join(words)[:40]!r} are no numbers") from None
    if len(numbers) < count or not (np.abs(numbers) < 1e6).all():
        raise ContentError(f"expected {count} numbers, got {' '.join(words)[:40]!r}")
    return numbers
