"""A character is cut in two where one of its bones is cut, or where a line is drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.characters.editing.carried import sheet_of, with_nodes, with_surface
from solvers.editing.surface.blade import Blade
from solvers.editing.surface.surface_cut import across, cut_surface, share_of

Flags = NDArray[np.bool_]


def cut_across(character: Character, node: int, share: float) -> tuple[Character, Character]:
    """Cut a character across the bone that ends at a node; return what stays, and what comes off.

        o---o---|---o---o        o---o---o   o---o---o
            a      node              a   cut cut node

    Args:
        character: the character at rest.
        node: where the bone ends; not the root.
        share: of the bone's length, between 0 and 1.

    Raises:
        InputError: there is no such bone, or the surface cannot be cut there; nothing is changed.
    """
    start, end = _bone(character, node)
    if not 0.0 < share < 1.0:
        raise InputError(f"a cut is at a share of the bone between 0 and 1, got {share:g}")
    try:
        return _cut(character, node, across(start, end, share), start + share * (end - start))
    except ValueError as error:
        raise _refused(character, node, error) from error


def cut_along(character: Character, node: int, blade: Blade) -> tuple[Character, Character]:
    """Cut a character where a drawn line crosses the bone that ends at a node.

    Args:
        character: the character at rest.
        node: where the bone ends; what hangs on it comes off.
        blade: the line, swept along the view (`solvers.editing.surface.blade.drawn`).

    Raises:
        InputError: there is no such bone, the line does not cross it, or the surface cannot be cut
            there; nothing is changed.
    """
    start, end = _bone(character, node)
    try:
        share = share_of(blade, start, end)
        return _cut(character, node, blade.towards(end), start + share * (end - start))
    except ValueError as error:
        raise _refused(character, node, error) from error


def _refused(character: Character, node: int, error: ValueError) -> InputError:
    name = character.skeleton.names[node]
    return InputError(f"cannot cut {character.name} before {name}: {error}")


def _bone(character: Character, node: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    skeleton = character.skeleton
    if not 0 <= node < len(skeleton.names) or skeleton.parents[node] < 0:
        raise InputError(f"{character.name} has no bone that ends at node {node}")
    rest = skeleton.rest_positions
    return rest[skeleton.parents[node]], rest[node]


def _cut(
    character: Character, node: int, blade: Blade, at: NDArray[np.float64]
) -> tuple[Character, Character]:
    kept, off = cut_surface(sheet_of(character), blade, at)
    skeleton = character.skeleton
    beyond = _branch(skeleton, node)
    name = _new_name(skeleton, skeleton.names[node])
    return (
        _with_part(with_surface(character, kept), ~beyond, skeleton.parents[node], name, at),
        _with_part(with_surface(character, off), beyond, -1, name, at),
    )


def _branch(skeleton: Skeleton, node: int) -> Flags:
    """Which nodes (K,) are a node and all beyond it."""
    found = np.zeros(len(skeleton.names), dtype=np.bool_)
    for each in skeleton.order:
        found[each] = each == node or (
            skeleton.parents[each] >= 0 and found[skeleton.parents[each]]
        )
    return found


def _new_name(skeleton: Skeleton, name: str) -> str:
    taken = set(skeleton.names)
    tried = (f"{name} cut{number if number > 1 else ''}" for number in range(1, len(taken) + 2))
    return next(each for each in tried if each not in taken)


def _with_part(
    character: Character, mine: Flags, parent: int, name: str, at: NDArray[np.float64]
) -> Character:
    """The character with some of its nodes, and one at the cut for all others.

    The new node ends the bone of `parent`, or is the root where that is -1.
    """
    skeleton = character.skeleton
    rows = np.flatnonzero(mine)
    count = len(rows)
    place = np.full(len(mine), count)
    place[rows] = np.arange(count)
    old = skeleton.parents[rows]
    parents = np.where(old < 0, -1, place[old])
    new = Skeleton(
        (*(skeleton.names[row] for row in rows), name),
        np.append(parents, place[parent] if parent >= 0 else -1),
        np.concatenate([skeleton.rest_positions[rows], at[None]]),
    )
    # Skin beyond the cut turned with a node that is gone: now with the bone that is cut.
    stands_for = np.where(mine, place, place[parent] if parent >= 0 else count)
    humanoid = {each: int(place[k]) for each, k in character.humanoid.items() if mine[k]}
    return replace(
        character,
        skeleton=new,
        weights=with_nodes(character.weights, stands_for, count + 1),
        humanoid=humanoid,
        plan=None,
        body=None,
    )
