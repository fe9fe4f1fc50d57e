"""Mappings: which chains of the performer drive which chains of the character; and their files."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.skeleton import Skeleton
from solvers.signal.delay_line import MOST as MOST_DELAY

MAX_FILE = 1 << 20  # bytes; a mapping is a page of names


@dataclass(frozen=True, slots=True)
class Drive:
    """One source polyline that drives one target polyline (AniMesh, section 5.2).

    Attributes:
        source: joint indices from the root side outward, at least two.
        target: node indices from the root side outward, at least two.
        flip: turn the target's y-axis round, which mirrors the turns (end of section 5.2).
        delay: [s] how much later the target follows, so that alike limbs move one after the other.
    """

    source: tuple[int, ...]
    target: tuple[int, ...]
    flip: bool = False
    delay: float = 0.0


@dataclass(frozen=True, slots=True)
class Mapping:
    """The drives of one character.

    Attributes:
        drives: the pairs of polylines; those nearer to the target's root come first.
        score: the match's similarity, the sum of cosines of section 4.2; NaN when made by hand.
    """

    drives: tuple[Drive, ...]
    score: float = float("nan")


def read_mapping(path: Path, source: Skeleton, target: Skeleton) -> Mapping:
    """Read a mapping made by hand.

    The file holds what `mapping_from_json` takes, which is what a report's ``match`` holds: so a
    mapping can be taken from there and edited.

    Raises:
        InputError: the file is not there, is not such JSON, or names what is not there.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MAX_FILE + 1)
        if len(text) > MAX_FILE:
            raise InputError(f"{path} is too large for a mapping (over {MAX_FILE} bytes)")
        mapping = mapping_from_json(parse_json(text), source, target)
    except OSError as error:
        raise InputError(f"cannot read the mapping {path}: {error.strerror or error}") from error
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise InputError(
            f'{path} is not a mapping: expected {{"pairs": [{{"source": [joint names], '
            f'"target": [node ids]}}]}} ({type(error).__name__}: {error})'
        ) from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if not mapping.drives:
        raise InputError(f"{path} maps nothing: its `pairs` is empty")
    return mapping


def mapping_from_json(value: Any, source: Skeleton, target: Skeleton) -> Mapping:
    """Return the mapping that a value out of JSON stands for; `mapping_as_json` makes such values.

    It is ``{"pairs": [{"source": [...], "target": [...], "flip": false, "delay": 0.0}, ...]}``.
    Source joints are names, target nodes are names or numbers, both from the root side outward.

    Raises:
        InputError: it names what is not there.
        ValueError, KeyError, TypeError, AttributeError, OverflowError: it is not such a value.
    """
    return Mapping(tuple(_drive(pair, source, target) for pair in _listed(value, "pairs")))


def _drive(pair: dict[str, Any], source: Skeleton, target: Skeleton) -> Drive:
    flip = pair.get("flip", False)
    if not isinstance(flip, bool):
        raise TypeError(f"`flip` is true or false, got {flip!r}")
    drive = Drive(
        source=tuple(source.index(str(name)) for name in _listed(pair, "source")),
        target=tuple(_node(node, target) for node in _listed(pair, "target")),
        flip=flip,
        delay=_delay(pair.get("delay", 0.0)),
    )
    check_drive(drive, target)
    return drive


def check_drive(drive: Drive, target: Skeleton) -> None:
    """Check that both polylines of a drive are such, and that the character has the target's bones.

    Raises:
        InputError: they are too short or meet a joint twice, or nodes share no bone.
    """
    for end, chain in (("source", drive.source), ("target", drive.target)):
        if len(chain) < 2 or len(set(chain)) != len(chain):
            raise InputError(f"each {end} polyline needs two or more different joints")
    for near, far in itertools.pairwise(drive.target):
        if target.parents[far] != near and target.parents[near] != far:
            raise InputError(
                f"target nodes {target.names[near]} and {target.names[far]} share no bone"
            )


def _delay(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"`delay` is a number of seconds, got {value!r}")
    if not 0.0 <= value <= MOST_DELAY:
        raise InputError(f"`delay` is from 0 to {MOST_DELAY:g} s, got {value:g}")
    return float(value)


def _listed(holder: dict[str, Any], key: str) -> list[Any]:
    found = holder[key]
    if not isinstance(found, list):
        raise TypeError(f"`{key}` is a list, got {type(found).__name__}")
    return found


def _node(node: object, target: Skeleton) -> int:
    if isinstance(node, str):
        return target.index(node)
    if isinstance(node, bool) or not isinstance(node, int):
        raise InputError(f"a target node is a name or a number, got {node!r}")
    if not 0 <= node < len(target.names):
        last = len(target.names) - 1
        raise InputError(f"there is no target node {node}; they go from 0 to {last}")
    return node


def mapping_as_json(mapping: Mapping, source: Skeleton) -> dict[str, Any]:
    """Return a mapping as `read_mapping` reads it, with node numbers for the target."""
    return {
        "score": float(mapping.score) if math.isfinite(mapping.score) else None,
        "pairs": [
            {
                "source": [source.names[joint] for joint in drive.source],
                "target": [int(node) for node in drive.target],
                "flip": drive.flip,
                "delay": drive.delay,
            }
            for drive in mapping.drives
        ],
    }
