"""Draw skeletons and highlighted chains as rods and beads."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from runtime.render.programs import link, release_all

Tubes = NDArray[np.float32]  # (K, 13): from xyz r, to xyz r, linear rgb and opacity, glow

PAIR_COLOURS = np.array(
    [
        [1.000, 0.130, 0.060],  # vermilion
        [0.040, 0.480, 0.950],  # sky
        [1.000, 0.560, 0.030],  # gold
        [0.080, 0.680, 0.180],  # leaf
        [0.720, 0.100, 0.900],  # wisteria
        [0.030, 0.720, 0.620],  # celadon
        [1.000, 0.220, 0.430],  # plum blossom
        [0.620, 0.760, 0.050],  # young bamboo
    ]
)
"""(8, 3) linear RGB: each pair of a source chain and the chain that it drives has a colour."""

GLOW_REACH = 3.2  # radii


def tubes(
    start: ArrayLike,
    end: ArrayLike,
    radius: ArrayLike,
    colour: ArrayLike,
    *,
    opacity: ArrayLike = 1.0,
    glow: float = 0.0,
) -> Tubes:
    """Pack capsules (K, 13) from `start` (K, 3) to `end` (K, 3).

    `radius` [m] is one number, (K,), or (K, 2) for both ends.
    """
    start = np.asarray(start, dtype=np.float32).reshape(-1, 3)
    packed = np.empty((len(start), 13), dtype=np.float32)
    packed[:, 0:3] = start
    packed[:, 4:7] = np.asarray(end).reshape(-1, 3)
    radii = np.asarray(radius, dtype=np.float32)
    packed[:, [3, 7]] = radii if radii.ndim == 2 else radii.reshape(-1, 1)
    packed[:, 8:11] = colour
    packed[:, 11] = opacity
    packed[:, 12] = glow
    return packed


def chain_tubes(chains: Sequence[ArrayLike], colours: ArrayLike, radius: ArrayLike) -> Tubes:
    """Return glows, rods and beads, in this order, along polylines, each (K, 3).

    `radius` [m] is one number, or (C,) of each chain.

    Raises:
        ValueError: the number of colours is not the number of chains.
    """
    rgb = np.asarray(colours, dtype=np.float64).reshape(-1, 3)
    if len(rgb) != len(chains):
        raise ValueError(f"Expected `colours` to have shape ({len(chains)}, 3), got {rgb.shape}")
    if not chains:
        return np.empty((0, 13), dtype=np.float32)
    polylines = [np.asarray(chain, dtype=np.float64).reshape(-1, 3) for chain in chains]
    nodes = np.concatenate(polylines)
    chain_of = np.repeat(np.arange(len(chains)), [len(polyline) for polyline in polylines])
    rod = np.flatnonzero(chain_of[1:] == chain_of[:-1])  # from a node to the next of its chain
    start, end, colour = nodes[rod], nodes[rod + 1], rgb[chain_of[rod]]
    radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(chains))[chain_of]
    thick = radii[rod]
    pale = 0.75 * rgb[chain_of] + 0.25
    return np.concatenate(
        [
            tubes(start, end, thick, colour, opacity=0.55, glow=GLOW_REACH),
            tubes(start, end, thick * 0.62, colour, opacity=0.95),
            tubes(nodes, nodes, radii * 1.25, pale),
        ]
    )


class TubePainter:
    """Draws capsules over the picture in one call, in the order given."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._program = link(context, "tube", "tube")
        self._buffer = context.buffer(reserve=13 * 4 * 256, dynamic=True)
        self._array = self._make_array()

    def _make_array(self) -> moderngl.VertexArray:
        content = (self._buffer, "4f 4f 4f 1f/i", "in_from", "in_to", "in_colour", "in_glow")
        return self._context.vertex_array(self._program, [content])

    def draw(
        self,
        capsules: Tubes,
        to_clip: NDArray[np.float64],
        *,
        size: tuple[float, float],
        pixels: float,
        offset: ArrayLike = (0.0, 0.0, 0.0),
        origin: tuple[float, float] = (0.0, 0.0),
        least: float = 0.9,
    ) -> None:
        """Draw capsules (K, 13) into the bound framebuffer, premultiplied.

        Args:
            capsules: the result of `tubes`.
            to_clip: (4, 4) world to clip space.
            size: of the viewport [px].
            pixels: the pixels of a metre at w = 1.
            offset: added to the capsules' ends [m].
            origin: lower left corner of the viewport [px].
            least: the smallest radius that is drawn [px].
        """
        if not len(capsules):
            return
        if capsules.nbytes > self._buffer.size:
            self._buffer.orphan(2 * capsules.nbytes)
        else:
            self._buffer.orphan()
        self._buffer.write(np.ascontiguousarray(capsules, dtype=np.float32))
        self._program["to_clip"] = tuple(to_clip.T.ravel())
        self._program["offset"] = tuple(np.asarray(offset, dtype=np.float64))
        self._program["size"] = size
        self._program["origin"] = origin
        self._program["pixels"] = pixels
        self._program["least"] = least
        self._array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(capsules))

    def release(self) -> None:
        """Free its GL objects."""
        release_all(self._array, self._buffer, self._program)
