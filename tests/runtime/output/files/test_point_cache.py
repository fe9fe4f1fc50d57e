"""Point caches (PC2): vertices come back, also from a file that was cut off."""

from __future__ import annotations

import signal
import struct
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.output.files.point_cache import PointCache
from tests.runtime.tentacle import disk_of, make_show, make_tentacle


def read_pc2(path: Path) -> tuple[tuple[object, ...], NDArray[np.float64]]:
    """Header fields and samples (T, M, 3), read value by value."""
    data = path.read_bytes()
    magic = struct.unpack_from("<12s", data)[0]
    version, points = struct.unpack_from("<2i", data, 12)
    start, rate = struct.unpack_from("<2f", data, 20)
    samples = struct.unpack_from("<i", data, 28)[0]
    assert len(data) == 32 + 12 * points * samples
    values = [value for (value,) in struct.iter_unpack("<f", data[32:])]
    return (magic, version, start, rate), np.array(values).reshape(samples, points, 3)


def test_the_cache_holds_every_frame_in_the_files_own_coordinates(tmp_path: Path) -> None:
    character = make_tentacle()
    show = make_show(character, frames=5)
    with PointCache(tmp_path / "a.pc2", character) as cache:
        for frame in show:
            cache.write(frame)
    header, samples = read_pc2(tmp_path / "a.pc2")
    assert header == (b"POINTCACHE2\0", 1, 0.0, 1.0)
    stage = samples @ character.file_to_stage[:3, :3].T + character.file_to_stage[:3, 3]
    expected = np.stack([frame.vertices[character.surface.vertex] for frame in show])
    np.testing.assert_allclose(stage, expected, atol=1e-6)


def test_equal_shows_give_equal_bytes(tmp_path: Path) -> None:
    character = make_tentacle()
    for name in ("a.pc2", "b.pc2"):
        with PointCache(tmp_path / name, character) as cache:
            for frame in make_show(character, frames=3):
                cache.write(frame)
    assert (tmp_path / "a.pc2").read_bytes() == (tmp_path / "b.pc2").read_bytes()


def test_a_show_without_frames_leaves_a_readable_file(tmp_path: Path) -> None:
    path = tmp_path / "a.pc2"
    path.write_bytes(b"something longer that was here before" * 100)
    PointCache(path, make_tentacle()).close()
    assert len(read_pc2(path)[1]) == 0


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_a_killed_show_leaves_all_its_frames(tmp_path: Path) -> None:
    path = tmp_path / "a.pc2"
    program = """
        import os, signal, sys
        from pathlib import Path
        from runtime.output.files.point_cache import PointCache
        from tests.runtime.tentacle import disk_of, make_show, make_tentacle
        character = make_tentacle()
        cache = PointCache(Path(sys.argv[1]), character)
        for frame in make_show(character, frames=7):
            cache.write(frame)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    command = [sys.executable, "-c", textwrap.dedent(program), str(path)]
    root = Path(__file__).resolve().parents[4]
    assert subprocess.run(command, cwd=root, check=False).returncode == -signal.SIGKILL
    assert len(read_pc2(path)[1]) == 7


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux's /dev/full")
def test_a_full_disk_is_one_line() -> None:
    with pytest.raises(InputError, match=r"cannot write /dev/full: No space left"):
        PointCache(Path("/dev/full"), make_tentacle())


def test_a_sample_that_did_not_fit_is_cut_off(tmp_path: Path) -> None:
    character = make_tentacle()
    show = make_show(character, frames=3)
    sample = 12 * len(character.surface.vertex)
    with disk_of(32 + 2 * sample + sample // 2):
        cache = PointCache(tmp_path / "a.pc2", character)
        cache.write(show[0])
        cache.write(show[1])
        with pytest.raises(InputError, match="File too large"):
            cache.write(show[2])
        cache.close()
    assert len(read_pc2(tmp_path / "a.pc2")[1]) == 2
