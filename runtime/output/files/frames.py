"""Output of numbered PNG files."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from devices.errors import InputError
from runtime.output.files.whole_file import check_writable, whole_file, writing
from runtime.output.output import PerformedFrame

_FAST = 1  # zlib level: half the size of level 0 here, four times as fast as the default


class Frames:
    """Writes ``000000.png``, ``000001.png``, ... into a folder, one per frame.

    A picture keeps its alpha when any pixel is transparent. Each file appears whole. At the end,
    pictures with higher numbers from an earlier, longer show are removed, so that the folder holds
    one performance.

    Args:
        folder: created if it does not exist; its parent must exist.

    Raises:
        InputError: the folder cannot be created or written to.
    """

    pictures_a_second = math.inf

    def __init__(self, folder: Path) -> None:
        if folder.exists() and not folder.is_dir():
            raise InputError(f"cannot write pictures into {folder}: it is not a folder")
        with writing(folder):
            folder.mkdir(exist_ok=True)
        check_writable(folder / "000000.png")
        self._folder = folder
        self._count = 0

    def write(self, frame: PerformedFrame) -> None:
        """Write the next picture.

        Raises:
            InputError: the disk fails.
        """
        if frame.picture is None:
            raise ValueError("Expected `picture` with every frame, got None")
        with whole_file(self._folder / f"{self._count:06d}.png") as path:
            Image.fromarray(_without_idle_alpha(frame.picture)).save(path, compress_level=_FAST)
        self._count += 1

    def close(self) -> None:
        """Remove the pictures of an earlier, longer show."""
        if self._count == 0:
            return
        with writing(self._folder):
            for path in self._folder.iterdir():
                number = re.fullmatch(r"(\d{6,})\.png", path.name)
                if number and int(number[1]) >= self._count:
                    path.unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _without_idle_alpha(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the picture (H, W, 4), or only its colours (H, W, 3) when it is opaque."""
    opaque = bool((picture[..., 3] == 255).all())
    return np.ascontiguousarray(picture[..., :3]) if opaque else picture
