"""Parse BVH text: the hierarchy of joints and the table of channel values, without interpretation.

The format has no standard. The parser accepts the variants found in practice: any white space and
case and encoding, several roots, joints without end sites, names with blanks, colons and dots,
comments, frames split over lines, a wrong frame count, a truncated last frame, decimal commas,
minus signs that begin the next number or are those of a typesetter, frame times in milliseconds.
Source: Meredith and Maddock 2001, "Motion Capture File Formats Explained", section 2.
"""

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from replay.text_file import file_text

MOST_JOINTS = 10_000
MOST_LINES = 10_000_000
MOST_POSES = 20_000_000  # frames times joints
_LARGEST = 1e7  # largest plausible length or angle
_USUAL_FRAME_TIME = 1 / 30
_USUAL_RATES = (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 75, 90, 100, 120, 144, 200, 240, 250)
_SLOWEST = 1.5  # [s] a frame; a greater frame time has another unit
_LINES_AT_ONCE = 4096
_CHANNEL = re.compile(r"([XYZ])(position|rotation|scale)$", re.IGNORECASE)
_MOTION = re.compile(r"\}\s*MOTION\b", re.IGNORECASE)
_TIMING = re.compile(
    r"\s*Frames\s*:?[ \t]*([^\s:]*)\s+Frame\s*Time\s*:?[ \t]*([^\s:]*)", re.IGNORECASE
)
_COMMENT = re.compile(r"(?m)(?:^|(?<=\s))(?:#|//).*$")
_NUMBERS = re.compile(r"(?im)^[ \t]*OFFSET[^\n{}]*")
_MINUS = str.maketrans(dict.fromkeys("\u2212\u2010\u2011\u2012\u2013\ufe63\uff0d", "-"))
_GLUED = re.compile(r"(?<=[\d.])-(?=[\d.])")
_NOT_A_NUMBER = re.compile(r"[-+]?(?:1\.#\w+|nan\(\w*\))", re.IGNORECASE)  # C runtime of Windows


@dataclass(slots=True)
class BvhJoint:
    """A joint or end site, as declared in the file.

    Attributes:
        name: as written; "" for an end site.
        parent: index of the joint that encloses it, -1 for a root.
        offset: from the parent at rest, in the file's unit.
        channels: (axis 0 to 2, "position", "rotation" or "scale"), in column order.
    """

    name: str
    parent: int
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    channels: list[tuple[int, str]] = field(default_factory=list)


@dataclass(frozen=True, slots=True, eq=False)
class BvhText:
    """The contents of a BVH file, without interpretation.

    Attributes:
        joints: in the order of the file, parents first, with end sites.
        motion: (T, C) values of all channels; NaN where the file has no usable number.
        frame_time: [s] between frames, positive.
        notes: corrections that the parser made.
    """

    joints: list[BvhJoint]
    motion: NDArray[np.float64]
    frame_time: float
    notes: list[str]


def read_bvh_text(path: Path) -> BvhText:
    """Parse the file at `path`.

    Raises:
        InputError: the file is unreadable, too large or not BVH; with the line where known.
    """
    text = file_text(path)
    if (lines := text.count("\n")) > MOST_LINES:
        raise InputError(f"{path}: {lines} lines are too many; remove the empty ones")
    if "#" in text or "//" in text:
        text = _COMMENT.sub("", text)
    motion = _MOTION.search(text)
    if not re.match(r"\s*HIERARCHY\b", text, re.IGNORECASE):
        raise InputError(f"{path}: not a BVH file, it does not begin with HIERARCHY")
    if motion is None:
        raise InputError(
            f"{path}: no MOTION section after the hierarchy; the file may be truncated"
        )
    notes: list[str] = []
    hierarchy = text[: motion.start() + 1]
    hierarchy = _NUMBERS.sub(lambda line: _mended(line[0], notes), hierarchy)
    joints = _Hierarchy(path, hierarchy).parse()
    timing = _TIMING.match(text, motion.end())
    line = 1 + text.count("\n", 0, motion.end())
    if timing is None:
        raise InputError(f"{path}, line {line}: expected 'Frames:' and 'Frame Time:' after MOTION")
    columns = sum(len(joint.channels) for joint in joints)
    block = _mended(text[timing.end() :], notes)
    first_line = 1 + text.count("\n", 0, timing.end())
    values = _table(path, block, columns, first_line, notes)
    if len(values) * len(joints) > MOST_POSES:
        raise InputError(
            f"{path}: {len(values)} frames of {len(joints)} joints are too many; split the file"
        )
    if timing[1] != str(len(values)):
        notes.append(f"declares {timing[1] or 'no number of'} frames, holds {len(values)}")
    seconds = _frame_time(timing[2], notes)
    return BvhText(joints, values, seconds, list(dict.fromkeys(notes)))


