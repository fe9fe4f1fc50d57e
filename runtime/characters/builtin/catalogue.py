"""Load built-in characters by name."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.builtin.blend_shapes import builtin_morphs
from runtime.characters.character import Character, Material, Surface

BUILTIN = ("squid", "cactus", "trex", "paper", "mannequin")
"""Names that `builtin_character` knows."""


def builtin_character(name: str) -> Character:
    """Return the built-in character called `name`, in its rest pose on the stage.

    Raises:
        InputError: the name is not known; the message lists the known names.
    """
    if name not in BUILTIN:
        raise InputError(
            f"no built-in character is called {name!r}; there are: {', '.join(BUILTIN)}"
        )
    path = files("runtime.characters.builtin") / "meshes" / f"{name}.npz"
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        vertices = stored["vertices"].astype(np.float64)
        faces = stored["faces"].astype(np.int64)
        colors = linear_rgba(stored["colors"])
        names = tuple(str(node) for node in stored["node_names"])
        skeleton = Skeleton(names, stored["node_parents"], stored["node_positions"])
    surface = Surface(
        vertex=np.arange(len(vertices)),
        faces=faces.astype(np.int32),
        colors=colors,
        uvs=None,
        materials=(Material(np.ones(4, dtype=np.float32)),),
        face_material=np.zeros(len(faces), dtype=np.int64),
    )
    morphs = builtin_morphs(name, vertices, faces)
    return Character(name, vertices, faces, skeleton, None, surface, np.eye(4), morphs=morphs)


def linear_rgba(srgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Opaque linear colours (n, 4) in [0, 1] of sRGB bytes (n, 3). Source: IEC 61966-2-1."""
    encoded = srgb / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.column_stack([linear, np.ones(len(linear))]).astype(np.float32)
