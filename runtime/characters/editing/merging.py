"""One character is merged onto a node of another: both surfaces become one."""

from __future__ import annotations

from dataclasses import replace
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.character import Character, Surface
from runtime.characters.editing.carried import sheet_of, with_surface
from runtime.characters.morphs import Morphs
from solvers.deform.morph_targets import MorphTargets
from solvers.editing.surface.surface_union import united


def merge(base: Character, graft: Character, node: int) -> Character:
    """Merge a character onto a node of another, whose root stays the root.

        o---o   +   o---o        o---o---o---o
           node     r                node r

    Both stay where they are. The graft's root hangs on the node; where they are in one place, they
    are one.

    Args:
        base: what is grafted onto, closed.
        graft: what is grafted, closed, so placed that both overlap.
        node: of the base.

    Raises:
        InputError: there is no such node, only one of the two has skin weights, the surfaces cannot
            be united, or the extra "characters" is missing; nothing is changed.
    """
    if not 0 <= node < len(base.skeleton.names):
        raise InputError(f"{base.name} has no node {node}")
    if (base.weights is None) != (graft.weights is None):
        raise InputError(
            f"{base.name} and {graft.name} cannot be merged: only one of them has skin weights"
        )
    try:
        derived = united(sheet_of(base), sheet_of(graft))
    except ValueError as error:
        raise InputError(f"cannot merge {graft.name} onto {base.name}: {error}") from error
    except ImportError as error:
        raise InputError(
            f"a merge needs the extra ({error.name}): pip install 'bunraku[characters]'"
        ) from None
    return with_surface(_together(base, graft, node), derived)


def _together(base: Character, graft: Character, node: int) -> Character:
    """Both as one character, whose surfaces go through each other."""
    skeleton, stands_for = _skeleton(base.skeleton, graft.skeleton, node)
    shift = len(base.vertices)
    weights = None
    if base.weights is not None and graft.weights is not None:
        weights = _weights(base.weights, graft.weights, stands_for, len(skeleton.names))
    return replace(
        base,
        vertices=np.concatenate([base.vertices, graft.vertices]),
        faces=np.concatenate([base.faces, graft.faces + shift]),
        skeleton=skeleton,
        weights=weights,
        surface=_surface(base.surface, graft.surface, shift),
        plan=None,
        body=None,
        notes=(*base.notes, *(each for each in graft.notes if each not in base.notes)),
        morphs=_morphs(base.morphs, graft.morphs, shift),
    )


def _skeleton(base: Skeleton, graft: Skeleton, node: int) -> tuple[Skeleton, NDArray[np.int64]]:
    """Both as one, and the node (K of the graft,) that stands for each of the graft."""
    size = float(np.linalg.norm(np.ptp(base.rest_positions, axis=0)))
    apart = graft.rest_positions[graft.root] - base.rest_positions[node]
    is_one = float(np.linalg.norm(apart)) <= 1e-9 * size
    moved = np.array([k for k in range(len(graft.names)) if not (is_one and k == graft.root)])
    stands_for = np.full(len(graft.names), node)
    stands_for[moved] = len(base.names) + np.arange(len(moved))
    taken = set(base.names)
    names = list(base.names)
    for each in moved.tolist():
        name = graft.names[each]
        tried = (name if number == 1 else f"{name} {number}" for number in count(1))
        names.append(next(one for one in tried if one not in taken))
        taken.add(names[-1])
    parents = [
        node if graft.parents[each] < 0 else int(stands_for[graft.parents[each]])
        for each in moved.tolist()
    ]
    rest = np.concatenate([base.rest_positions, graft.rest_positions[moved]])
    return Skeleton(tuple(names), np.append(base.parents, parents), rest), stands_for


def _weights(
    base: csr_array, graft: csr_array, stands_for: NDArray[np.int64], nodes: int
) -> csr_array:
    one, other = base.tocoo(), graft.tocoo()
    rows = np.concatenate([one.row, other.row + base.shape[0]])
    columns = np.concatenate([one.col, stands_for[other.col]])
    shape = (base.shape[0] + graft.shape[0], nodes)
    return csr_array((np.concatenate([one.data, other.data]), (rows, columns)), shape=shape)


def _surface(base: Surface, graft: Surface, shift: int) -> Surface:
    uvs = None
    if base.uvs is not None or graft.uvs is not None:
        none = [np.zeros((len(each.vertex), 2), np.float32) for each in (base, graft)]
        uvs = np.concatenate(
            [none[k] if each.uvs is None else each.uvs for k, each in enumerate((base, graft))]
        )
    return Surface(
        vertex=np.concatenate([base.vertex, graft.vertex + shift]),
        faces=np.concatenate([base.faces, graft.faces + np.int32(len(base.vertex))]),
        colors=np.concatenate([base.colors, graft.colors]),
        uvs=uvs,
        materials=(*base.materials, *graft.materials),
        face_material=np.concatenate(
            [base.face_material, graft.face_material + len(base.materials)]
        ),
    )


def _morphs(base: Morphs | None, graft: Morphs | None, shift: int) -> Morphs | None:
    if graft is None:
        return base
    moved = MorphTargets(graft.targets.starts, graft.targets.vertices + shift, graft.targets.deltas)
    if base is None:
        return replace(graft, targets=moved)
    first = base.targets
    targets = MorphTargets(
        np.concatenate([first.starts, first.starts[-1] + moved.starts[1:]]),
        np.concatenate([first.vertices, moved.vertices]),
        np.concatenate([first.deltas, moved.deltas]),
    )
    known = len(first)
    taken = {each.name for each in base.expressions}
    more = tuple(
        replace(each, binds=tuple((target + known, weight) for target, weight in each.binds))
        for each in graft.expressions
        if each.name not in taken
    )
    return Morphs(targets, (*base.names, *graft.names), (*base.expressions, *more))
