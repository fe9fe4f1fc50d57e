"""Write recordings as CSV tables for spreadsheets and scripts, and read them back.

The first line is a comment with the skeleton as JSON, the second names the columns: ``performer``,
``time`` and ``arrival`` [s]; for each joint ``x``, ``y``, ``z`` [m] and ``confidence``; if there
are rotations also ``qx``, ``qy``, ``qz``, ``qw``, joint to world. Each further row is a frame;
unknown values are ``nan``. Numbers have all their digits, so a recording is read back bit for bit.
"""

from __future__ import annotations

import csv
import io
import re
from itertools import chain
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.mcap.frame_json import decode_skeleton, encode_skeleton
from replay.recording import Recording
from replay.text_file import file_text

Array = NDArray[np.float64]

MARK = "# bunraku.skeleton "
MOST_BYTES = 1 << 30
MOST_SHEET_BYTES = 128 << 20  # of a file that a spreadsheet saved; none holds more rows
_DECIMAL_COMMA = re.compile(r"-?\d+,\d+(?:[eE][-+]?\d+)?")
_LINE_END = re.compile(r"[\r\n]")
_PLACE = ("x", "y", "z", "confidence")
_TURN = ("qx", "qy", "qz", "qw")


def write_joint_table(file: TextIO, recording: Recording) -> None:
    """Write every frame of a recording.

    Args:
        file: open for writing, without translation of line ends.
        recording: of any number of performers.
    """
    names = [_LINE_END.sub(" ", name) for name in recording.skeleton.names]
    per_joint = _PLACE if recording.rotations is None else _PLACE + _TURN
    file.write(f"{MARK}{encode_skeleton(recording.skeleton)}\n")
    table = csv.writer(file, lineterminator="\n")
    table.writerow(
        [
            "performer",
            "time",
            "arrival",
            *(f"{name}.{part}" for name in names for part in per_joint),
        ]
    )
    joints = [recording.positions, recording.confidence[..., None]]
    if recording.rotations is not None:
        joints.append(recording.rotations)
    for index, performer in enumerate(recording.performers.tolist()):
        row = np.concatenate([values[index] for values in joints], axis=1).ravel()
        clocks = [float(recording.times[index]), float(recording.arrivals[index])]
        table.writerow([performer, *clocks, *row.tolist()])


def recognises_joint_table(path: Path, head: bytes) -> bool:
    """Whether a file begins like one of `write_joint_table`, perhaps quoted by a spreadsheet."""
    return head.removeprefix(b"\xef\xbb\xbf").lstrip(b'"').startswith(MARK.encode())


def read_joint_table(path: Path) -> Recording:
    """Read a file of `write_joint_table`; frames are sorted by time, and times start at 0.

    A spreadsheet that saves it quotes the first line, cuts it at commas, pads it, and may change
    the encoding, the separator and the decimal point; all of this is undone.

    Raises:
        InputError: the file cannot be read, its skeleton is damaged, or a row does not fit it.
    """
    skeleton, rows, notes = _parsed(path)
    joints = len(skeleton.names)
    per_joint, left = divmod(rows.shape[1] - 3, joints)
    if left or per_joint not in (4, 8):
        raise InputError(
            f"{path}: a row has {rows.shape[1]} columns; expected 3 and 4 or 8 for each of its "
            f"{joints} joints"
        )
    if not np.isfinite(rows[:, :2]).all():
        raise InputError(f"{path}: a row has no performer or no time")
    rows = rows[np.argsort(rows[:, 1], kind="stable")]
    cells = rows[:, 3:].reshape(len(rows), joints, per_joint)
    cells[~np.isfinite(cells)] = np.nan
    positions, confidence = cells[..., :3], np.clip(np.nan_to_num(cells[..., 3]), 0.0, 1.0)
    unseen = np.isnan(positions).any(axis=2)
    positions[unseen] = np.nan
    confidence[unseen] = 0.0
    arrivals = np.where(np.isfinite(rows[:, 2]), rows[:, 2], np.nan)
    return Recording(
        skeleton=skeleton,
        times=rows[:, 1] - rows[0, 1],
        positions=positions,
        rotations=cells[..., 4:] if per_joint == 8 else None,
        confidence=confidence,
        performers=np.clip(rows[:, 0], 0, (1 << 31) - 1).astype(np.int64),
        arrivals=arrivals - rows[0, 1],
        notes=notes,
    )


def _parsed(path: Path) -> tuple[Skeleton, Array, tuple[str, ...]]:
    """The skeleton, the rows and notes."""
    notes: tuple[str, ...] = ()
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"{path}: larger than {MOST_BYTES >> 20} MiB; split the recording")
        with path.open("rb") as start:
            plain = (
                start.read(len(MARK) + 3).removeprefix(b"\xef\xbb\xbf").startswith(MARK.encode())
            )
        if plain:
            with path.open(encoding="utf-8-sig", errors="replace") as file:
                skeleton = decode_skeleton(file.readline().removeprefix(MARK).rstrip(",;\n"))
                file.readline()
                first = next((line for line in file if line.strip()), "")
                lines = chain([first], file)
                rows = np.loadtxt(lines, delimiter=",", ndmin=2) if first else np.empty((0, 3))
        else:
            skeleton, rows = _from_spreadsheet(file_text(path, MOST_SHEET_BYTES))
            notes = ("saved by a spreadsheet, which may have rounded numbers",)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except InputError as error:
        raise InputError(
            f"{path}: {error}" if str(path) not in str(error) else str(error)
        ) from error
    except (ValueError, csv.Error) as error:
        raise InputError(f"{path}: not a table of numbers: {error}") from error
    if not len(rows):
        raise InputError(f"{path} holds a skeleton but no frame")
    return skeleton, rows, notes


def _from_spreadsheet(text: str) -> tuple[Skeleton, Array]:
    """The skeleton and rows of a table that a spreadsheet saved."""
    second_line = text.partition("\n")[2].partition("\n")[0]
    separator = max(",;\t", key=second_line.count)
    table = list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))
    if separator == ";":
        table = [[_with_point(cell) for cell in row] for row in table]
    skeleton = decode_skeleton(",".join(table[0]).removeprefix(MARK).rstrip(", "))
    columns = sum(bool(name.strip()) for row in table[1:2] for name in row)
    filled = [row[:columns] for row in table[2:] if any(cell.strip() for cell in row)]
    rows = np.array([[float(cell.strip() or "nan") for cell in row] for row in filled])
    return skeleton, rows.reshape(len(filled), -1)


def _with_point(cell: str) -> str:
    """A cell with the decimal comma of its number replaced."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell.strip()) else cell
