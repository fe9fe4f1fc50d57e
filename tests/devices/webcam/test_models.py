"""Fetching the tracker's models: whole, checked, once, and one line when it fails."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import pytest

from devices.errors import InputError
from devices.webcam import models
from devices.webcam.models import HAND, POSE, WHEEL, fetched_models, models_in
from devices.webcam.task_file import task_file


def pip_that(does: str, folder: Path) -> tuple[str, ...]:
    """The command of a Python whose pip runs the code `does`; `into` is the folder to fetch to."""
    script = folder / "pip.py"
    code = (
        f"import sys, pathlib\ninto = pathlib.Path(sys.argv[sys.argv.index('--dest') + 1])\n{does}"
    )
    script.write_text(code, encoding="utf-8")
    return (sys.executable, str(script))


def test_models_that_are_there_are_not_fetched(tmp_path: Path) -> None:
    for name in (POSE, HAND):
        (tmp_path / name).write_bytes(task_file({"a.tflite": b"model", "b.tflite": b"other"}))
    found = fetched_models(tmp_path, pytest.fail, python=("no such program",))
    assert (found.pose, found.hand) == (tmp_path / POSE, tmp_path / HAND)


@pytest.mark.parametrize("damage", [lambda data: data[:-9], lambda data: data.replace(b"m", b"n")])
def test_a_damaged_file_is_none(tmp_path: Path, damage: object) -> None:
    whole = task_file({"a.tflite": b"model", "b.tflite": b"other"})
    (tmp_path / POSE).write_bytes(whole)
    assert models_in(tmp_path) is None
    (tmp_path / HAND).write_bytes(whole)
    assert models_in(tmp_path) is not None
    (tmp_path / HAND).write_bytes(damage(whole))  # type: ignore[operator]  # a function of bytes
    assert models_in(tmp_path) is None


def test_members_are_stored_and_always_the_same(tmp_path: Path) -> None:
    path = tmp_path / POSE
    path.write_bytes(task_file({"a.tflite": b"model"}))
    assert path.read_bytes() == task_file({"a.tflite": b"model"})
    with zipfile.ZipFile(path) as archive:
        assert [one.compress_type for one in archive.infolist()] == [zipfile.ZIP_STORED]


@pytest.mark.parametrize(
    ("pip", "says"),
    [
        ("print('WARNING: Retrying (NewConnectionError)'); sys.exit(1)", "no network; connect"),
        ("print('No module named pip'); sys.exit(1)", "python -m ensurepip"),
        (
            "print('x\\nERROR: No matching distribution\\n'); sys.exit(1)",
            "No matching distribution",
        ),
        ("print('fine')", "ended without a wheel"),
        (f"(into / {WHEEL!r}).write_bytes(b'another')", "gave another mediapipe"),
    ],
)
def test_what_cannot_be_fetched_is_one_line_and_leaves_nothing(
    tmp_path: Path, pip: str, says: str
) -> None:
    folder, lines = tmp_path / "webcam", list[str]()
    with pytest.raises(InputError, match=says) as failed:
        fetched_models(folder, lines.append, python=pip_that(pip, tmp_path))
    assert "\n" not in str(failed.value)
    assert len(lines) == 1
    assert "36 MB" in lines[0]
    assert list(folder.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be kept in"):
        fetched_models(tmp_path / "file" / "webcam", pytest.fail)


def test_nothing_but_the_one_wheel_is_taken() -> None:
    assert "--no-deps" in models._DOWNLOAD
    assert "--only-binary=:all:" in models._DOWNLOAD
    assert len(models.SHA256) == 64
