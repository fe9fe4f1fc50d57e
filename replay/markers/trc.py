"""Read TRC files of OpenSim, Cortex, Pose2Sim and OpenCap: markers or key points of a body.

Source: OpenSim Documentation, "Marker (.trc) Files".
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from replay.bounds import check_poses
from replay.kinect.text_rows import MOST_LINES
from replay.markers.c3d import UNITS
from replay.markers.marker_body import MarkerMotion, body_of_markers
from replay.recording import Recording
from replay.stated import UNSTATED, Stated
from replay.text_file import file_text

Array = NDArray[np.float64]

_MOST_BYTES = 256 << 20
_MOST_MARKERS = 10_000
_USUAL_RATE = 100.0


def recognises_trc(path: Path, head: bytes) -> bool:
    """Whether a file begins with PathFileType, or has the header of a table of markers."""
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    return start.startswith(b"PathFileType") or (
        path.suffix.lower() == ".trc" and b"Frame#" in head
    )


def read_trc(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the markers of a TRC file as the joints of a body.

    Raises:
        InputError: it cannot be read.
        ContentError: it is damaged, or its markers are of no known set.
    """
    text = file_text(path, _MOST_BYTES)
    if text.count("\n") > MOST_LINES:
        raise ContentError(f"more than {MOST_LINES} lines; split the recording")
    notes: list[str] = []
    return body_of_markers(trc_markers(text, notes), stated, notes)


def trc_markers(text: str, notes: list[str]) -> MarkerMotion:
    """The markers in the text of a file.

    Raises:
        ContentError: it has no row of names or no frame.
    """
    lines = text.split("\n")
    titles = next((at for at, line in enumerate(lines) if _is_title(line)), None)
    if titles is None:
        raise ContentError('it has no row "Frame#  Time  ..." of names; export it again')
    cells = [cell.strip() for cell in lines[titles].split("\t")]
    names, places = _columns(cells[2:])
    said = _stated_values(lines[:titles])
    times, columns = _frames(lines[titles + 1 :], len(cells), places, notes)
    rate = _number(said.get("datarate", ""))
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        if not 0.1 < rate < 1e5:
            rate = _USUAL_RATE
            notes.append(f"no times in the file: {rate:.0f} frames a second (--fps-input N)")
        times = np.arange(len(columns), dtype=np.float64) / rate
    return MarkerMotion(names, times, columns, metres=UNITS.get(said.get("units", "").lower()))


def _is_title(line: str) -> bool:
    return line.lstrip().lower().startswith("frame") and "time" in line.lower()


def _stated_values(lines: Sequence[str]) -> dict[str, str]:
    """The values of the header, by their names in lower case."""
    for names, values in pairwise(lines):
        if "datarate" in names.lower():
            pairs = zip(names.split("\t"), values.split("\t"), strict=False)
            return {name.strip().lower(): value.strip() for name, value in pairs}
    return {}


def _columns(cells: list[str]) -> tuple[list[str], list[int]]:
    """The names of the markers, and the column in which the three of each begin.

    Three columns belong to a name, of which the others are empty, or repeat it with _y and _z.

    Raises:
        ContentError: there is no marker, or there are too many.
    """
    names: list[str] = []
    places: list[int] = []
    tight = bool(cells) and all(cells[:-1]) and not cells[0].lower().endswith("_x")
    for at, cell in enumerate(cells):
        if cell and not cell.lower().endswith(("_y", "_z")):
            names.append(cell[:-2] if cell.lower().endswith("_x") else cell)
            places.append(2 + (3 * len(places) if tight else at))
    if not 0 < len(names) <= _MOST_MARKERS:
        raise ContentError(f"it names {len(names)} markers; export it again")
    return names, places


def _frames(
    lines: Sequence[str], width: int, places: list[int], notes: list[str]
) -> tuple[Array, Array]:
    """Times (T,) and positions (T, M, 3); NaN where a cell is empty.

    Raises:
        ContentError: there is no frame, or there are too many.
    """
    width = max(width, places[-1] + 3)
    numbers = array("d")
    count = odd = 0
    for line in lines:
        cells = line.split("\t")
        if not cells[0].strip() or not np.isfinite(_number(cells[0])):
            odd += bool(line.strip()) and count > 0
            continue
        row = [_number(cell) for cell in cells[:width]]
        if len(row) < places[-1] + 3 and count and len(row) < width // 2:
            odd += 1
            continue
        numbers.extend(row + [np.nan] * (width - len(row)))
        count += 1
        check_poses(count, width // 3 + 1)
    if not count:
        raise ContentError("it holds no frame")
    if odd:
        notes.append(f"{odd} lines that are no frames were left out")
    table = np.frombuffer(numbers).reshape(count, width)
    at = np.array(places)[:, None] + np.arange(3)
    return table[:, 1].copy(), table[:, at]


def _number(cell: str) -> float:
    """The number in a cell, with a point or a comma; NaN if it holds none."""
    cell = cell.strip()
    if not cell or len(cell) > 40:
        return float("nan")
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return float("nan")
