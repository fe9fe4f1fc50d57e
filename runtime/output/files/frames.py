"""The pictures of a performance as numbered PNG files."""

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

_FAST = 1  # zlib level: half as large as level 0 here, and four times as fast as the default


class Frames:
    """Writes ``000000.png``, ``000001.png``, ... into a folder, in the order the frames come.

    A picture keeps its alpha when any of it is transparent. Each file appears whole. Pictures
    numbered higher, left there by an earlier and longer show, are removed at the end, so that the
    folder holds one performance.

    Args:
        folder: made if it is not there; its parent must be.

    Raises:
        InputError: the folder cannot be made or written to.
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
        """Remove what an earlier, longer show left behind."""
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
    """The picture (H, W, 4), or its (H, W, 3) colours when none of it is transparent."""
    opaque = bool((picture[..., 3] == 255).all())
    return np.ascontiguousarray(picture[..., :3]) if opaque else picture
