"""The cache of extracted skeletons: named by content, safe against damage."""

from __future__ import annotations

import io
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

from runtime.characters.cache import cached_skeleton
from solvers.kernels.cache import cache_folder

VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
FACES = np.array([[0, 1, 2]])


class Counted:
    """An extraction that counts how often it had to run."""

    def __init__(self) -> None:
        self.runs = 0

    def __call__(self, vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.runs += 1
        return np.array([-1, 0]), vertices[:2].copy()


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    return tmp_path


def only_file(folder: Path) -> Path:
    (path,) = (path for path in folder.rglob("*") if path.is_file())
    return path


def test_the_second_time_comes_from_the_cache(home: Path) -> None:
    extract = Counted()
    first = cached_skeleton(VERTICES, FACES, extract, 1)
    second = cached_skeleton(VERTICES.copy(), FACES.copy(), extract, 1)
    assert extract.runs == 1
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)
        assert a.dtype == b.dtype
    assert only_file(home).suffix == ".npz"  # and no unfinished file beside it


@pytest.mark.parametrize(
    ("vertices", "faces", "version"),
    [
        (VERTICES + 1e-16 * (VERTICES == 0), FACES, 1),
        (VERTICES, FACES[:, [1, 2, 0]], 1),
        (VERTICES, FACES, 2),
    ],
)
def test_whatever_differs_is_computed(
    home: Path, vertices: np.ndarray, faces: np.ndarray, version: int
) -> None:
    extract = Counted()
    cached_skeleton(VERTICES, FACES, extract, 1)
    cached_skeleton(vertices, faces, extract, version)
    assert extract.runs == 2


def npz(**arrays: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


GOOD = {"parents": np.array([-1, 0]), "positions": np.zeros((2, 3))}


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"PK\x03\x04 nothing",
        npz(**GOOD)[:-60],
        npz(parents=GOOD["parents"]),
        npz(**GOOD | {"parents": np.array([-1, 2])}),
        npz(**GOOD | {"parents": np.array([0, 0])}),
        npz(**GOOD | {"positions": np.full((2, 3), np.nan)}),
        npz(**GOOD | {"positions": np.zeros((3, 3))}),
        npz(**GOOD | {"positions": np.array(["a", "b"])}),
        npz(**GOOD | {"parents": np.array(-1)}),
        npz(parents=np.zeros(0, dtype=int), positions=np.zeros((0, 3))),
        pickle.dumps([1]),
    ],
)
def test_a_damaged_file_is_computed_anew_and_mended(home: Path, content: bytes) -> None:
    extract = Counted()
    cached_skeleton(VERTICES, FACES, extract, 1)
    only_file(home).write_bytes(content)
    parents, _ = cached_skeleton(VERTICES, FACES, extract, 1)
    assert extract.runs == 2
    np.testing.assert_array_equal(parents, [-1, 0])
    cached_skeleton(VERTICES, FACES, extract, 1)
    assert extract.runs == 2


class Trap:
    """Runs code where it is unpickled."""

    sprung = False

    def __reduce__(self) -> tuple[object, ...]:
        return (setattr, (Trap, "sprung", True))


def test_nothing_in_the_cache_is_run(home: Path) -> None:
    extract = Counted()
    cached_skeleton(VERTICES, FACES, extract, 1)
    trap = np.array([Trap(), Trap()], dtype=object)
    only_file(home).write_bytes(npz(parents=trap, positions=GOOD["positions"]))
    cached_skeleton(VERTICES, FACES, extract, 1)
    assert not Trap.sprung
    assert extract.runs == 2


def test_a_folder_that_cannot_be_made_is_no_error(home: Path) -> None:
    (home / "bunraku").write_text("a file where the folder should be")
    (home / ".cache").mkdir(exist_ok=True)
    extract = Counted()
    for _ in range(2):
        cached_skeleton(VERTICES, FACES, extract, 1)
    assert extract.runs == 2


@pytest.mark.parametrize(
    ("platform", "where"),
    [("linux", "bunraku"), ("win32", "bunraku"), ("darwin", "Library/Caches/bunraku")],
)
def test_the_folder_follows_the_platform(
    home: Path, monkeypatch: pytest.MonkeyPatch, platform: str, where: str
) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    assert cache_folder() == home / where


def test_without_a_setting_it_lies_in_the_home_folder(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == home / ".cache" / "bunraku"
