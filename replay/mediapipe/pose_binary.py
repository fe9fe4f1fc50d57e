"""Parse binary .pose files of the pose-format library, versions 0.1 and 0.2.

A header names components (each a list of named points); then follow all coordinates of all frames,
then all confidences, as float32. Version 0.1 counts frames in 16 bits, which long files overflow:
the file size gives the number there.
Source: sign-language-processing/pose, docs/specs/v0.1.md and v0.2.md.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError

Array = NDArray[np.float64]

MAX_VALUES = 200_000_000
_HEADER = struct.Struct("<fHHHH")


@dataclass(frozen=True, slots=True, eq=False)
class PoseFile:
    """The contents of a .pose file.

    Attributes:
        size: width and height of the image [pixels].
        rate: frames per second.
        components: point names by component, in the order of the points.
        points: (T, people, N, 3) in the image's axes; z is 0 if the file has none; not masked.
        confidence: (T, people, N); 0 where a point was not seen.
    """

    size: tuple[int, int]
    rate: float
    components: dict[str, list[str]]
    points: Array
    confidence: Array


class _Cursor:
    """Reads successive values from bytes; reading beyond the end is an InputError."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def take(self, layout: str) -> tuple[float, ...]:
        try:
            found = struct.unpack_from(layout, self.data, self.at)
        except struct.error as error:
            raise InputError("the file ends inside its header") from error
        self.at += struct.calcsize(layout)
        return found

    def text(self) -> str:
        (length,) = self.take("<H")
        start = self.at
        self.take(f"<{int(length)}x")
        return self.data[start : self.at].decode(errors="replace")


def has_pose_header(head: bytes) -> bool:
    """Whether some bytes begin a .pose file: a version, and a first component with a name."""
    if len(head) < _HEADER.size + 2:
        return False
    version, *_, components = _HEADER.unpack_from(head)
    (length,) = struct.unpack_from("<H", head, _HEADER.size)
    name = head[_HEADER.size + 2 :][:length]
    known = round(version, 3) in (0.1, 0.2) and 0 < components < 64 and 0 < length < 100
    return known and len(name) == length and name.isascii() and name.decode("latin-1").isprintable()


@np.errstate(invalid="ignore")  # values of a damaged file
def parse_pose(data: bytes) -> PoseFile:
    """Return the contents of a .pose file.

    Raises:
        InputError: another version, truncated before the first frame, or impossible counts.
    """
    cursor = _Cursor(data)
    version, width, height, _, count = cursor.take(_HEADER.format)
    if round(version, 3) not in (0.1, 0.2):
        raise InputError(f"its version is {version:.3g}; only 0.1 and 0.2 can be read")
    components, dimensions = _components(cursor, int(count))
    newer = round(version, 3) == 0.2
    rate, frames, people = cursor.take("<fIH" if newer else "<HHH")
    points = sum(map(len, components.values()))
    stride = int(people) * points * (dimensions + 1)
    if stride == 0 or not np.isfinite(rate):
        raise InputError("it holds no people or no points, or its frame rate is damaged")
    there = (len(data) - cursor.at) // (4 * stride)
    if newer and there < frames:
        # Confidences follow all coordinates: in a truncated file they cannot be found.
        raise InputError(f"it is truncated: it states {int(frames)} frames and holds {there}")
    total = int(frames) if newer else there
    if total == 0 or total * stride > MAX_VALUES:
        raise InputError(f"it holds {total} frames of {points} points, which is none or too many")
    values = np.frombuffer(data, "<f4", total * stride, cursor.at).astype(np.float64)
    cut = total * int(people) * points * dimensions
    found = values[:cut].reshape(total, int(people), points, dimensions)
    flat = np.zeros((*found.shape[:3], 3))
    flat[..., : min(dimensions, 3)] = found[..., :3]
    return PoseFile(
        size=(int(width), int(height)),
        rate=float(rate),
        components=components,
        points=flat,
        confidence=values[cut:].reshape(total, int(people), points),
    )


def _components(cursor: _Cursor, count: int) -> tuple[dict[str, list[str]], int]:
    """Point names by component, and the number of coordinates per point."""
    components: dict[str, list[str]] = {}
    dimensions = 0
    for _ in range(count):
        name, layout = cursor.text(), cursor.text()
        points, limbs, colours = (int(n) for n in cursor.take("<HHH"))
        components[name] = [cursor.text() for _ in range(points)]
        cursor.take(f"<{2 * limbs + 3 * colours}H")
        dimensions = max(dimensions, len(layout) - 1)
        if not layout.startswith("XY") or not layout.endswith("C"):
            raise InputError(
                f"its points have the layout {layout!r}; only XYC and XYZC can be read"
            )
    if len(components) != count:
        raise InputError("two of its components have the same name")
    return components, dimensions