def _mended(numbers: str, notes: list[str]) -> str:
    """The numbers with plain minus signs, each of which begins a number of its own."""
    if not numbers.isascii():
        numbers = numbers.translate(_MINUS)
    parted = _GLUED.sub(" -", numbers) if "-" in numbers else numbers
    if len(parted) != len(numbers):
        notes.append("minus signs inside numbers were taken to begin the next number")
    return parted


class _Hierarchy:
    """Parses the text before MOTION word by word; error messages give the line."""

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._text = text
        self._at = 0
        self._joints: list[BvhJoint] = []
        self._open: list[int] = []  # joints whose braces are open

    def parse(self) -> list[BvhJoint]:
        self._word()  # HIERARCHY, as was checked
        while word := self._word():
            match word.upper():
                case "ROOT" | "JOINT":
                    self._declare(self._name() or word.lower())
                case "END":
                    self._name()
                    self._declare("")
                case "OFFSET":
                    x, y, z = self._number(), self._number(), self._number()
                    self._current().offset = (x, y, z)
                case "CHANNELS":
                    self._channels(self._current())
                case "}":
                    self._current()
                    self._open.pop()
                case _:
                    self._fail(
                        f"expected JOINT, OFFSET, CHANNELS, End Site or a brace, got {word!r}"
                    )
        if self._open:
            self._fail(f"{len(self._open)} braces of the hierarchy are not closed")
        if not self._joints:
            self._fail("the hierarchy has no ROOT")
        return self._joints

    def _declare(self, name: str) -> None:
        if self._word() != "{":
            self._fail(f"expected an opening brace after {name or 'End Site'!r}")
        if len(self._joints) >= MOST_JOINTS:
            self._fail(f"more than {MOST_JOINTS} joints")
        self._joints.append(BvhJoint(name, self._open[-1] if self._open else -1))
        self._open.append(len(self._joints) - 1)

    def _current(self) -> BvhJoint:
        if not self._open:
            self._fail("outside of any joint's braces")
        return self._joints[self._open[-1]]

    def _channels(self, joint: BvhJoint) -> None:
        count = self._word()
        if not count.isdecimal() or len(count) > 2:
            self._fail(f"expected the number of channels, got {count!r}")
        for _ in range(int(count)):
            word = self._word()
            channel = _CHANNEL.match(word)
            if channel is None:
                self._fail(f"expected one of {count} channels such as Xrotation, got {word!r}")
            joint.channels.append(("xyz".index(channel[1].lower()), channel[2].lower()))

    def _word(self) -> str:
        word = re.compile(r"\s*([{}]|[^\s{}]+)").match(self._text, self._at)
        if word is None:
            return ""
        self._at = word.end()
        return word[1]

    def _name(self) -> str:
        """The rest of the line, or the text up to a brace: names may contain blanks."""
        name = re.compile(r"[^\n{}]*").match(self._text, self._at)
        assert name is not None
        self._at = name.end()
        return " ".join(name[0].split())

    def _number(self) -> float:
        word = self._word()
        try:
            number = float(word.replace(",", "."))
        except ValueError:
            self._fail(f"expected a number, got {word!r}")
        if not abs(number) < _LARGEST:
            self._fail(f"{word} is not a plausible length")
        return number

    def _fail(self, what: str) -> NoReturn:
        line = 1 + self._text.count("\n", 0, self._at)
        raise InputError(f"{self._path}, line {line}: {what}")


