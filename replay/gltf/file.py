"""Read containers, buffers and accessors of glTF files; every offset and count is checked.

Source: Khronos, "glTF 2.0 Specification", sections 3.6 (binary data) and 4 (GLB); extensions
KHR_mesh_quantization and (refused) KHR_draco_mesh_compression, EXT_meshopt_compression.
"""

from __future__ import annotations

import base64
import binascii
import struct
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError, InputError
from replay.bounds import check_recordable
from replay.gltf.checked_json import Entry, parse_document
from replay.text_file import file_bytes

COMPRESSIONS = (
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
)
_STANDARD = str.maketrans("-_", "+/")  # of the alphabet for addresses
MOST_BYTES = 1 << 30
"""Of the file, and of each that it names."""

_MOST_ELEMENTS = 12_000_000
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class GltfFile:
    """An open glTF, GLB or VRM file; buffers are read at their first use.

    Attributes:
        folder: where it lies.
        document: its JSON.
        notes: repairs of the file, one short line each, each once.
    """

    def __init__(self, content: bytes, folder: Path) -> None:
        """Parse a file's content; `folder` is where it lies.

        Raises:
            ContentError: it is no glTF 2 document, or its geometry is compressed.
        """
        self.folder = folder
        text, self._binary = _chunks(content) if content[:4] == b"glTF" else (content, None)
        self.document = parse_document(text)
        for name in self.document.texts("extensionsRequired"):
            if name in COMPRESSIONS:
                raise compressed(name)
        self.notes: dict[str, None] = {}
        self._lists: dict[str, list[Entry]] = {}
        self._buffers: dict[int, bytes] = {}

    def entries(self, kind: str) -> list[Entry]:
        """All top-level entries of a kind: nodes, meshes, accessors, ..."""
        if kind not in self._lists:
            self._lists[kind] = self.document.children(kind)
        return self._lists[kind]

    def entry(self, kind: str, index: int) -> Entry:
        """The entry of a kind with an index.

        Raises:
            ContentError: it does not exist.
        """
        entries = self.entries(kind)
        if index >= len(entries):
            raise ContentError(f"{kind} {index} is named but not there; export the model again")
        return entries[index]

    def uri_content(self, uri: str) -> bytes:
        """The bytes of a data URI, or of the file that a relative URI names, in this file's folder.

        Raises:
            ContentError: the URI leaves the folder, is damaged, or the file cannot be read.
        """
        if uri[:5].lower() == "data:":
            return _data(uri)
        name = unquote(uri).replace("\\", "/")
        inside = Path(name)
        if not name.isprintable() or ":" in name or inside.is_absolute() or ".." in inside.parts:
            raise ContentError(
                f"it names {name[:60]!r}, which is not beside it; put the file into its folder"
            )
        try:
            check_recordable(self.folder / inside)
            return file_bytes(self.folder / inside, MOST_BYTES)
        except InputError:
            raise ContentError(
                f"it needs {name[:60]!r}, which cannot be read; put that file beside it"
            ) from None

    def view(self, index: int) -> memoryview:
        """The bytes of a buffer view."""
        view = self.entry("bufferViews", index)
        for name in COMPRESSIONS:
            if view.extension(name) is not None and self._is_fallback(view, name):
                raise compressed(name)
        content = self._buffer(view.whole("buffer"))
        start, length = view.whole("byteOffset", 0), view.whole("byteLength")
        if start + length > len(content):
            raise view.wrong(f"it ends at byte {start + length} of a buffer of {len(content)}")
        return memoryview(content)[start : start + length]

    def _is_fallback(self, view: Entry, name: str) -> bool:
        buffer = self.entry("buffers", view.whole("buffer"))
        return "uri" not in buffer or buffer.extension(name) is not None

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            buffer = self.entry("buffers", index)
            length = buffer.whole("byteLength")
            if "uri" in buffer:
                content = self.uri_content(buffer.text("uri", ""))
            elif index == 0 and self._binary is not None:
                content = self._binary
            else:
                raise buffer.wrong("it has no bytes")
            if length > len(content):
                raise buffer.wrong(f"it has {len(content)} of {length} bytes")
            self._buffers[index] = content
        return self._buffers[index]

    @np.errstate(invalid="ignore")  # numbers of a damaged file
    def floats(self, index: int, *kinds: str) -> NDArray[np.float64]:
        """An accessor's elements (n, width); normalised integers become [0, 1] or [-1, 1]."""
        accessor = self.entry("accessors", index)
        values = self._elements(accessor, kinds)
        result = values.astype(np.float64)
        if accessor.flag("normalized") and values.dtype.kind in "iu":
            result = np.maximum(result / np.iinfo(values.dtype.str).max, -1.0)
        return result

    def wholes(self, index: int, *kinds: str) -> NDArray[np.int64]:
        """An accessor's elements (n, width), which must be whole numbers from 0.

        Some exporters write them as floats or signed; that is noted.
        """
        accessor = self.entry("accessors", index)
        values = self._elements(accessor, kinds)
        if values.dtype.kind == "u":
            return values.astype(np.int64)
        numbers = values.astype(np.float64)
        if not ((numbers >= 0.0) & (numbers < 1 << 32) & (numbers == np.floor(numbers))).all():
            raise accessor.wrong("it holds indices that are no unsigned integers")
        self.notes["indices that are no unsigned integers were taken as such"] = None
        return numbers.astype(np.int64)

    def count(self, index: int) -> int:
        """The number of elements of an accessor, without reading them."""
        return self.entry("accessors", index).whole("count", below=_MOST_ELEMENTS + 1)

    def _elements(self, accessor: Entry, kinds: tuple[str, ...]) -> NDArray[np.generic]:
        kind = accessor.text("type", "")
        component = _COMPONENTS.get(accessor.whole("componentType"))
        if kind not in kinds or component is None:
            raise accessor.wrong(f"it is not of type {' or '.join(kinds)}")
        count = accessor.whole("count", below=_MOST_ELEMENTS + 1)
        width = _WIDTHS[kind]
        values: NDArray[np.generic] = np.zeros((count, width), dtype=component)
        if "bufferView" in accessor:
            values = self._strided(accessor, accessor, component, count, width)
        sparse = accessor.child("sparse")
        if sparse is not None:
            self._replace(sparse, values, component)
        return values

    def _replace(self, sparse: Entry, values: NDArray[np.generic], component: str) -> None:
        number = sparse.whole("count", below=len(values) + 1)
        where, what = sparse.child("indices"), sparse.child("values")
        if where is None or what is None:
            raise sparse.wrong("indices or values are missing")
        index_type = _COMPONENTS.get(where.whole("componentType"), "")
        if index_type not in ("u1", "<u2", "<u4"):
            raise where.wrong("its component type is no unsigned integer")
        places = self._strided(sparse, where, index_type, number, 1)[:, 0].astype(np.int64)
        if number and places.max() >= len(values):
            raise where.wrong(f"it names element {places.max()} of {len(values)}")
        values[places] = self._strided(sparse, what, component, number, values.shape[1])

    def _strided(
        self, owner: Entry, source: Entry, component: str, count: int, width: int
    ) -> NDArray[np.generic]:
        """`count` elements copied from the buffer view that `source` names."""
        index = source.whole("bufferView")
        view = self.view(index)
        size = np.dtype(component).itemsize
        stride = self.entry("bufferViews", index).whole("byteStride", width * size, below=1 << 16)
        start = source.whole("byteOffset", 0)
        if stride < width * size:
            raise owner.wrong(f"elements of {width * size} bytes overlap at a stride of {stride}")
        if count and start + (count - 1) * stride + width * size > len(view):
            raise owner.wrong(f"{count} elements do not fit into {len(view)} bytes")
        return np.ndarray(
            (count, width), component, view if count else None, start, (stride, size)
        ).copy()


