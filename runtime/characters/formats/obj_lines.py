"""Parse the lines of Wavefront OBJ files into arrays, in bulk.

trimesh's parser is not used: it resolves relative indices against the end of the file, reorders
faces by material, misses comments behind faces and leading blanks, and opens the material library.
This one is as fast and reads each line by the format's rules.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, compress, repeat

import numpy as np
from numpy.typing import NDArray

from runtime.characters.formats.mesh_data import MOST_FACES, MOST_VERTICES, MeshError

_BLOCK = 4 << 20  # [bytes] parsed at a time; bounds the memory for words
_MOST_LINE = 16 << 20  # [bytes]
_KINDS = {"v": 1, "vt": 2, "f": 3, "usemtl": 4, "mtllib": 5}
_V, _VT, _F, _USEMTL, _MTLLIB = _KINDS.values()
_KIND_BY_HEAD = {"v ": _V, "vt": _VT, "vn": 0, "f ": _F, "": 0}  # by a line's first two characters

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class ObjContent:
    """The content of an OBJ file, polygons not yet cut into triangles.

    Attributes:
        positions: (V, 3) of the `v` lines.
        colors: (V, 3) the numbers behind the positions, or None if a vertex has none.
        uvs: (T, 2) of the `vt` lines, or None if one of them is damaged.
        corners: (C, 2) index of position and of uv, from 0; uv -1 where a corner has none.
        sizes: (P,) number of corners of each polygon, all at least 3.
        polygon_material: (P,) into `materials`.
        materials: names in the order of `usemtl`; the first is of the faces before any.
        libraries: names of material files.
        short_faces: number of faces of fewer than three corners, which are left out.
    """

    positions: Floats
    colors: Floats | None
    uvs: Floats | None
    corners: Indices
    sizes: Indices
    polygon_material: Indices
    materials: tuple[str, ...]
    libraries: tuple[str, ...]
    short_faces: int


def parse_obj(content: bytes) -> ObjContent:
    """Parse an OBJ file: all its objects and groups, in the order of its lines.

    Raises:
        MeshError: a number is damaged, or there are more vertices or faces than are read.
    """
    reading = _Reading()
    for number, lines in _blocks(content):
        reading.add(number, lines)
    return reading.content()


class _Reading:
    """The blocks that are parsed so far."""

    def __init__(self) -> None:
        self._positions: list[Floats] = []
        self._colors: list[Floats] | None = []
        self._uvs: list[Floats] | None = []
        self._corners: list[Indices] = []
        self._sizes: list[Indices] = []
        self._polygon_material: list[Indices] = []
        self._materials = {"": 0}
        self._libraries: list[str] = []
        self._material = self._vertices = self._vts = self._triangles = 0
        self._short_faces = 0

    def add(self, number: int, lines: list[str]) -> None:
        """Parse a block of lines, of which the first is line `number` of the file."""
        kinds = _kinds_of(lines)
        self._check_counts(int(np.count_nonzero(kinds == _V)), 0)
        material = self._material_of_lines(lines, kinds)
        if (kinds == _F).any():
            self._add_faces(_words(lines, kinds, "f"), kinds, material, number)
        if (kinds == _V).any():
            self._add_positions(_words(lines, kinds, "v"))
        if (kinds == _VT).any():
            self._add_uvs(_words(lines, kinds, "vt"))

    def _material_of_lines(self, lines: list[str], kinds: Indices) -> Indices:
        """Index of the material that holds at each line of a block (L,)."""
        for place in np.flatnonzero(kinds == _MTLLIB).tolist():
            self._libraries += [name.strip() for name in lines[place].split(None, 1)[1:]]
        places = np.flatnonzero(kinds == _USEMTL)
        used = [self._material]
        for place in places.tolist():
            name = " ".join(lines[place].split()[1:])
            used.append(self._materials.setdefault(name, len(self._materials)))
        self._material = used[-1]
        return np.repeat(np.array(used), np.diff(places, prepend=0, append=len(lines)))

    def _add_faces(self, faces: _Words, kinds: Indices, material: Indices, number: int) -> None:
        try:
            corners = _corners(faces.words)
        except ValueError:
            line = number + int(np.flatnonzero(kinds == _F)[_first_damaged(faces)])
            raise MeshError(f"line {line} has a face that is not made of whole numbers") from None
        except OverflowError:
            raise MeshError("a face names a vertex that no file has; it is damaged") from None
        if corners.min(initial=0) < 0:
            counts = [np.cumsum(kinds == _V) + self._vertices, np.cumsum(kinds == _VT) + self._vts]
            before = np.repeat(np.column_stack(counts)[kinds == _F], faces.sizes, axis=0)
            corners = np.where(corners < 0, corners + before + 1, corners)
        whole = faces.sizes >= 3
        self._short_faces += int(np.count_nonzero(~whole))
        self._check_counts(0, int((faces.sizes[whole] - 2).sum()))
        self._corners.append(corners[np.repeat(whole, faces.sizes)] - 1)
        self._sizes.append(faces.sizes[whole])
        self._polygon_material.append(material[kinds == _F][whole])

    def _add_positions(self, rows: _Words) -> None:
        self._vertices += len(rows.sizes)
        self._positions.append(_floats(rows, range(3), "v"))
        if self._colors is not None and rows.sizes.min() >= 6:
            self._colors.append(_floats(rows, range(3, 6), "v"))
        else:
            self._colors = None

    def _add_uvs(self, rows: _Words) -> None:
        self._vts += len(rows.sizes)
        if self._uvs is None:
            return
        try:
            self._uvs.append(_floats(rows, range(2), "vt"))
        except MeshError:
            self._uvs = None  # an error only where a texture needs them

    def _check_counts(self, vertices: int, triangles: int) -> None:
        self._triangles += triangles
        if self._vertices + vertices > MOST_VERTICES:
            raise MeshError(f"it has more than {MOST_VERTICES} vertices; reduce it first")
        if self._triangles > MOST_FACES:
            raise MeshError(f"it has more than {MOST_FACES} faces; reduce it first")

    def content(self) -> ObjContent:
        """Everything that was added."""
        nothing = np.zeros(0, dtype=np.int64)
        return ObjContent(
            positions=np.concatenate([np.zeros((0, 3)), *self._positions]),
            colors=np.concatenate(self._colors) if self._colors else None,
            uvs=None if self._uvs is None else np.concatenate([np.zeros((0, 2)), *self._uvs]),
            corners=np.concatenate([nothing.reshape(0, 2), *self._corners]),
            sizes=np.concatenate([nothing, *self._sizes]),
            polygon_material=np.concatenate([nothing, *self._polygon_material]),
            materials=tuple(self._materials),
            libraries=tuple(dict.fromkeys(self._libraries)),
            short_faces=self._short_faces,
        )


def _blocks(content: bytes) -> Iterator[tuple[int, list[str]]]:
    """The lines of a file, some megabytes at a time, each block with its first line's number.

    A line that ends in a backslash goes on in the next one; both count as one.
    """
    content = content.removeprefix(b"\xef\xbb\xbf")  # byte order mark
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    content = content.replace(b"\\\n", b" ")
    start, number = 0, 1
    while start < len(content):
        end = content.find(b"\n", start + _BLOCK, start + _BLOCK + _MOST_LINE)
        if end < 0 and len(content) > start + _BLOCK + _MOST_LINE:
            raise MeshError(f"it has a line of more than {_MOST_LINE >> 20} MiB; it is damaged")
        end = len(content) if end < 0 else end + 1
        lines = content[start:end].decode("utf-8", errors="replace").splitlines()
        yield number, lines
        start, number = end, number + len(lines)


@dataclass(frozen=True, slots=True, eq=False)
class _Words:
    """The words behind the keyword of all lines of one kind, and how many each line has (R,)."""

    words: list[str]
    sizes: Indices


def _kinds_of(lines: list[str]) -> Indices:
    """The number of each line's keyword (L,) in `_KINDS`, 0 for every other."""
    kinds = list(map(_KIND_BY_HEAD.get, [line[:2] for line in lines]))
    if None in kinds:
        for place, kind in enumerate(kinds):
            if kind is None:
                kinds[place] = _KINDS.get((lines[place].split(None, 1) or [""])[0], 0)
    return np.array(kinds, dtype=np.int64)


