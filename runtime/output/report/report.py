"""The report of a show: its figures as one JSON file."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

from devices.skeleton import Skeleton
from replay.recorder import Recorder
from runtime.characters.character import Character
from runtime.driving.driver import DrivenPart
from runtime.output.files.whole_file import check_writable, whole_file
from runtime.output.output import PerformedFrame
from runtime.output.report.stage_times import StageTimes
from runtime.output.report.stretch import StretchStatistic
from runtime.output.report.watchdog import Watchdog
from solvers.surface.edges import Edges


class CharacterReport:
    """Figures of one character in the show: its match, and the stretch of its surface.

    An `Output` that gets the character's frames.

    Attributes:
        frames: number of performed frames so far.
    """

    pictures_a_second = 0.0

    def __init__(self, character: Character) -> None:
        self.frames = 0
        self._character = character
        self._edges = Edges.of(character.vertices, character.faces)
        self._stretch = StretchStatistic()
        self._watchdog = Watchdog(character.vertices, character.faces)
        self._match: dict[str, Any] = {"score": None, "pairs": []}

    def matched(self, score: float, parts: Sequence[DrivenPart], performer: Skeleton) -> None:
        """Set what drives the character; the last call counts."""
        nodes = self._character.skeleton.names
        self._match = {
            "score": float(score),
            "pairs": [
                {
                    "name": str(part),
                    "source": [performer.names[joint] for joint in part.source],
                    "target": [int(node) for node in part.target],
                    "target_names": [nodes[node] for node in part.target],
                    "drive": part.drive,
                    "gain": float(part.gain),
                    "flip": part.flip,
                    "delay": part.delay,
                }
                for part in parts
            ],
        }

    def write(self, frame: PerformedFrame) -> None:
        """Count one performed frame."""
        stretch = self._edges.stretch(frame.vertices)
        self._stretch.add(stretch)
        self._watchdog.add(frame.vertices, stretch)
        self.frames += 1

    def close(self) -> None:
        """Do nothing: `Report` writes the file."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def summary(self) -> dict[str, Any]:
        """Return ``character``, ``match``, ``stretch`` and ``watchdog`` of the report."""
        body = self._character
        return {
            "character": {
                "vertices": len(body.vertices),
                "faces": len(body.faces),
                "nodes": len(body.skeleton.names),
            },
            "match": self._match,
            "stretch": {"mean": self._stretch.mean, "p99": self._stretch.p99},
            "watchdog": self._watchdog.summary(),
        }


class Report:
    """Collects the figures of a show and writes them as JSON at the end.

    The keys are ``frames``, ``dropped``, ``recording`` {frames, joints, seconds}, ``record``
    {frames, lost, fault} of the recording that the show made, or null, ``character`` {vertices,
    faces, nodes}, ``match`` {score, pairs: [{name, source: [joint names], target: [node ids],
    target_names, drive, gain, flip, delay}]},
    ``stages_ms`` {poll, match, retarget, deform, render, publish, frame, settle, latency: {p50,
    p99, max}}, ``stretch`` {mean, p99}, ``watchdog`` {energy {p50, max}, stretch {p99, max},
    inverted {max, last, longest, frames}}. With several characters ``character``, ``match``,
    ``stretch`` and ``watchdog`` are those of the first, and ``characters`` lists them for each,
    with its ``name``. A number that is not finite is written as null, because RFC 8259 requires it.

    Attributes:
        times: durations of the loop's stages.
        dropped: frames that arrived but were not performed.

    Args:
        path: the file to write, or None to write none.

    Raises:
        InputError: the file cannot be written.
    """

    def __init__(self, path: Path | None) -> None:
        if path is not None:
            check_writable(path)
        self._path = path
        self._recording: dict[str, float] = {"frames": 0, "joints": 0, "seconds": 0.0}
        self._record: dict[str, Any] | None = None
        self._parts: list[tuple[str, CharacterReport]] = []
        self.times = StageTimes()
        self.dropped = 0

    def recorded(self, *, frames: int, joints: int, seconds: float) -> None:
        """Set the size of the replayed recording, or of a live stream so far."""
        self._recording = {
            "frames": int(frames),
            "joints": int(joints),
            "seconds": float(seconds),
        }

    def kept(self, recorder: Recorder) -> None:
        """Set the result of the recording that the show made."""
        self._record = {
            "frames": recorder.frames,
            "lost": recorder.lost,
            "fault": recorder.fault or None,
        }

    def add_character(self, character: Character) -> CharacterReport:
        """Add a character to the show."""
        part = CharacterReport(character)
        self._parts.append((character.name, part))
        return part

    def summary(self) -> dict[str, Any]:
        """Return everything that `close` writes."""
        parts = [{"name": name, **part.summary()} for name, part in self._parts]
        first = {key: value for key, value in parts[0].items() if key != "name"} if parts else {}
        summary = {
            "frames": max((part.frames for _, part in self._parts), default=0),
            "dropped": int(self.dropped),
            "recording": self._recording,
            "record": self._record,
            **first,
            "stages_ms": self.times.summary(),
        }
        if len(parts) > 1:
            summary["characters"] = parts
        finite: dict[str, Any] = _finite(summary)
        return finite

    def close(self) -> None:
        """Write the whole file; another call writes it again with the newest figures.

        Raises:
            InputError: the disk fails.
        """
        if self._path is None:
            return
        text = json.dumps(self.summary(), indent=2, allow_nan=False)
        with whole_file(self._path) as path:
            path.write_text(text + "\n", encoding="utf-8")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _finite(value: Any) -> Any:
    """Return the same value with None for every number that JSON cannot hold."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