def _table(
    path: Path, block: str, columns: int, first_line: int, notes: list[str]
) -> NDArray[np.float64]:
    """The channel values (T, columns) of `block`, which starts in line `first_line` of the file."""
    if columns == 0:
        notes.append("no joint has a channel: one frame of the rest pose")
        return np.zeros((1, 0))
    if "," in block:
        block = block.replace(",", " " if "." in block else ".")
        notes.append("commas among the numbers")
    lines = block.split("\n")
    counts = [len(line.split()) for line in lines]
    if _NOT_A_NUMBER.search(block):
        lines = [_NOT_A_NUMBER.sub("nan", line) for line in lines]
    end, frames = _whole_frames(path, counts, columns, first_line)
    if sum(counts[end:]):
        notes.append("the last frame is truncated and was omitted")
    if _numbers(lines[end - 1]) is None and frames:
        end, frames = end - 1, frames - 1
        end -= next((n for n in range(end) if sum(counts[end - n : end]) % columns == 0), 0)
        notes.append("the last frame is truncated and was omitted")
    values = _numbers("\n".join(lines[:end]))
    if values is None or values.size != sum(counts[:end]):
        bad = next(
            n for n in range(end) if (v := _numbers(lines[n])) is None or v.size != counts[n]
        )
        raise InputError(f"{path}, line {first_line + bad}: expected numbers only")
    if frames == 0:
        raise InputError(f"{path}: no whole frame after 'Frame Time:'")
    unusable = ~(np.abs(values) < _LARGEST)
    if unusable.any():
        notes.append(f"{np.count_nonzero(unusable)} values are not finite, plausible numbers")
        values[unusable] = np.nan
    return values.reshape(frames, columns)


def _whole_frames(path: Path, counts: list[int], columns: int, first_line: int) -> tuple[int, int]:
    """How many lines hold how many whole frames; a frame may span lines but ends with a line."""
    count_so_far, end, frames = 0, 0, 0
    for line, count in enumerate(counts):
        count_so_far += count
        if count_so_far > columns:
            begins = next(n for n in range(end, line + 1) if counts[n])
            raise InputError(
                f"{path}, line {first_line + begins}: expected {columns} values for this frame, "
                f"as the hierarchy declares, but line {first_line + line} makes it {count_so_far}"
            )
        if count_so_far == columns:
            count_so_far, end, frames = 0, line + 1, frames + 1
    return end, frames


def _numbers(text: str) -> NDArray[np.float64] | None:
    """All numbers of `text`, or None if it contains anything else."""
    if "_" in text:  # float() reads 1_000
        return None
    numbers = array("d")
    lines = text.split("\n")
    try:
        for first in range(0, len(lines), _LINES_AT_ONCE):
            numbers.extend(map(float, " ".join(lines[first : first + _LINES_AT_ONCE]).split()))
    except ValueError:
        return None
    return np.frombuffer(numbers).copy() if numbers else np.zeros(0)


def _frame_time(word: str, notes: list[str]) -> float:
    """The frame time [s]; one that no sensor has in seconds is a rate, or has a smaller unit."""
    try:
        given = float(word.replace(",", "."))
    except ValueError:
        given = float("nan")
    if 1e-5 <= given < _SLOWEST:
        return given
    if given in _USUAL_RATES:
        seconds, meaning = 1 / given, "frames per second"
    elif _SLOWEST <= given < 1000.0:
        seconds, meaning = 1e-3 * given, "milliseconds"
    elif 1000.0 <= given < 1e6:
        seconds, meaning = 1e-6 * given, "microseconds"
    else:
        notes.append(f"frame time {word!r} is unusable; 1/30 s is assumed (--fps-input N)")
        return _USUAL_FRAME_TIME
    notes.append(
        f"frame time {word} was taken as {meaning}: {1 / seconds:.4g} frames a second "
        "(--fps-input N says otherwise)"
    )
    return seconds
