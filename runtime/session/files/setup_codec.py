"""The setups of a session as JSON, and back with every field checked."""

from __future__ import annotations

from devices.errors import InputError
from runtime.puppet.deformable_surface import Elasticity
from runtime.session.files.fields import (
    Json,
    checked_number,
    checked_whole,
    flag,
    item,
    items,
    number,
    objects,
)
from runtime.session.setup import Pair, Point, Setup, StruckMatch


def setup_as_json(setup: Setup) -> Json:
    """Return a setup as JSON."""
    surface = setup.elasticity
    return {
        "match": None if setup.match is None else _match_as_json(setup.match),
        "cartoon": surface.cartoon,
        "volume_gain": surface.volume_gain,
        "stiffness": surface.stiffness,
        "in_place": setup.in_place,
    }


def setup_from_json(fields: Json) -> Setup:
    """Return the setup that JSON describes.

    Raises:
        InputError: a field is missing, is of another kind, or out of range.
    """
    surface = Elasticity(
        number(fields, "cartoon"), number(fields, "volume_gain"), number(fields, "stiffness")
    )
    most = {"cartoon": 1.0, "volume_gain": 10.0, "stiffness": 0.99}
    for name, limit in most.items():
        value = number(fields, name)
        if not 0.0 <= value <= limit:
            raise InputError(f"`{name}` of the session is {value:g}: expected 0 to {limit:g}")
    match = None if fields.get("match") is None else _match(item(fields, "match"))
    return Setup(match, surface, flag(fields, "in_place"))


def _match_as_json(match: StruckMatch) -> Json:
    return {
        "joints": list(match.joints),
        "rest": [list(point) for point in match.rest],
        "heading": match.heading,
        "height": match.height,
        "mirrored": match.mirrored,
        "view": [list(row) for row in match.view],
        "pairs": [
            {
                "source": list(pair.source),
                "target": list(pair.target),
                "flip": pair.flip,
                "gain": pair.gain,
                "delay": pair.delay,
            }
            for pair in match.pairs
        ],
        "matched": match.matched,
        "by_hand": match.by_hand,
    }


def _match(fields: Json) -> StruckMatch:
    first, second, third = (_point(row) for row in items(fields, "view", 3))
    return StruckMatch(
        joints=_names(fields, "joints"),
        rest=tuple(map(_point, items(fields, "rest"))),
        heading=number(fields, "heading"),
        height=number(fields, "height"),
        mirrored=flag(fields, "mirrored"),
        view=(first, second, third),
        pairs=tuple(map(_pair, objects(fields, "pairs"))),
        matched=flag(fields, "matched"),
        by_hand="by_hand" in fields and flag(fields, "by_hand"),
    )


def _pair(fields: Json) -> Pair:
    target = tuple(map(checked_whole, items(fields, "target")))
    delay = number(fields, "delay") if "delay" in fields else 0.0
    source, gain = _names(fields, "source"), number(fields, "gain")
    return Pair(source, target, flag(fields, "flip"), gain, delay)


def _names(fields: Json, name: str) -> tuple[str, ...]:
    values = items(fields, name)
    if not all(isinstance(value, str) and len(value) <= 1000 for value in values):
        raise InputError(f"`{name}` of the session holds what is no name of a joint")
    return tuple(values)


def _point(value: object) -> Point:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"expected three numbers in the session, got {value!r:.40}")
    x, y, z = map(checked_number, value)
    return x, y, z
