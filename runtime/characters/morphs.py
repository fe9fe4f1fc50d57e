"""The morphs of a character: its morph targets, and the expressions that move them by name.

Names of blend shapes mean the same in every case, with and without underscores: "Blink_L",
"blinkLeft". VRM 0's names of expressions mean VRM 1's ("Joy", "happy").
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solvers.deform.morph_targets import MorphTargets

NONE, BLEND, BLOCK = "none", "blend", "block"
BLINKS = frozenset({"blink", "blinkleft", "blinkright"})
LOOKS = frozenset({"lookup", "lookdown", "lookleft", "lookright"})
MOUTHS = frozenset({"aa", "ih", "ou", "ee", "oh"})

_OLD_NAMES = {
    "joy": "happy",
    "angry": "angry",
    "sorrow": "sad",
    "fun": "relaxed",
    "a": "aa",
    "i": "ih",
    "u": "ou",
    "e": "ee",
    "o": "oh",
}


def canonical_name(name: str) -> str:
    """Return the one spelling of all names that mean the same blend shape."""
    key = name.casefold().strip()
    for ending, side in (("_l", "left"), ("_r", "right"), (".l", "left"), (".r", "right")):
        if key.endswith(ending):
            key = key[:-2] + side
    key = "".join(letter for letter in key if letter not in "_- .")
    return _OLD_NAMES.get(key, key)


@dataclass(frozen=True, slots=True)
class Expression:
    """A named expression, as VRM 1 has them.

    Attributes:
        name: as the file writes it.
        binds: the morph targets that it moves, each with its weight in [0, 1].
        is_binary: whether weights above 0.5 count as 1 and others as 0.
        blink, look, mouth: what it does to the expressions of eyelids, gaze and mouth while it
            shows: `NONE`, `BLEND` (they fade as it appears) or `BLOCK` (they vanish).
    """

    name: str
    binds: tuple[tuple[int, float], ...]
    is_binary: bool = False
    blink: str = NONE
    look: str = NONE
    mouth: str = NONE


@dataclass(frozen=True, slots=True, eq=False)
class Morphs:
    """What a character's face can do.

    Attributes:
        targets: T morph targets of its welded vertices, on the stage [m].
        names: of each target; several may share a name.
        expressions: the file's, then one for each name of a target that no expression has.
    """

    targets: MorphTargets
    names: tuple[str, ...]
    expressions: tuple[Expression, ...]

    @classmethod
    def of(
        cls, targets: MorphTargets, names: Sequence[str], expressions: Iterable[Expression] = ()
    ) -> Morphs:
        """Make morphs; each target can also be moved by its own name."""
        known = list(expressions)
        taken = {canonical_name(each.name) for each in known}
        own: dict[str, list[int]] = {}
        for number, name in enumerate(names):
            if canonical_name(name) not in taken:
                own.setdefault(name, []).append(number)
        known += [Expression(name, tuple((t, 1.0) for t in each)) for name, each in own.items()]
        return cls(targets, tuple(names), tuple(known))

    def turned(self, rotation: NDArray[np.float64]) -> Morphs:
        """Return the morphs of the character turned by a matrix (3, 3)."""
        return replace(self, targets=self.targets.turned(rotation))


def welded_targets(
    moves: Sequence[tuple[NDArray[np.int64], NDArray[np.float64]]], groups: NDArray[np.int64]
) -> MorphTargets:
    """Return targets of welded vertices, each moved by the mean of its file vertices.

    Args:
        moves: for each target the file vertices (e,) that it moves, and their deltas (e, 3).
        groups: (M,) the welded vertex of each file vertex.
    """
    count = np.bincount(groups)
    welded = []
    for vertices, deltas in moves:
        own, place = np.unique(groups[vertices], return_inverse=True)
        mean = csr_array(
            (1.0 / count[groups[vertices]], (place.reshape(-1), np.arange(len(vertices)))),
            shape=(len(own), len(vertices)),
        )
        welded.append((own, np.asarray(mean @ deltas)))
    return MorphTargets.of(welded)
