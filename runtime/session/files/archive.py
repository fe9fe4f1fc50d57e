"""The file of a session: a zip of open formats, which is read as far as it is intact.

The JSON stands first in the zip, so that it is there even where the file was cut short, and the
list of contents at its end was lost.
"""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from devices.errors import InputError
from replay.bounds import check_recordable
from runtime.output.files.whole_file import whole_file
from runtime.session.files.folder import DOCUMENT, FOLDERS, SOUNDS

SUFFIX = ".bunraku"
MOST_ENTRIES = 100_000
MOST_ENTRY = 1 << 30  # [bytes] of one file in the zip
MOST_RATIO, MOST_SMALL = 200, 64 << 20  # unpacked files are so many times as large, or so large
_CHUNK = 1 << 20
_UNPACKED = f".{DOCUMENT}"  # the JSON until all other files are there
_HEADER = struct.Struct("<4sHHHHHIIIHH")
_MAGIC = b"PK\x03\x04"
_STORED, _DEFLATED = 0, 8


def pack(folder: Path, files: list[str], path: Path) -> None:
    """Write a session's folder as one file, in one piece.

    Args:
        folder: that holds the files.
        files: their names in it; the JSON first.
        path: of the zip.

    Raises:
        InputError: the disk fails; an older file stays as it was.
    """
    with (
        whole_file(path) as partial,
        zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as packed,
    ):
        for name in files:
            # Silence would unpack to far more than its size, which is refused below.
            kind = zipfile.ZIP_STORED if name.startswith(f"{SOUNDS}/") else zipfile.ZIP_DEFLATED
            packed.write(folder / name, name, kind)


def unpack(path: Path, folder: Path) -> list[str]:
    """Put the files of a zip into a folder, the JSON last; return what is lost, a line each.

    Raises:
        InputError: it cannot be read, or is no zip at all.
    """
    check_recordable(path)
    lost: list[str] = []
    try:
        with path.open("rb") as file:
            budget = _Budget(path, max(MOST_SMALL, MOST_RATIO * file.seek(0, 2)))
            try:
                entries = _listed(file)
            except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
                entries = _found(file)
                lost.append(f"{path} was cut short: its list of contents is lost")
            for name, chunks in entries:
                if not _is_inside(name):
                    continue
                target = folder / (_UNPACKED if name == DOCUMENT else name)
                target.parent.mkdir(parents=True, exist_ok=True)
                if why := _copy(chunks, target, budget):
                    target.unlink(missing_ok=True)
                    lost.append(f"{name} is damaged: {why}")
        if (folder / _UNPACKED).is_file():
            (folder / _UNPACKED).replace(folder / DOCUMENT)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if not (folder / DOCUMENT).is_file():
        raise InputError(f"{path} is not a session of Bunraku, or nothing of it is whole")
    return lost


class _Budget:
    """How many bytes may still be unpacked of one zip."""

    def __init__(self, path: Path, left: int) -> None:
        self._path, self._left = path, left

    def spend(self, count: int) -> None:
        self._left -= count
        if self._left < 0:
            raise InputError(f"{self._path} unpacks to far more than its size: it is not read")


def _copy(chunks: Iterator[bytes], target: Path, budget: _Budget) -> str:
    """Write chunks to a file; why that failed, or empty."""
    size = 0
    try:
        with target.open("wb") as file:
            for chunk in chunks:
                size += len(chunk)
                budget.spend(len(chunk))
                if size > MOST_ENTRY:
                    return "it is larger than 1 GiB"
                file.write(chunk)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        return str(error) or type(error).__name__
    return ""


def _listed(file: BinaryIO) -> Iterator[tuple[str, Iterator[bytes]]]:
    """The names and contents in the zip's own list."""
    packed = zipfile.ZipFile(file)
    entries = packed.infolist()[:MOST_ENTRIES]

    def content(entry: zipfile.ZipInfo) -> Iterator[bytes]:
        with packed.open(entry) as opened:
            while chunk := opened.read(_CHUNK):
                yield chunk

    return ((entry.filename, content(entry)) for entry in entries)


def _found(file: BinaryIO) -> Iterator[tuple[str, Iterator[bytes]]]:
    """The names and contents that stand one after the other, without the list at the end."""
    at = 0
    for _ in range(MOST_ENTRIES):
        file.seek(at)
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size or head[:4] != _MAGIC:
            return
        _, _, flags, method, _, _, checksum, size, _, names, extra = _HEADER.unpack(head)
        name = file.read(names).decode("utf-8", "replace")
        start = at + _HEADER.size + names + extra
        if flags & 0b1001 or method not in (_STORED, _DEFLATED):
            return  # encrypted, or without its size
        yield name, _content(file, start, size, method, checksum)
        at = start + size


def _content(file: BinaryIO, start: int, size: int, method: int, checksum: int) -> Iterator[bytes]:
    """The chunks of one entry, checked.

    Raises:
        BadZipFile, zlib.error: it is cut short or damaged.
    """
    inflate = zlib.decompressobj(-15)
    file.seek(start)
    left, total = size, 0
    while left:
        data = file.read(min(left, _CHUNK))
        if not data:
            raise zipfile.BadZipFile("it is cut short")
        left -= len(data)
        while data:
            chunk = data if method == _STORED else inflate.decompress(data, _CHUNK)
            data = b"" if method == _STORED else inflate.unconsumed_tail
            total = zlib.crc32(chunk, total)
            yield chunk
    if total != checksum:
        raise zipfile.BadZipFile("its check sum is wrong")


def _is_inside(name: str) -> bool:
    """Whether a name belongs to a session and leads to no place outside of its folder."""
    if "\\" in name or ":" in name or not name.isprintable():
        return False
    parts = name.split("/")
    if parts == [DOCUMENT]:
        return True
    return len(parts) > 1 and parts[0] in FOLDERS and all(p not in ("", ".", "..") for p in parts)