def _data(uri: str) -> bytes:
    """The bytes of a data URI; base64 may be wrapped, percent-encoded or without its padding.

    Raises:
        ContentError: it is damaged.
    """
    head, _, body = uri.partition(",")
    if not head.replace(" ", "").lower().endswith(";base64"):
        return unquote_to_bytes(body)
    coded = "".join(unquote(body).split()).rstrip("=").translate(_STANDARD)
    try:
        return base64.b64decode(coded + "=" * (-len(coded) % 4), validate=True)
    except (binascii.Error, ValueError):
        raise ContentError("a data URI is damaged; export the model again") from None


def compressed(name: str) -> ContentError:
    """The error for geometry compressed by the extension called `name`."""
    return ContentError(f"its geometry is compressed ({name}); export it without compression")


def _chunks(content: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a GLB file."""
    if len(content) < 20:
        raise ContentError("it is cut short; export or download the model again")
    version, length = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise ContentError(f"is GLB version {version}; export it as glTF 2.0")
    if length > len(content):
        raise ContentError(f"has {len(content)} of {length} bytes; export or download it again")
    chunks: list[tuple[bytes, bytes]] = []
    at = 12
    while at + 8 <= length and len(chunks) < 2:
        size, kind = struct.unpack_from("<I4s", content, at)
        if at + 8 + size > length:
            raise ContentError("a chunk ends beyond the file; export or download the model again")
        chunks.append((kind, content[at + 8 : at + 8 + size]))
        at += 8 + size
    if not chunks or chunks[0][0] != b"JSON":
        raise ContentError("its first chunk is not JSON; export the model again")
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == b"BIN\0" else None
    return chunks[0][1], binary