def _words(lines: list[str], kinds: Indices, keyword: str) -> _Words:
    """The words of the lines of one kind, without comments.

    Where all lines have equally many words, all of them are split in one go, which is most of
    the speed.
    """
    rows = list(compress(lines, (kinds == _KINDS[keyword]).tolist()))
    text = "\n".join(rows)
    if "#" in text:
        rows = [row.partition("#")[0] for row in rows]
        text = "\n".join(rows)
    words = text.split()
    width = len(words) // len(rows)
    if width * len(rows) == len(words) and words[::width].count(keyword) == len(rows):
        del words[::width]
        if keyword not in words:
            return _Words(words, np.full(len(rows), width - 1, dtype=np.int64))
    parts = [row.split()[1:] for row in rows]
    sizes = np.fromiter(map(len, parts), np.int64, len(parts))
    return _Words(list(chain.from_iterable(parts)), sizes)


def _floats(rows: _Words, columns: range, keyword: str) -> Floats:
    """The words in some columns of all rows as numbers (R, columns)."""
    if rows.sizes.min() < columns.stop:
        raise MeshError(f"a {keyword} line does not have {len(columns)} numbers; it is damaged")
    size, count = int(rows.sizes[0]), len(rows.sizes)
    numbers = np.empty((count, len(columns)))
    starts = np.cumsum(rows.sizes) - rows.sizes
    try:
        for place, column in enumerate(columns):
            if (rows.sizes == size).all():
                words = rows.words[column::size]
            else:
                words = [rows.words[start] for start in (starts + column).tolist()]
            numbers[:, place] = _as_numbers(words)
    except ValueError:
        raise MeshError(
            f"a {keyword} line does not have {len(columns)} numbers; it is damaged"
        ) from None
    return numbers


