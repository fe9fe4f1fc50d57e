"""The parts of a built-in character before it is meshed: a solid, paints and limbs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from runtime.characters.builtin.signed_distance import Field

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Paint:
    """A region of the surface in one colour.

    Attributes:
        region: signed distance, negative where the paint is.
        color: sRGB, ``#rrggbb``.
        softness: width of its border [m]; 0 is a crisp outline, and the mesh's edges follow it.
        strength: how much of what lies below it hides, in [0, 1].
    """

    region: Field
    color: str
    softness: float = 0.0
    strength: float = 1.0


@dataclass(frozen=True, slots=True)
class Limb:
    """A chain of skeleton nodes.

    Attributes:
        name: its nodes are called ``name0``, ``name1``, ...
        path: (k, 3) [m] where they stand.
        parent: the node that the first one hangs on; None for the limb that holds the root.
    """

    name: str
    path: Array
    parent: str | None = None


@dataclass(frozen=True, slots=True)
class Sculpture:
    """A character before it is meshed.

    Attributes:
        solid: its signed distance, metres, +Y up, facing +Z.
        lower, upper: (3,) [m] a box that holds it with some air around.
        edge: about how long the mesh's edges are [m].
        base: the sRGB colour of what no paint covers.
        paints: from the bottom layer to the top one.
        limbs: its skeleton, the root limb first.
        mesh: vertices (n, 3) [m] and faces (m, 3) where the level set would not do: on what is
            thinner than its edges are long.
    """

    solid: Field
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    edge: float
    base: str
    paints: tuple[Paint, ...]
    limbs: tuple[Limb, ...]
    mesh: tuple[Array, NDArray[np.int64]] | None = None


def grow(limbs: Sequence[Limb]) -> Skeleton:
    """The skeleton of the limbs: each chain hangs on the node that it names."""
    names: list[str] = []
    parents: list[int] = []
    for limb in limbs:
        previous = -1 if limb.parent is None else names.index(limb.parent)
        for number in range(len(limb.path)):
            parents.append(previous)
            previous = len(names)
            names.append(f"{limb.name}{number}")
    positions = np.concatenate([limb.path for limb in limbs])
    return Skeleton(tuple(names), np.array(parents), positions)


def color_of(text: str) -> Array:
    """The sRGB triple (3,) in [0, 1] of ``#rrggbb``."""
    return np.array([int(text[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0


def painted(sculpture: Sculpture, vertices: Array, crispness: float) -> Array:
    """sRGB colours (n, 3) in [0, 1]; a vertex within `crispness` [m] of an outline is inside."""
    colors = np.tile(color_of(sculpture.base), (len(vertices), 1))
    for paint in sculpture.paints:
        depth = paint.region(vertices)
        if paint.softness > 0.0:
            cover = np.clip(0.5 - depth / paint.softness, 0.0, 1.0)
            cover = cover * cover * (3.0 - 2.0 * cover)
        else:
            cover = (depth < crispness).astype(np.float64)
        colors += (paint.strength * cover)[:, None] * (color_of(paint.color) - colors)
    return colors
