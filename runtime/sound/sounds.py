"""The sounds of a session by the names of their files, read at first use."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from devices.errors import InputError
from runtime.sound.mix import for_mixing
from runtime.sound.sound import Samples, read_sound


class Sounds:
    """Reads the sounds of a folder, each once.

    Args:
        folder: of the files.
        warn: takes one line about a file that cannot be read.
    """

    def __init__(self, folder: Path, warn: Callable[[str], None]) -> None:
        self._folder, self._warn = folder, warn
        self._read: dict[str, Samples | None] = {}

    def __call__(self, name: str) -> Samples | None:
        """Return the samples (S, 2) of a file, ready to be mixed; None where it cannot be read."""
        if name not in self._read:
            try:
                self._read[name] = for_mixing(read_sound(self._folder / name))
            except InputError as error:
                self._warn(str(error))
                self._read[name] = None
        return self._read[name]
