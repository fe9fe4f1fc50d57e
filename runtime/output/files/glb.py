"""Writer of the binary glTF container: arrays, images and their JSON description in one file."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from devices.errors import InputError
from runtime.output.files.whole_file import whole_file

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
_COMPONENTS = {"float32": 5126, "uint32": 5125, "uint16": 5123}
_SHAPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class GlbBuilder:
    """Collects the parts of a glTF 2.0 file. The caller fills in `document`, its JSON."""

    def __init__(self) -> None:
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "Bunraku"},
            "accessors": [],
            "bufferViews": [],
        }
        self._chunks: list[bytes] = []
        self._length = 0

    def add_array(
        self,
        values: NDArray[np.generic],
        *,
        target: int | None = None,
        normalized: bool = False,
        bounds: bool = False,
    ) -> int:
        """Store an array of float32, uint32 or uint16, and return the index of its accessor.

        Matrices (n, 4, 4) are given row-major and stored column-major, as glTF requires.
        """
        shape = values.shape[1:]
        accessor: dict[str, Any] = {
            "componentType": _COMPONENTS[values.dtype.name],
            "count": len(values),
            "type": _SHAPES[shape],
        }
        if normalized:
            accessor["normalized"] = True
        if bounds:
            accessor["min"] = np.atleast_1d(values.min(axis=0)).tolist()
            accessor["max"] = np.atleast_1d(values.max(axis=0)).tolist()
        stored = values.transpose(0, 2, 1) if shape == (4, 4) else values
        accessor["bufferView"] = self._add_view(stored.tobytes(), target)
        return self._add("accessors", accessor)

    def add_places(self, places: NDArray[np.uint32]) -> int:
        """Store places in arrays for `add_sparse`, and return the index of their view."""
        return self._add_view(places.tobytes(), None)

    def add_sparse(self, values: NDArray[np.float32], places: int, count: int) -> int:
        """Store an array that is 0 but for some rows, with its bounds; the index of its accessor.

        Args:
            values: (n, c) the rows.
            places: the view that says where they are.
            count: how many rows there are with those that are 0.
        """
        accessor = {
            "componentType": _COMPONENTS["float32"],
            "count": count,
            "type": _SHAPES[values.shape[1:]],
            "min": np.minimum(values.min(axis=0), 0.0).tolist(),
            "max": np.maximum(values.max(axis=0), 0.0).tolist(),
            "sparse": {
                "count": len(values),
                "indices": {"bufferView": places, "componentType": _COMPONENTS["uint32"]},
                "values": {"bufferView": self._add_view(values.tobytes(), None)},
            },
        }
        return self._add("accessors", accessor)

    def add_texture(self, pixels: NDArray[np.uint8]) -> int:
        """Store an image (h, w, 4) as PNG, and return the index of its texture."""
        png = io.BytesIO()
        Image.fromarray(pixels).save(png, format="PNG")
        view = self._add_view(png.getvalue(), None)
        image = self._add("images", {"bufferView": view, "mimeType": "image/png"})
        return self._add("textures", {"source": image})

    def save(self, path: Path) -> None:
        """Write the whole file.

        Raises:
            InputError: the disk fails, or the file would exceed the 4 GiB of the container.
        """
        document = self.document | {"buffers": [{"byteLength": self._length}]}
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + self._length
        if total >= 2**32:
            raise InputError(
                f"cannot write {path}: the show is too long for one .glb file of 4 GiB; "
                f"export a part of it"
            )
        with whole_file(path) as partial, partial.open("wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, total))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", self._length, b"BIN\0"))
            file.writelines(self._chunks)

    def _add(self, key: str, item: dict[str, Any]) -> int:
        items: list[Any] = self.document.setdefault(key, [])
        items.append(item)
        return len(items) - 1

    def _add_view(self, data: bytes, target: int | None) -> int:
        view: dict[str, Any] = {
            "buffer": 0,
            "byteOffset": self._length,
            "byteLength": len(data),
        }
        if target is not None:
            view["target"] = target
        data += b"\0" * (-len(data) % 4)
        self._chunks.append(data)
        self._length += len(data)
        return self._add("bufferViews", view)
