"""Real recordings of Leap messages, as leapjs plays them back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from replay.leap.lz_string import lz_pieces


def unpacked(scheme: list[Any], values: list[Any]) -> dict[str, Any]:
    """An object of LeapJS Playback's packed form."""
    found: dict[str, Any] = {}
    for key, value in zip(scheme, values, strict=False):
        if isinstance(key, str):
            found[key] = value
        else:
            ((name, inner),) = key.items()
            rows = (
                [unpacked(inner[0], row) for row in value] if isinstance(inner[0], list) else None
            )
            found[name] = unpacked(inner, value) if rows is None else rows
    return found


def recorded(path: Path) -> list[dict[str, Any]]:
    """The messages of a LeapJS Playback recording."""
    frames = json.loads("".join(lz_pieces(path.read_bytes().strip())))["frames"]
    if isinstance(frames[0], list):
        frames = [unpacked(frames[0], frame) for frame in frames[1:]]
        for frame in frames:
            for pointable in frame["pointables"]:
                pointable["type"] = pointable["id"] % 10
    return [frame | {"currentFrameRate": 100.0} for frame in frames]


def playbacks(shared: Path) -> list[Path]:
    return sorted((shared / "leap").rglob("*.lz"))
