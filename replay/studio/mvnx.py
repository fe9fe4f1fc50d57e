"""Read MVNX files of Xsens MVN: positions and orientations of the segments of a body.

The parser refuses every document type, and with it all entities: nothing is expanded or fetched.
Source: Xsens, "MVN User Manual", chapter "MVNX file format".
"""

from __future__ import annotations

from array import array
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from devices.suits.xsens_segments import xsens_skeleton
from replay.bounds import check_poses, check_recordable
from replay.recording import Recording
from replay.stage_space import JointMotion, staged
from replay.stated import UNSTATED, Stated
from replay.text_file import file_bytes

Array = NDArray[np.float64]

_MOST_SEGMENTS = 200
_MOST_LETTERS = 1 << 16  # of the numbers of one frame
_USUAL_RATE = 60.0
_Z = np.array([0.0, 0.0, 1.0])
_CHUNK = 1 << 20
_TWICE = 2  # a segment has a place and a turn


def recognises_mvnx(path: Path, head: bytes) -> bool:
    """Whether a file begins with the element mvnx, or is XML with its suffix."""
    return b"<mvnx" in head or (path.suffix.lower() == ".mvnx" and b"<" in head)


def read_mvnx(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the segments of the first subject of an MVNX file.

    A joint is the origin of a segment, as of the live suit; rotations are segment to world.

    Raises:
        InputError: it cannot be read.
        ContentError: it is damaged, or has no positions of segments.
    """
    check_recordable(path)
    read = _Reader()
    data = file_bytes(path)
    try:
        for at in range(0, len(data), _CHUNK):
            read.parser.Parse(data[at : at + _CHUNK], at + _CHUNK >= len(data))
    except ContentError:
        raise
    except (expat.ExpatError, LookupError, ValueError) as error:  # LookupError: of the encoding
        if not read.positions:
            raise ContentError(f"it is no XML, or damaged: {error}") from error
        read.notes.append("the file is cut off; its whole frames were read")
    return staged(read.motion(), stated, read.notes)


class _Reader:
    """Takes the elements of a file as they come, and keeps numbers only."""

    def __init__(self) -> None:
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.notes: list[str] = []
        self.labels: list[str] = []
        self.rate = 0.0
        self.positions, self.turns = array("d"), array("d")
        self._subjects = 0
        self._kind = ""
        self._frame: dict[str, list[float]] = {}
        self._taken: list[str] | None = None
        self._letters = 0

    def _doctype(self, *_: object) -> None:
        raise ContentError("it declares a document type, which MVNX files do not; export it again")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        name = name.rpartition(":")[2].rpartition("}")[2]
        if name == "subject":
            self._subjects += 1
            if self._subjects == 1:
                self.rate = _number(attributes.get("frameRate", ""))
            elif self._subjects == 2:
                self.notes.append("further subjects are left out")
        if self._subjects > 1:
            return
        if name == "segment" and not self.positions and len(self.labels) < _MOST_SEGMENTS:
            self.labels.append(attributes.get("label", "")[:64])
        elif name == "frame":
            self._kind = attributes.get("type", "normal")
            self._frame = {}
        elif name in ("position", "orientation") and self._kind == "normal":
            self._taken, self._letters = [], 0

    def _text(self, text: str) -> None:
        if self._taken is not None:
            self._letters += len(text)
            if self._letters > _MOST_LETTERS:
                raise ContentError("a frame holds more numbers than segments have")
            self._taken.append(text)

    def _end(self, name: str) -> None:
        name = name.rpartition(":")[2].rpartition("}")[2]
        if self._taken is not None and name in ("position", "orientation"):
            self._frame[name] = [_number(word) for word in "".join(self._taken).split()]
            self._taken = None
        elif name == "frame":
            if self._kind == "normal" and self._subjects == 1:
                self._keep()
            self._kind = ""

    def _keep(self) -> None:
        count = len(self.labels)
        places, turns = self._frame.get("position", []), self._frame.get("orientation", [])
        if not count or len(places) != 3 * count:
            places = [np.nan] * (3 * count)
        if len(turns) != 4 * count:
            turns = [np.nan] * (4 * count)
        self.positions.extend(places)
        self.turns.extend(turns)
        if count:
            check_poses(_TWICE * (len(self.positions) // (3 * count)), count)

    def motion(self) -> JointMotion:
        """The segments of the body.

        Raises:
            ContentError: there are none, or they have no positions.
        """
        count = len(self.labels)
        body = xsens_skeleton()
        known = [name for name in body.names if name in self.labels]
        if not count or not self.positions or body.names[body.root] not in known:
            raise ContentError("it holds no frames of a body; export it from MVN as MVNX again")
        positions = np.frombuffer(self.positions).reshape(-1, count, 3)
        if not np.isfinite(positions).any():
            raise ContentError(
                "it has no positions of segments; export it from MVN with position and orientation"
            )
        columns = [self.labels.index(name) for name in known]
        turns = np.frombuffer(self.turns).reshape(-1, count, 4)[:, columns][..., [1, 2, 3, 0]]
        rate = self.rate
        if not 0.1 < rate < 1e5:
            rate = _USUAL_RATE
            self.notes.append(f"no rate in the file: {rate:.0f} frames a second (--fps-input N)")
        return JointMotion(
            names=known,
            parents=[self._above(name, known) for name in known],
            rest=body.rest_positions[[body.index(name) for name in known]],
            times=np.arange(len(positions), dtype=np.float64) / rate,
            positions=positions[:, columns],
            rotations=turns if np.isfinite(turns).any() else None,
            up=_Z,
            metres=1.0,
        )

    @staticmethod
    def _above(name: str, known: list[str]) -> int:
        body = xsens_skeleton()
        parent = int(body.parents[body.index(name)])
        while parent >= 0 and body.names[parent] not in known:
            parent = int(body.parents[parent])
        return -1 if parent < 0 else known.index(body.names[parent])


def _number(word: str) -> float:
    try:
        return float(word) if len(word) <= 40 else float("nan")
    except ValueError:
        return float("nan")
