"""Read the materials of a glTF file: base colours and their textures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from replay.gltf.checked_json import Entry
from replay.gltf.file import GltfFile
from runtime.characters.character import Material
from runtime.characters.formats.mesh_data import plain_material
from runtime.characters.formats.pictures import MOST_PIXELS, Texels, decoded


class MaterialReader:
    """Reads each material and image of a file once, within a budget of pixels."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._slots: dict[int | None, int] = {}
        self._images: dict[int, Texels | None] = {}
        self._pixels = 0
        self.materials: list[Material] = []
        self.notes: list[str] = []

    def slot(self, index: int | None) -> int:
        """The place in `materials` of the file's material `index`; None is glTF's default."""
        if index not in self._slots:
            self._slots[index] = len(self.materials)
            self.materials.append(plain_material() if index is None else self._read(index))
        return self._slots[index]

    def _read(self, index: int) -> Material:
        entry = self._file.entry("materials", index)
        look, color_name, texture_name = base(entry)
        color = np.ones(4)
        texture = None
        if look is not None:
            color = np.clip(look.numbers(color_name, (1.0, 1.0, 1.0, 1.0)), 0.0, 1.0)
            info = look.child(texture_name)
            texture = None if info is None else self._texture(info)
        if entry.text("alphaMode", "OPAQUE") == "OPAQUE":
            # glTF 2.0, section 3.9.4: an opaque material ignores every alpha.
            color[3] = 1.0
            if texture is not None and (texture[..., 3] != 255).any():
                texture = texture.copy()
                texture[..., 3] = 255
        return Material(color.astype(np.float32), texture)

    def _texture(self, info: Entry) -> Texels | None:
        texture = self._file.entry("textures", info.whole("index"))
        webp = texture.extension("EXT_texture_webp")
        source = (webp or texture).optional("source")
        if source is None:
            source = texture.optional("source")
        if source is None:
            self.notes.append(f"{texture.place} has no image that can be read: left out")
            return None
        if source not in self._images:
            self._images[source] = self._image(source)
        return self._images[source]

    def _image(self, index: int) -> Texels | None:
        entry = self._file.entry("images", index)
        name = entry.text("name", "") or entry.text("uri", "")[:40] or f"image {index}"
        try:
            if "bufferView" in entry:
                content = bytes(self._file.view(entry.whole("bufferView")))
            else:
                content = self._file.uri_content(entry.text("uri", ""))
            texels, pixels = decoded(content, MOST_PIXELS - self._pixels)
        except ContentError as error:
            self.notes.append(f"texture {name!r} is left out: {error}")
            return None
        self._pixels += pixels
        return texels


def base(material: Entry) -> tuple[Entry | None, str, str]:
    """The object that holds a material's base colour, and the names of its factor and texture."""
    glossy = material.extension("KHR_materials_pbrSpecularGlossiness")
    if glossy is not None:
        return glossy, "diffuseFactor", "diffuseTexture"
    return material.child("pbrMetallicRoughness"), "baseColorFactor", "baseColorTexture"


def texture_coordinates(file: GltfFile, material: int | None) -> tuple[str, NDArray[np.float64]]:
    """The attribute of the base colour's coordinates, and the transform (2, 3) of (u, v, 1).

    Source: extension KHR_texture_transform.
    """
    place = np.eye(3)[:2]
    look = None if material is None else base(file.entry("materials", material))
    info = None if look is None or look[0] is None else look[0].child(look[2])
    if info is None:
        return "TEXCOORD_0", place
    number = info.whole("texCoord", 0, below=16)
    moved = info.extension("KHR_texture_transform")
    if moved is not None:
        number = moved.whole("texCoord", number, below=16)
        turn = moved.number("rotation", 0.0)
        cosine, sine = np.cos(turn), np.sin(turn)
        scale = moved.numbers("scale", (1.0, 1.0))
        place = np.column_stack(
            [
                np.array([[cosine, sine], [-sine, cosine]]) * scale,
                moved.numbers("offset", (0.0, 0.0)),
            ]
        )
    return f"TEXCOORD_{number}", place
