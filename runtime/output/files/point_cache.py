"""Output of the deformed vertices as a PC2 point cache."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO, Self

from devices.errors import InputError
from runtime.characters.character import Character
from runtime.output.files.whole_file import check_writable, writing
from runtime.output.output import PerformedFrame

_HEADER = struct.Struct("<12siiffi")
_SAMPLES = struct.Struct("<i")  # the header's last field
_MOST_SAMPLES = 2**31 - 1


class PointCache:
    """Writes every frame as one sample of a PC2 file, for use with the original mesh elsewhere.

    Points are the vertices of the character's file, in the file's order, units and axes, so the
    cache fits the mesh that Blender's Mesh Cache modifier or Houdini reads. The layout, little
    endian: ``POINTCACHE2\\0``, int32 version 1, int32 points, float32 start frame 0, float32
    sample rate 1, int32 samples; then float32 (samples, points, 3). The sample rate counts frames
    per sample: one sample per frame. The format has no clock, so the frame rate of the other
    program decides how fast it plays. The file holds only the points: equal shows give equal bytes.

    The sample count in the header is updated after each sample, so a killed program leaves a cache
    of all frames performed so far.

    Args:
        path: the file to write.
        character: the performed character.

    Raises:
        InputError: the file cannot be written.
    """

    pictures_a_second = 0.0

    def __init__(self, path: Path, character: Character) -> None:
        check_writable(path)
        self._path = path
        self._character = character
        self._samples = 0
        self._points = len(character.surface.vertex)
        with writing(path):
            self._file: BinaryIO | None = path.open("wb", buffering=0)
            try:
                header = _HEADER.pack(b"POINTCACHE2\0", 1, self._points, 0.0, 1.0, 0)
                self._put(self._file, 0, header)
            except OSError:
                self._file.close()
                raise

    def write(self, frame: PerformedFrame) -> None:
        """Append one sample.

        Raises:
            InputError: the disk fails, or the format cannot count more samples.
        """
        if self._file is None:
            raise ValueError("the point cache is closed")
        if self._samples == _MOST_SAMPLES:
            raise InputError(f"{self._path} is full: PC2 holds {_MOST_SAMPLES} samples at most")
        points = self._character.in_file_coordinates(frame.vertices).astype("<f4")  # (M, 3)
        with writing(self._path):
            self._put(self._file, self._end, points.tobytes())
            self._samples += 1
            count = _SAMPLES.pack(self._samples)
            self._put(self._file, _HEADER.size - _SAMPLES.size, count)

    def close(self) -> None:
        """Cut off an incomplete last sample, and close the file."""
        file, self._file = self._file, None
        if file is not None:
            with writing(self._path), file:
                if self._path.is_file():
                    file.truncate(self._end)

    @property
    def _end(self) -> int:
        """Offset of the next sample [bytes]."""
        return _HEADER.size + self._samples * self._points * 12

    @staticmethod
    def _put(file: BinaryIO, offset: int, data: bytes) -> None:
        file.seek(offset)
        rest = memoryview(data)
        while rest:  # an unbuffered write may be partial
            rest = rest[file.write(rest) :]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