def _as_numbers(words: list[str]) -> Floats:
    """Words as numbers, with decimal points or, as some programs write them, commas."""
    try:
        return np.fromiter(map(float, words), np.float64, len(words))
    except ValueError:
        return np.array([float(word.replace(",", ".")) for word in words])


def _corners(words: list[str]) -> Indices:
    """Position and uv (C, 2) that each word names, as written; 0 where it names none.

    Raises:
        ValueError: a word is not made of whole numbers.
        OverflowError: a number has more than 64 bits.
    """
    corners = np.zeros((len(words), 2), dtype=np.int64)
    slashes = set(map(str.count, words, repeat("/")))
    text = " ".join(words).replace("//", "/0/")
    if len(slashes) == 1 and text.isascii() and text.replace("/", "").replace(" ", "").isdigit():
        fields = np.fromstring(text.replace("/", " "), dtype=np.int64, sep=" ")
        width = len(fields) // len(words)
        if width == max(slashes) + 1 and width * len(words) == len(fields):
            corners[:, : min(width, 2)] = fields.reshape(-1, width)[:, :2]
            return corners
    parts = [word.split("/") for word in words]
    corners[:, 0] = [int(part[0]) for part in parts]
    corners[:, 1] = [int(part[1]) if len(part) > 1 and part[1] else 0 for part in parts]
    return corners


def _first_damaged(faces: _Words) -> int:
    """The first row that holds a word which is not made of whole numbers."""
    ends = np.cumsum(faces.sizes)
    for place, word in enumerate(faces.words):
        try:
            _corners([word])
        except ValueError:
            return int(np.searchsorted(ends, place, side="right"))
    raise AssertionError("no word is damaged")
