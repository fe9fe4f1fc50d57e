"""The surface that the solver deforms: the character's own, or a coarse one that carries it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.characters.character import Character
from solvers.surface.decimation import decimate
from solvers.surface.embedding import MOST_VERTICES, DenseSurface, embed

DENSE = 20_000  # vertices; above this a proxy is faster (docs/dense-characters.md, `bench dense`)
PROXY = 9_000  # vertices of a proxy
_WORTH = 0.7  # a proxy that keeps a larger share of the vertices is not used

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Proxy:
    """A surface to bind a skeleton to and to deform, which the character's surface follows.

    Attributes:
        vertices: (C, 3) [m] at rest: some of the character's vertices, or all.
        faces: (F', 3) into `vertices`.
        kept: (C,) index of each in the character's vertices.
        surface: moves the other vertices along; None where the proxy has all of them.
        notes: one short line if a dense character has no proxy, and why.
    """

    vertices: Array
    faces: Indices
    kept: Indices
    surface: DenseSurface | None = None
    notes: tuple[str, ...] = ()
    _out: Array | None = None

    def follow(self, moved: Array) -> Array:
        """Return the character's vertices (N, 3) [m] for deformed ones of the proxy (C, 3) [m].

        The next call overwrites the result; nothing is allocated.
        """
        if self.surface is None or self._out is None:
            return moved
        self.surface.follow(moved, self._out)
        return self._out


def proxy_of(character: Character, *, dense: int = DENSE, count: int = PROXY) -> Proxy:
    """Return a proxy of a character; below `dense` vertices it is the character's whole surface.

    Args:
        character: the character to deform.
        dense: number of vertices above which the surface is simplified.
        count: number of vertices to simplify it to.
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
    """A proxy with all of the character's vertices."""
    everything = np.arange(len(character.vertices))
    return Proxy(character.vertices, character.faces, everything, notes=notes)


def _too_torn(character: Character, kept: int) -> str:
    """The note on a surface that falls into too many pieces to simplify."""
    return (
        f"{len(character.vertices)} vertices in pieces too small to simplify ({kept} at the least):"
        " deformed in full, which may be slow"
    )
