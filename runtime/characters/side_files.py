"""The files of a character: its own file, and the files beside it that it names."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote

from replay.text_file import file_bytes, file_text
from runtime.characters.formats.beside import beside

MOST_BYTES = 512 << 20  # of a file that is looked through for names
_TEXTURES = ("map_", "bump", "disp", "decal", "norm", "refl")


def files_of(path: Path) -> dict[Path, str]:
    """Return a character's files, each with its place seen from the folder of the first.

    A file that cannot be found is left out, as when the character is read.

    Raises:
        InputError: the character's own file cannot be read.
    """
    named = {".obj": _of_obj, ".gltf": _of_gltf, ".ply": _of_ply}.get(path.suffix.lower())
    files = {path: path.name}
    for name in named(path) if named is not None else ():
        with suppress(OSError, ValueError):
            found = beside(path.parent, name)
            if found is not None:
                files[found] = found.relative_to(path.parent).as_posix()
    return files


def _of_obj(path: Path) -> Iterator[str]:
    """The material libraries, and the pictures that they name."""
    for line in file_text(path, MOST_BYTES).split("\n"):
        if not line.lower().startswith("mtllib"):
            continue
        for library in dict.fromkeys((line[6:].strip(), *line[6:].split())):
            yield library
            with suppress(OSError, ValueError):
                found = beside(path.parent, library)
                if found is not None:
                    yield from _of_mtl(file_text(found, MOST_BYTES))


def _of_mtl(text: str) -> Iterator[str]:
    for line in text.split("\n"):
        keyword, _, rest = line.strip().partition(" ")
        if keyword.lower().startswith(_TEXTURES):
            words = rest.split()
            yield from (" ".join(words[first:]) for first in range(len(words)))


def _of_gltf(path: Path) -> Iterator[str]:
    """The buffers and pictures that are no data URIs."""
    document = json.loads(file_bytes(path, MOST_BYTES))
    for kind in ("buffers", "images"):
        for each in document.get(kind, []):
            uri = each.get("uri", "") if isinstance(each, dict) else ""
            if isinstance(uri, str) and uri and uri[:5].lower() != "data:":
                yield unquote(uri)


def _of_ply(path: Path) -> Iterator[str]:
    """The picture that a comment of the header names."""
    head = file_bytes(path, MOST_BYTES)[:4096].decode("latin-1").splitlines()
    for line in head:
        if line.lower().startswith("comment texturefile"):
            yield line.split(None, 2)[-1]
