"""A session as JSON with a version, and back with every field checked.

The arrays of the takes are files of their own (`runtime.session.files.performance_file`); the JSON
names them by their content.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from devices.errors import InputError
from runtime.session.document import MOST_NAME, Actor, Clip, Mark, Session, Take
from runtime.session.performance import Performance

FORMAT = "bunraku session"
VERSION = 1
MOST_PARTS = 100_000  # of each kind

Json = dict[str, Any]
Upgrade = Callable[[Json], Json]

UPGRADES: Mapping[int, Upgrade] = {}
"""For each older version what makes the next one of it."""

_CHARACTER = re.compile(r"[a-z0-9-]{1,40}|characters/[0-9]{1,6}/[^/\\:\0]{1,200}")
_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_. -]{0,119}")


def as_json(session: Session) -> Json:
    """Return a session as JSON."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "actors": [
            {
                "id": actor.id,
                "name": actor.name,
                "character": actor.character,
                "drive": actor.drive,
                "nodes": actor.nodes,
            }
            for actor in session.actors
        ],
        "takes": [
            {
                "id": take.id,
                "name": take.name,
                "actor": take.actor,
                "performance": take.performance.key,
                "recording": take.recording,
                "parts": list(take.parts),
            }
            for take in session.takes
        ],
        "clips": [_clip_as_json(clip) for clip in session.clips],
        "marks": [{"time": mark.time, "name": mark.name} for mark in session.marks],
        "punch": None if session.punch is None else list(session.punch),
    }


def from_json(document: object, performance: Callable[[str], Performance]) -> Session:
    """Return the session that JSON describes.

    Args:
        document: the parsed JSON.
        performance: gives the performance of a name.

    Raises:
        InputError: it is no session, is of a newer version, or is damaged.
    """
    fields = _upgraded(document)
    session = Session(
        actors=tuple(map(_actor, _listed(fields, "actors"))),
        takes=tuple(_take(each, performance) for each in _listed(fields, "takes")),
        clips=tuple(map(_clip, _listed(fields, "clips"))),
        marks=tuple(
            Mark(_number(each, "time"), _text(each, "name")) for each in _listed(fields, "marks")
        ),
        punch=_punch(fields),
    )
    for parts in (session.actors, session.takes, session.clips):
        if len({part.id for part in parts}) != len(parts):
            raise InputError("two parts of the session have one number")
    for take in session.takes:
        session.actor(take.actor)
    for clip in session.clips:
        session.take(clip.take)
    return session


def without_takes(document: object, names: set[str]) -> Json:
    """Return the JSON of a session without the takes of these performances, and their clips.

    Raises:
        InputError: it is no session, or of a newer version.
    """
    fields = _upgraded(document)
    takes = [each for each in _listed(fields, "takes") if each.get("performance") not in names]
    left = {_whole(each, "id") for each in takes}
    clips = [each for each in _listed(fields, "clips") if each.get("take") in left]
    return fields | {"takes": takes, "clips": clips}


def takes_in(document: object) -> list[Json]:
    """Return what the JSON of a session says of its takes.

    Raises:
        InputError: it is no session, or of a newer version.
    """
    return _listed(_upgraded(document), "takes")


def performances_in(document: object) -> list[str]:
    """Return the names of the performances that the JSON of a session mentions.

    Raises:
        InputError: it is no session, or of a newer version.
    """
    names = [_file(each, "performance") for each in takes_in(document)]
    return list(dict.fromkeys(names))


def _upgraded(document: object) -> Json:
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError("it is not a session of Bunraku")
    version = document.get("version")
    if type(version) is not int or version < 1:
        raise InputError(f"it states no version of its format, but {version!r:.40}")
    if version > VERSION:
        raise InputError(
            f"it has version {version} of the format, and this program reads versions up to "
            f"{VERSION}: install a newer Bunraku"
        )
    fields: Json = document
    for older in range(version, VERSION):
        fields = UPGRADES[older](fields)
    return fields


