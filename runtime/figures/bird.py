"""A bird with a body to squash and a tail that should keep its volume (the paper's figure 6)."""

from __future__ import annotations

import numpy as np

from devices.skeleton import Skeleton
from runtime.characters.character import Character, Material, Surface
from runtime.figures.plain import volume
from runtime.figures.revolved import revolved
from solvers.linear.laplacian import Floats

BIRD = "bird"
_TAIL = 0.80  # [m] the x at which the tail begins
_COLOUR = (0.16, 0.42, 0.62, 1.0)


def bird() -> Character:
    """Return the bird at rest, beak to the left, two metres long."""
    x = np.linspace(-0.6, 1.4, 90)[1:-1]
    body = 0.34 * np.exp(-(((x + 0.05) / 0.44) ** 4))
    tail = 0.20 * np.exp(-(((x - 1.08) / 0.22) ** 4))
    ends = np.sqrt(1.0 - ((x - 0.4) / 1.0) ** 2)
    vertices, faces = revolved(x, (0.08 + body + tail) * ends, 40)
    vertices[:, 1] -= vertices[:, 1].min()
    count = len(vertices)
    surface = Surface(
        vertex=np.arange(count),
        faces=faces.astype(np.int32),
        colors=np.tile(np.array(_COLOUR, dtype=np.float32), (count, 1)),
        uvs=None,
        materials=(Material(np.ones(4, dtype=np.float32)),),
        face_material=np.zeros(len(faces), dtype=np.int64),
    )
    skeleton = Skeleton(("root",), np.array([-1]), np.zeros((1, 3)))
    return Character(BIRD, vertices, faces, skeleton, None, surface, np.eye(4))


def tail_volume(vertices: Floats, character: Character) -> float:
    """Return the volume of the bird's tail for vertices (N, 3); a cone closes its open end."""
    is_tail = character.vertices[character.faces, 0].min(axis=1) > _TAIL
    faces = character.faces[is_tail]
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = len(vertices)
    is_open = ~np.isin(tails * count + heads, heads * count + tails)
    apex = vertices[tails[is_open]].mean(axis=0)
    # `volume` sums from the first vertex, so a cone with its apex there adds nothing.
    return volume(np.vstack([apex, vertices]), faces + 1)
