"""Read OFF files in ASCII, with colours of vertices."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from replay.text_file import without_mark
from runtime.characters.formats.mesh_data import FileMesh, MeshError, check_counts, check_words
from runtime.characters.formats.polygons import cut_polygons
from runtime.characters.palette import linear_from_srgb

_KEYWORD = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF(?=[\d-]|$)", re.ASCII)


def read_off(content: bytes) -> FileMesh:
    """Read OFF, COFF, NOFF, CNOFF and STOFF; polygons are cut into triangles.

    The keyword may be in small letters, and the counts may follow it without a break (ModelNet40).
    Numbers may stand on any lines, unless vertices have colours.

    Colours of vertices are taken as sRGB, whole numbers to 255 or fractions to 1; colours of faces,
    normals and texture coordinates are left out.

    Raises:
        MeshError: the file is damaged, cut short or binary.
    """
    check_words(content)
    lines = [
        line.split()
        for raw in without_mark(content).decode("latin-1").splitlines()
        if (line := raw.split("#", 1)[0].strip())
    ]
    if not lines:
        raise MeshError("it is empty; export the character's mesh again")
    colored, normals, head = _header(lines)
    count, face_count = _counts(lines, head)
    check_counts(count, face_count)
    body = lines[head + 1 :]
    width = 3 + 3 * normals
    short = len(body) < count + face_count or len(lines[head]) < 2
    if short or any(len(row) < width for row in body[:count]):
        words = [word for line in lines[head:] for word in line]
        body = _rows(words[3:], count, face_count, width)
    if len(body) < count + face_count:
        raise MeshError(
            f"it announces {count} vertices and {face_count} faces but ends before; it is cut short"
        )
    vertices = _numbers(body[:count], 3)
    skipped = 3 + 3 * normals
    widths = {len(words) for words in body[:count]}
    colors = None
    if colored and min(widths) >= skipped + 3:
        colors = _colors(_numbers(body[:count], min(*widths, skipped + 4))[:, skipped:])
    corners, sizes = _polygons(body[count : count + face_count])
    cut, notes = cut_polygons(vertices, corners, sizes)
    return FileMesh(vertices, corners[cut.corners], colors, notes=notes)


def _header(lines: list[list[str]]) -> tuple[bool, bool, int]:
    """Whether vertices have colours, whether they have normals, and the line of the counts."""
    word = lines[0][0]
    found = _KEYWORD.match(word) or _KEYWORD.match(word.upper())
    if found is None:
        raise MeshError(f"it does not begin with OFF but with {word[:20]!r}")
    if found[4] or found[5]:
        raise MeshError("it has vertices in four or more dimensions; export it in three")
    if len(lines[0]) > 1 and lines[0][1].upper() == "BINARY":
        raise MeshError("it is a binary OFF; export it as text")
    glued = word[found.end() :]
    rest = [glued, *lines[0][1:]] if glued else lines[0][1:]
    if rest:
        lines[0] = rest
    return bool(found[2]), bool(found[3]), 0 if rest else 1


def _counts(lines: list[list[str]], head: int) -> tuple[int, int]:
    words = [word for line in lines[head : head + 3] for word in line][:3]
    try:
        return int(words[0]), int(words[1])
    except (IndexError, ValueError):
        raise MeshError("the counts of vertices and faces after OFF are missing") from None


def _rows(words: list[str], count: int, face_count: int, width: int) -> list[list[str]]:
    """Vertices and faces as rows, where the file's lines do not part them."""
    rows = [words[width * n : width * (n + 1)] for n in range(count)]
    at = width * count
    for _ in range(face_count):
        if at >= len(words) or not words[at].isdecimal() or len(words[at]) > 7:
            break
        end = at + 1 + int(words[at])
        rows.append(words[at:end])
        at = end
    return rows


def _numbers(rows: list[list[str]], width: int) -> NDArray[np.float64]:
    for index, row in enumerate(rows):
        if len(row) < width:
            raise MeshError(f"vertex {index} has {len(row)} numbers, not {width}; it is damaged")
    try:
        return np.array([row[:width] for row in rows], dtype=np.float64)
    except ValueError as error:
        raise MeshError(f"a vertex is no number ({error!s:.80}); it is damaged") from None


def _colors(values: NDArray[np.float64]) -> NDArray[np.float32]:
    finite = values[np.isfinite(values)]
    return linear_from_srgb(values / (255.0 if finite.size and finite.max() > 1.0 else 1.0))


def _polygons(rows: list[list[str]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The vertices of all corners (C,), and how many corners each face has (P,)."""
    corners: list[int] = []
    sizes: list[int] = []
    for index, row in enumerate(rows):
        try:
            size = int(row[0])
            polygon = [int(word) for word in row[1 : 1 + size]]
        except ValueError:
            raise MeshError(f"face {index} is not made of whole numbers; it is damaged") from None
        if len(polygon) != size:
            raise MeshError(f"face {index} has fewer corners than it says; it is damaged")
        corners += polygon
        sizes.append(size)
    try:
        return np.array(corners, dtype=np.int64), np.array(sizes, dtype=np.int64)
    except OverflowError:
        raise MeshError("a face names a vertex that no file has; it is damaged") from None
