"""Material libraries of OBJ files: diffuse colour, opacity and diffuse texture."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from runtime.characters.character import Material
from runtime.characters.palette import linear_from_srgb

MOST_BYTES = 4 << 20
MOST_TEXTURE_BYTES = 256 << 20
MOST_TEXELS = 8192 * 8192
TEXTURE_SIZE = 2048
"""Larger textures are reduced to this many texels on the longer side."""


def read_mtl(path: Path) -> tuple[dict[str, Material], list[str]]:
    """The materials by name and notes; a missing or damaged library gives none, never an error.

    `Kd` is taken as sRGB and replaced by white under a `map_Kd`, which most exporters mean.
    """
    try:
        if not path.is_file():
            raise FileNotFoundError(path)
        with path.open("rb") as file:
            text = file.read(MOST_BYTES).decode("utf-8", errors="replace")
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return {}, [f"material library {path.name!r} cannot be read: default colours"]
    settings: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for line in text.splitlines():
        keyword, _, value = line.split("#", 1)[0].strip().partition(" ")
        if keyword == "newmtl":
            current = settings.setdefault(value.strip(), {})
        elif keyword in {"Kd", "d", "Tr", "map_Kd"}:
            current[keyword] = value.strip()
    materials: dict[str, Material] = {}
    notes: list[str] = []
    for name, said in settings.items():
        texture = None
        if "map_Kd" in said:
            texture, note = _texture(path.parent, said["map_Kd"])
            notes += [note] if note else []
        materials[name] = Material(_color(said, textured=texture is not None), texture)
    return materials, notes


def _color(said: dict[str, str], *, textured: bool) -> NDArray[np.float32]:
    alpha = _numbers(said.get("d", ""))[:1] or [1.0 - x for x in _numbers(said.get("Tr", ""))[:1]]
    rgb = _numbers(said.get("Kd", ""))[:3]
    if textured or len(rgb) != 3:
        rgb = [1.0, 1.0, 1.0]
    color: NDArray[np.float32] = linear_from_srgb(np.array([[*rgb, *(alpha or [1.0])]]))[0]
    return color


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return []
    return values if np.isfinite(values).all() else []


def _texture(folder: Path, value: str) -> tuple[NDArray[np.uint8] | None, str]:
    """The image (h, w, 4) that a map_Kd line names, and a note where there is none."""
    name = value.rsplit(maxsplit=1)[-1] if value.startswith("-") else value  # after options
    path = folder / name.replace("\\", "/")
    try:
        if not path.is_file():
            return None, f"texture {path.name!r} is not there: default colours"
        if path.stat().st_size > MOST_TEXTURE_BYTES:
            return None, f"texture {path.name!r} is too large: left out"
        with warnings.catch_warnings(), Image.open(path) as image:
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            if image.width * image.height > MOST_TEXELS:
                return None, f"texture {path.name!r} is too large: left out"
            image.thumbnail((TEXTURE_SIZE, TEXTURE_SIZE))
            return np.array(image.convert("RGBA"), dtype=np.uint8), ""
    except (OSError, ValueError, SyntaxError, UnidentifiedImageError):
        return None, f"texture {path.name!r} is no image or damaged: default colours"
