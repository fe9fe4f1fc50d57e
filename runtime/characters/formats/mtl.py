"""Read material libraries of OBJ files: diffuse colour, opacity and diffuse texture."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.text_file import without_mark
from runtime.characters.character import Material
from runtime.characters.formats.beside import beside
from runtime.characters.formats.mesh_data import MeshError
from runtime.characters.formats.pictures import MOST_PIXELS, PictureSizeError, Texels, decoded
from runtime.characters.palette import linear_from_srgb

_WORDS = r"-(?:blend[uv]|boost|mm|[ost]|texres|clamp|bm|imfchan|type|cc|colorspace)"
_VALUE = r"on|off|sphere|cube_\w+|[rgbmlz]|\w*RGB|auto|-?[\d.,]+(?:e[-+]?\d+)?"
_VALUES = rf"(?:\s+(?:{_VALUE})(?=\s|$)){{0,3}}"
_OPTIONS_BEFORE = re.compile(rf"^(?:\s*{_WORDS}{_VALUES}\s+)+", re.IGNORECASE)
_OPTIONS_BEHIND = re.compile(rf"(?:\s+{_WORDS}{_VALUES})+\s*$", re.IGNORECASE)
MOST_BYTES = 4 << 20
MOST_TEXTURE_BYTES = 256 << 20
TEXTURE_SIZE = 2048
"""Greatest number of texels on the longer side; larger textures are reduced."""


def read_mtl(path: Path, textures: Textures) -> tuple[dict[str, Material], list[str]]:
    """Return the materials by name, and notes; a missing or damaged library gives none.

    `Kd` is taken as sRGB and replaced by white under a `map_Kd`, which most exporters mean. A name
    is the whole line behind `newmtl`, with `#`.
    """
    try:
        if not path.is_file():
            raise FileNotFoundError(path)
        with path.open("rb") as file:
            text = without_mark(file.read(MOST_BYTES)).decode("utf-8", errors="replace")
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return {}, [f"material library {path.name!r} cannot be read: default colours"]
    settings = _settings(text)
    notes: list[str] = []
    if settings and all(_numbers(said.get("Tr", ""))[:1] == [1.0] for said in settings.values()):
        notes.append(f"Tr is 1 on every material of {path.name!r}: taken as opaque")
        for said in settings.values():
            said["d"] = "1"
    materials: dict[str, Material] = {}
    for name, said in settings.items():
        texture = None
        if "map_Kd" in said:
            texture, note = textures.named(path.parent, said["map_Kd"])
            notes += [note] if note and note not in notes else []
        materials[name] = Material(_color(said, textured=texture is not None), texture)
    return materials, notes


def _settings(text: str) -> dict[str, dict[str, str]]:
    """The words behind the keywords that are read, for each material by name."""
    settings: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for line in text.splitlines():
        keyword, *rest = line.split(None, 1)[:2] or [""]
        value = rest[0].strip() if rest else ""
        if keyword == "newmtl":
            current = settings.setdefault(" ".join(value.split()), {})
        elif keyword in {"Kd", "d", "Tr", "map_Kd"}:
            current[keyword] = value.partition("#")[0].strip()
    return settings


def _color(said: dict[str, str], *, textured: bool) -> NDArray[np.float32]:
    """Linear RGBA (4,) from `Kd` and `d`, or `Tr`, which is 1 - d."""
    alpha = _numbers(said.get("d", ""))[:1] or [1.0 - x for x in _numbers(said.get("Tr", ""))[:1]]
    rgb = _numbers(said.get("Kd", ""))[:3]
    if textured or len(rgb) != 3:
        rgb = [1.0, 1.0, 1.0]
    color: NDArray[np.float32] = linear_from_srgb(np.array([[*rgb, *(alpha or [1.0])]]))[0]
    return color


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word.replace(",", ".")) for word in text.split()]
    except ValueError:
        return []
    return values if np.isfinite(values).all() else []


class Textures:
    """The textures of one OBJ: each file is decoded once, all within a budget of pixels."""

    def __init__(self) -> None:
        self._left = MOST_PIXELS
        self._read: dict[Path, tuple[Texels | None, str]] = {}

    def named(self, folder: Path, value: str) -> tuple[Texels | None, str]:
        """The picture (h, w, 4) that a `map_Kd` line in `folder` names, and a note if none."""
        name = _without_options(value)
        try:
            path = beside(folder, value) or beside(folder, name)
            if path is not None and path not in self._read:
                self._read[path] = self._decoded(path)
            texture, fault = (None, _absence(folder, name)) if path is None else self._read[path]
        except (OSError, ValueError):  # a name that no file can have
            texture, fault = None, "is not there: default colours"
        return texture, f"texture {Path(name).name!r} {fault}" if fault else ""

    def _decoded(self, path: Path) -> tuple[Texels | None, str]:
        if path.stat().st_size > MOST_TEXTURE_BYTES:
            return None, "is too large: left out"
        try:
            texture, pixels = decoded(path.read_bytes(), self._left, TEXTURE_SIZE)
        except PictureSizeError:
            return None, "is too large: left out"
        except (OSError, MeshError):
            return None, "is no PNG, JPEG or WebP, or is damaged: default colours"
        self._left -= pixels
        return texture, ""


def _absence(folder: Path, name: str) -> str:
    outside = not (folder / name).resolve().is_relative_to(folder.resolve())
    what = "is outside the character's folder" if outside else "is not there"
    return f"{what}: default colours"


def _without_options(value: str) -> str:
    """The name of a texture without the options before and, in some programs, behind it."""
    return _OPTIONS_BEHIND.sub("", _OPTIONS_BEFORE.sub("", value)).strip().replace("\\", "/")
