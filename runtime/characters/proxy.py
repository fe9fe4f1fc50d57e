"""What is deformed in a character's place: its own surface, or a coarse one that it follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.characters.character import Character
from solvers.surface.decimation import decimate
from solvers.surface.embedding import MOST_VERTICES, DenseSurface, embed

DENSE = 20_000  # vertices above which a proxy pays: docs/dense-characters.md, `bunraku bench dense`
PROXY = 9_000  # vertices of one
_WORTH = 0.7  # share of the vertices that a proxy may keep and still be worth it

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Proxy:
    """A surface to bind a skeleton to and to deform, which the character's surface follows.

    Attributes:
        vertices: (C, 3) [m] at rest, some of the character's, or all of them.
        faces: (F', 3).
        kept: (C,) which of the character's vertices they are.
        surface: what lets the others follow; None where there are no others.
        notes: why a dense character is deformed in full, if it is, one short line each.
    """

    vertices: Array
    faces: Indices
    kept: Indices
    surface: DenseSurface | None = None
    notes: tuple[str, ...] = ()
    _out: Array | None = None

    def follow(self, moved: Array) -> Array:
        """Give the character's vertices (N, 3) [m] that go with the proxy's, `moved` (C, 3) [m].

        They are overwritten by the next call; nothing is allocated.
        """
        if self.surface is None or self._out is None:
            return moved
        self.surface.follow(moved, self._out)
        return self._out


def proxy_of(character: Character, *, dense: int = DENSE, count: int = PROXY) -> Proxy:
    """Choose what is deformed: the character itself, or a proxy if it has over `dense` vertices.

    Args:
        character: whose surface.
        dense: vertices above which there is a proxy.
        count: vertices of one.
    """
    if len(character.vertices) <= dense:
        return _whole(character)
    coarse = decimate(character.vertices, character.faces, count)
    if len(coarse.kept) > min(MOST_VERTICES, _WORTH * len(character.vertices)):
        return _whole(character, _too_torn(character, len(coarse.kept)))
    vertices = np.ascontiguousarray(character.vertices[coarse.kept])
    places = embed(character.vertices, coarse.cluster, vertices, coarse.faces)
    surface, out = DenseSurface(places, vertices, coarse.faces), np.empty_like(character.vertices)
    surface.follow(vertices, out)  # compiles now, or loads what an earlier run compiled
    return Proxy(vertices, coarse.faces, coarse.kept, surface, _out=out)


def _whole(character: Character, *notes: str) -> Proxy:
    everything = np.arange(len(character.vertices))
    return Proxy(character.vertices, character.faces, everything, notes=notes)


def _too_torn(character: Character, kept: int) -> str:
    return (
        f"{len(character.vertices)} vertices in pieces too small to simplify ({kept} at the least):"
        " deformed in full, which may be slow"
    )
