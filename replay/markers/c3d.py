"""Reads the markers of a body from C3D files, written by any processor.

The library c3d (0.6) is the peer that tests hold this against. The program does not use it: it
warns of every file without analogue channels, refuses files whose header and parameters differ in
the last bit, and counts to 2^32 where a file says so.
Source: Motion Lab Systems, "The C3D File Format, User Guide".
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from replay.markers.c3d_parameters import BLOCK, MIPS, Parameters, floats, read_parameters
from replay.markers.marker_body import MarkerMotion, body_of_markers
from replay.recording import Recording
from replay.stated import METRES, UNSTATED, Stated
from replay.text_file import file_bytes

Array = NDArray[np.float64]

_MAGIC = 0x50
_MOST_SETS = 10  # LABELS, LABELS2 ... of 255 names each
UNITS = METRES | {"meter": 1.0, "metre": 1.0, "meters": 1.0, "metres": 1.0}
UNITS |= {"millimeters": 1e-3, "centimeters": 1e-2, "millimetres": 1e-3, "inches": 0.0254}
"""Metres of each unit that files of markers name, in lower case."""
_RATES = (0.1, 1e5)
_USUAL_RATE = 100.0


def recognises_c3d(path: Path, head: bytes) -> bool:
    """Whether a file has C3D's mark, and parameters of a known processor or the suffix."""
    if len(head) < 4 or head[1] != _MAGIC or not 0 < head[0] < 128:
        return False
    place = (head[0] - 1) * BLOCK
    known = place > 0 and place + 4 <= len(head) and head[place + 3] in (84, 85, 86)
    return known or path.suffix.lower() == ".c3d"


def read_c3d(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the markers of a C3D file as the joints of a body.

    Raises:
        InputError: it cannot be read.
        ContentError: it is damaged, or its markers are of no known set.
    """
    data = file_bytes(path)
    if len(data) < 2 * BLOCK:
        raise ContentError("it ends within its header; copy it again")
    notes: list[str] = []
    motion = c3d_markers(data, notes)
    return body_of_markers(motion, stated, notes)


def c3d_markers(data: bytes, notes: list[str]) -> MarkerMotion:
    """The markers in the bytes of a file.

    Raises:
        ContentError: it is damaged, or holds no frame.
    """
    parameters = read_parameters(data)
    header = struct.unpack_from(parameters.order + "HHHHHH", data, 2)
    count, analogue, first, last = header[:4]
    start = struct.unpack_from(parameters.order + "H", data, 16)[0]
    count = int(parameters.number("POINT:USED", count)) or count
    rate = parameters.number("POINT:RATE", _header_float(data, 20, parameters.processor))
    scale = parameters.number("POINT:SCALE", _header_float(data, 12, parameters.processor))
    said = _frames(parameters, first, last)
    if not count or not start:
        raise ContentError("it holds no markers; export it with its trajectories")
    columns, seen = _points(
        memoryview(data)[(start - 1) * BLOCK :], parameters, count, analogue, scale, said
    )
    if len(columns) < said:
        notes.append(f"the file ends after {len(columns)} of {said} frames")
    if not len(columns):
        raise ContentError("it ends before its first frame; copy it again")
    if not _RATES[0] < rate < _RATES[1]:
        notes.append(f"no rate in the file: {_USUAL_RATE:.0f} frames a second (--fps-input N)")
        rate = _USUAL_RATE
    unit = "".join(parameters.texts("POINT:UNITS")[:1]).lower()
    return MarkerMotion(
        names=_names(parameters, count),
        times=np.arange(len(columns), dtype=np.float64) / rate,
        columns=columns,
        seen=seen,
        metres=UNITS.get(unit),
        up=_axis("".join(parameters.texts("POINT:Y_SCREEN")[:1])),
    )


def _names(parameters: Parameters, count: int) -> list[str]:
    names: list[str] = []
    for number in range(1, _MOST_SETS + 1):
        names += parameters.texts("POINT:LABELS" + (str(number) if number > 1 else ""))
    return (names + [f"*{number}" for number in range(len(names), count)])[:count]


def _frames(parameters: Parameters, first: int, last: int) -> int:
    """How many frames the file says it has; 16 bits of the header are too few for long ones."""
    counted = max(last - first + 1, 0)
    ends = [parameters.words(f"TRIAL:ACTUAL_{end}_FIELD") for end in ("START", "END")]
    start, end = (pair[0] + (pair[1] << 16) if len(pair) == 2 else 0 for pair in ends)
    if 0 < start <= end:
        return max(counted, end - start + 1)
    stated = max(parameters.number(f"POINT:{name}") for name in ("FRAMES", "LONG_FRAMES"))
    return max(counted, int(stated) if stated < 1e9 else 0)


def _points(
    data: memoryview, parameters: Parameters, count: int, analogue: int, scale: float, frames: int
) -> tuple[NDArray[np.generic], NDArray[np.bool_]]:
    """Positions (T, M, 3) in the file's unit, and whether each was seen (T, M)."""
    real = not scale > 0.0
    size = 4 if real else 2
    words = 4 * count + _analogue(len(data), parameters, count, analogue, size, frames)
    frames = min(frames, len(data) // (size * words))
    raw = data[: frames * size * words]
    numbers: NDArray[np.generic]
    if real:
        numbers = floats(raw, parameters.processor)
    else:
        numbers = np.frombuffer(raw, dtype=">i2" if parameters.processor == MIPS else "<i2")
    points = numbers.reshape(frames, words)[:, : 4 * count].reshape(frames, count, 4)
    seen = points[..., 3] >= 0  # type: ignore[operator]  # numbers, of one kind or the other
    if real:
        return points[..., :3], seen
    places = points[..., :3].astype(np.float32)
    places *= np.float32(scale)
    return places, seen


def _analogue(
    there: int, parameters: Parameters, count: int, said: int, size: int, frames: int
) -> int:
    """The analogue numbers of a frame: the header's, unless only the parameters' fit the file."""
    rate, own = (parameters.number(f"{group}:RATE") for group in ("ANALOG", "POINT"))
    ratio = round(rate / own) if own > 0.0 and 0.0 <= rate / own < 1e4 else 0
    used = int(parameters.number("ANALOG:USED")) * ratio
    fits = [n for n in (said, used) if frames * size * (4 * count + n) <= there + BLOCK]
    return fits[0] if fits else said


def _header_float(data: bytes, place: int, processor: int) -> float:
    return float(floats(data[place : place + 4], processor)[0])


def _axis(text: str) -> Array | None:
    """The axis that "+Z" names, or None."""
    if text.upper().lstrip("+-") not in ("X", "Y", "Z"):
        return None
    axis: Array = np.eye(3)["XYZ".index(text[-1].upper())] * (-1.0 if text[0] == "-" else 1.0)
    return axis
