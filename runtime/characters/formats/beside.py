"""Finds a file that a mesh file names: in the same folder or below, in any spelling."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

_MOST_NAMES = 10_000  # of a folder that are looked through for another case


def beside(folder: Path, name: str) -> Path | None:
    """The file in `folder` or below that a name means, or None.

    Names have backslashes, another case than the file (Windows does not mind), or are paths on the
    machine that wrote them: then a file of the same name beside the mesh file counts.

    Raises:
        OSError, ValueError: the name is one that no file can have.
    """
    plain = PurePosixPath(name.strip().strip('"').replace("\\", "/"))
    for parts in (plain.parts, plain.parts[-1:]):
        if not parts or ".." in parts or (plain.is_absolute() and len(parts) > 1):
            continue
        path = folder.joinpath(*parts)
        if not path.is_file():
            path = _in_another_case(folder, parts) or path
        if path.is_file() and path.resolve().is_relative_to(folder.resolve()):
            return path
    return None


def _in_another_case(folder: Path, parts: tuple[str, ...]) -> Path | None:
    here = folder
    for part in parts:
        if not here.is_dir():
            return None
        names = (path for _, path in zip(range(_MOST_NAMES), here.iterdir(), strict=False))
        found = next((path for path in names if path.name.casefold() == part.casefold()), None)
        if found is None:
            return None
        here = found
    return here