def _clip_as_json(clip: Clip) -> Json:
    return {
        "id": clip.id,
        "take": clip.take,
        "start": clip.start,
        "first": clip.first,
        "last": clip.last,
        "speed": clip.speed,
        "passes": clip.passes,
        "muted": clip.muted,
        "solo": clip.solo,
        "additive": clip.additive,
        "weight": clip.weight,
        "ease_in": clip.ease_in,
        "ease_out": clip.ease_out,
        "nodes": None if clip.nodes is None else list(clip.nodes),
        "placed": clip.placed,
    }


def _actor(fields: Json) -> Actor:
    return Actor(
        _whole(fields, "id"),
        _text(fields, "name"),
        _character(fields),
        _text(fields, "drive"),
        _whole(fields, "nodes"),
    )


def _character(fields: Json) -> str:
    """A built-in character, or a file in the session."""
    value = _text(fields, "character")
    if not _CHARACTER.fullmatch(value) or value.endswith(("/.", "/..")):
        raise InputError(f"the session names no character: {value[:60]!r}")
    return value


def _take(fields: Json, performance: Callable[[str], Performance]) -> Take:
    recording = _text(fields, "recording")
    return Take(
        _whole(fields, "id"),
        _text(fields, "name"),
        _whole(fields, "actor"),
        performance(_file(fields, "performance")),
        _file(fields, "recording") if recording else "",
        tuple(str(line)[: 2 * MOST_NAME] for line in _list(fields, "parts")),
    )


def _clip(fields: Json) -> Clip:
    nodes = fields.get("nodes")
    return Clip(
        id=_whole(fields, "id"),
        take=_whole(fields, "take"),
        start=_number(fields, "start"),
        first=_number(fields, "first"),
        last=_number(fields, "last"),
        speed=_number(fields, "speed"),
        passes=_number(fields, "passes"),
        muted=_flag(fields, "muted"),
        solo=_flag(fields, "solo"),
        additive=_flag(fields, "additive"),
        weight=_number(fields, "weight"),
        ease_in=_number(fields, "ease_in"),
        ease_out=_number(fields, "ease_out"),
        nodes=None if nodes is None else tuple(map(_checked_whole, _list(fields, "nodes"))),
        placed=_flag(fields, "placed"),
    )


def _punch(fields: Json) -> tuple[float, float] | None:
    if fields.get("punch") is None:
        return None
    start, end = _list(fields, "punch", 2)
    return _checked_number(start), _checked_number(end)


def _listed(fields: Json, name: str) -> list[Json]:
    """A list of objects."""
    values = _list(fields, name)
    if not all(isinstance(value, dict) for value in values):
        raise InputError(f"`{name}` of the session holds what is no object")
    return values


def _list(fields: Json, name: str, length: int | None = None) -> list[Any]:
    values = fields.get(name)
    if (
        not isinstance(values, list)
        or len(values) > MOST_PARTS
        or length not in (None, len(values))
    ):
        raise InputError(f"`{name}` of the session is no list of the right length")
    return values


def _text(fields: Json, name: str) -> str:
    value = fields.get(name)
    if not isinstance(value, str) or len(value) > 1000:
        raise InputError(f"`{name}` of the session is no text")
    return value


def _file(fields: Json, name: str) -> str:
    """The name of a file inside the session: no path leads out of it."""
    value = _text(fields, name)
    if not _FILE.fullmatch(value) or ".." in value:
        raise InputError(f"`{name}` of the session is no name of a file: {value[:60]!r}")
    return value


def _whole(fields: Json, name: str) -> int:
    return _checked_whole(fields.get(name))


def _checked_whole(value: object) -> int:
    if type(value) is not int or not 0 <= value < 1 << 31:
        raise InputError(f"expected a whole number in the session, got {value!r:.40}")
    return value


def _number(fields: Json, name: str) -> float:
    return _checked_number(fields.get(name))


def _checked_number(value: object) -> float:
    if type(value) not in (int, float) or not abs(value) < 1e12:  # type: ignore[arg-type]  # type() does not narrow, and bool must not pass
        raise InputError(f"expected a number in the session, got {value!r:.40}")
    number = float(value)  # type: ignore[arg-type]  # as above
    if not math.isfinite(number):
        raise InputError("expected a finite number in the session")
    return number


def _flag(fields: Json, name: str) -> bool:
    value = fields.get(name)
    if not isinstance(value, bool):
        raise InputError(f"`{name}` of the session is neither true nor false")
    return value
