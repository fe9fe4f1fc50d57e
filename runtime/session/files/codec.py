"""A session as JSON with a version, and back with every field checked.

The arrays of the takes are files of their own (`runtime.session.files.performance_file`); the JSON
names them by their content.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from devices.errors import InputError
from runtime.session.document import MOST_NAME, Actor, Clip, Mark, Session, Take
from runtime.session.files.fields import (
    Json,
    checked_number,
    checked_whole,
    file_name,
    flag,
    item,
    items,
    number,
    objects,
    text,
    whole,
)
from runtime.session.files.setup_codec import setup_as_json, setup_from_json
from runtime.session.performance import Performance

FORMAT = "bunraku session"
VERSION = 3

Upgrade = Callable[[Json], Json]


def _with_setups(fields: Json) -> Json:
    """Version 2 knows how each actor was driven last."""
    return fields | {"actors": [{"setup": None} | each for each in objects(fields, "actors")]}


def _with_sounds(fields: Json) -> Json:
    """Version 3 has takes with sound."""
    return fields | {"takes": [{"sound": ""} | each for each in objects(fields, "takes")]}


UPGRADES: Mapping[int, Upgrade] = {1: _with_setups, 2: _with_sounds}
"""For each older version what makes the next one of it."""

_CHARACTER = re.compile(r"[a-z0-9-]{1,40}|characters/[0-9]{1,6}/[^/\\:\0]{1,200}")


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
                "setup": None if actor.setup is None else setup_as_json(actor.setup),
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
                "sound": take.sound,
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
        actors=tuple(map(_actor, objects(fields, "actors"))),
        takes=tuple(_take(each, performance) for each in objects(fields, "takes")),
        clips=tuple(map(_clip, objects(fields, "clips"))),
        marks=tuple(
            Mark(number(each, "time"), text(each, "name")) for each in objects(fields, "marks")
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
    takes = [each for each in objects(fields, "takes") if each.get("performance") not in names]
    left = {whole(each, "id") for each in takes}
    clips = [each for each in objects(fields, "clips") if each.get("take") in left]
    return fields | {"takes": takes, "clips": clips}


def takes_in(document: object) -> list[Json]:
    """Return what the JSON of a session says of its takes.

    Raises:
        InputError: it is no session, or of a newer version.
    """
    return objects(_upgraded(document), "takes")


def performances_in(document: object) -> list[str]:
    """Return the names of the performances that the JSON of a session mentions.

    Raises:
        InputError: it is no session, or of a newer version.
    """
    names = [file_name(each, "performance") for each in takes_in(document)]
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
        whole(fields, "id"),
        text(fields, "name"),
        _character(fields),
        text(fields, "drive"),
        whole(fields, "nodes"),
        None if fields.get("setup") is None else setup_from_json(item(fields, "setup")),
    )


def _character(fields: Json) -> str:
    """A built-in character, or a file in the session."""
    value = text(fields, "character")
    if not _CHARACTER.fullmatch(value) or value.endswith(("/.", "/..")):
        raise InputError(f"the session names no character: {value[:60]!r}")
    return value


def _take(fields: Json, performance: Callable[[str], Performance]) -> Take:
    recording, sound = text(fields, "recording"), text(fields, "sound")
    return Take(
        whole(fields, "id"),
        text(fields, "name"),
        whole(fields, "actor"),
        performance(file_name(fields, "performance")),
        file_name(fields, "recording") if recording else "",
        tuple(str(line)[: 2 * MOST_NAME] for line in items(fields, "parts")),
        file_name(fields, "sound") if sound else "",
    )


def _clip(fields: Json) -> Clip:
    nodes = fields.get("nodes")
    return Clip(
        id=whole(fields, "id"),
        take=whole(fields, "take"),
        start=number(fields, "start"),
        first=number(fields, "first"),
        last=number(fields, "last"),
        speed=number(fields, "speed"),
        passes=number(fields, "passes"),
        muted=flag(fields, "muted"),
        solo=flag(fields, "solo"),
        additive=flag(fields, "additive"),
        weight=number(fields, "weight"),
        ease_in=number(fields, "ease_in"),
        ease_out=number(fields, "ease_out"),
        nodes=None if nodes is None else tuple(map(checked_whole, items(fields, "nodes"))),
        placed=flag(fields, "placed"),
    )


def _punch(fields: Json) -> tuple[float, float] | None:
    if fields.get("punch") is None:
        return None
    start, end = items(fields, "punch", 2)
    return checked_number(start), checked_number(end)
