"""Keeps the recording of a take that was running when its program was killed."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.printable import printable
from replay.text_file import file_bytes
from runtime.output.files.whole_file import whole_file, writing

RUNNING = "running.json"
MOST_BYTES, MOST_NAMES = 1 << 16, 9999


def begin(recordings: Path, file: str, start: float) -> None:
    """Note in the folder of the recordings that a take is running.

    Args:
        recordings: the folder.
        file: that the performers' frames go to.
        start: [s] of the session's time at which the take began.

    Raises:
        InputError: the disk fails.
    """
    with whole_file(recordings / RUNNING) as partial:
        partial.write_text(json.dumps({"recording": file, "start": start}), encoding="utf-8")


def end(recordings: Path) -> None:
    """Remove the note: the take is in the session now, or was given up."""
    with writing(recordings / RUNNING):
        (recordings / RUNNING).unlink(missing_ok=True)


def rescue(recordings: Path, finished: set[str], session: Path) -> list[str]:
    """Put the recording of a take that never ended beside the session's file.

    Args:
        recordings: the folder of an open session.
        finished: the recordings that the session has takes of.
        session: its file.

    Returns:
        A line that says where it is and how it becomes a take; none where no take was running.
    """
    try:
        noted = parse_json(file_bytes(recordings / RUNNING, MOST_BYTES))
    except (InputError, ValueError):
        return []
    if not isinstance(noted, dict):
        return []
    file, start = noted.get("recording"), noted.get("start")
    if not isinstance(file, str) or file in finished or Path(file).name != file:
        return []
    if not (recordings / file).is_file():
        return []
    kept = _free(session)
    with writing(kept):
        shutil.move(recordings / file, kept)
    end(recordings)
    at = start if isinstance(start, float) and math.isfinite(start) and start >= 0.0 else 0.0
    return [
        f"a take was running then, from {at:.2f} s on: the performer's frames are kept as {kept}. "
        f"To make it a take: bunraku session {printable(str(session))} --recording {kept} --take "
        f"--at {at:.2f} --headless --fast"
    ]


def _free(session: Path) -> Path:
    """A free name beside a session's file."""
    names = (f"{session.stem}-unfinished{f'-{n}' if n > 1 else ''}" for n in range(1, MOST_NAMES))
    paths = (session.with_name(f"{name}.mcap") for name in names)
    return next(path for path in paths if not path.exists())
