"""Runs the program as a process, and reads its files with other libraries than ours."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

FRAMES = 12
CHARACTER = "mannequin"
BUNRAKU = [sys.executable, "-m", "runtime.cli"]
ROOT = Path(__file__).resolve().parents[3]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
SMALL = ["--headless", "--fast", "--size", "160x90"]
posix_only = pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")

Run = Callable[..., subprocess.CompletedProcess[str]]


def point_cache(path: Path) -> NDArray[np.float32]:
    """The samples (S, P, 3) of a point cache."""
    data = path.read_bytes()
    magic, version, points, start, rate, samples = struct.unpack_from("<12siiffi", data)
    assert (magic, version, start, rate) == (b"POINTCACHE2\0", 1, 0.0, 1.0)
    assert len(data) == 32 + samples * points * 12
    return np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)


def pictures(path: Path) -> list[tuple[int, int]]:
    """Width and height of every picture of a video, decoded."""
    av = pytest.importorskip("av")

    def decoded() -> Iterator[tuple[int, int]]:
        with av.open(str(path)) as container:
            for picture in container.decode(video=0):
                yield picture.width, picture.height

    return list(decoded())
