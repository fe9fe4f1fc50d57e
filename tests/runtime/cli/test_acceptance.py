"""Real recordings on real characters through the command line: every frame, nothing torn."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.formats import read_recording
from replay.mcap.writer import McapWriter
from runtime.characters.character_file import SUFFIXES
from runtime.characters.open_character import load_character
from runtime.cli import main
from tests.thorough import combined, third_of

FRAMES = 40
SMALL_FILE = 60_000  # bytes; a skeleton of so small a mesh is extracted in a moment
RECORDINGS = (
    "bvh/bandai1_call_normal_001.bvh",
    "kinect/v1_msraction3d/a18_s01_e01_skeleton3D.txt",
    "leap/leapjs_playback/grab.json.lz",
)
CHARACTERS = ("squid", "mesh/cgal_dino.off", "rig/raylib_robot_RobotExpressive.glb")


def _perform(recording: Path, character: str, folder: Path) -> tuple[Any, NDArray[np.float32]]:
    """The report of a show and its point cache (S, P, 3), read by other means than our own."""
    show = ["replay", str(recording), "--character", character, "--headless", "--fast"]
    kept = ["--report", str(folder / "r.json"), "--cache", str(folder / "c.pc2")]
    assert main([*show, *kept]) == 0
    data = (folder / "c.pc2").read_bytes()
    points, samples = struct.unpack_from("<16xi8xi", data)
    cache = np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)
    return json.loads((folder / "r.json").read_text()), cache


@pytest.fixture(scope="module")
def recording(
    request: pytest.FixtureRequest, shared: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The first frames of a real recording."""
    path = tmp_path_factory.mktemp("recording") / "first.mcap"
    whole = read_recording(shared / request.param)
    with McapWriter(path, whole.skeleton) as writer:
        for index in range(min(FRAMES, len(whole))):
            writer.write(whole.frame(index))
    return path


@pytest.mark.parametrize(
    ("recording", "name"),
    combined(RECORDINGS, CHARACTERS),
    indirect=["recording"],
    ids=lambda name: Path(str(name)).stem,
)
def test_a_recording_drives_a_character_without_tearing_it(
    recording: Path, shared: Path, tmp_path: Path, name: str
) -> None:
    if name.endswith(".off"):
        pytest.importorskip("pygel3d", reason="needs the extra bunraku[characters]")
    character = str(shared / name) if "/" in name else name
    report, cache = _perform(recording, character, tmp_path)
    frames = len(read_recording(recording))
    assert report["frames"] == report["recording"]["frames"] == len(cache) == frames
    assert report["dropped"] == 0
    assert np.isfinite(cache).all()
    assert report["stretch"]["p99"] < 0.5
    size = np.ptp(cache[0], axis=0).max()
    moved = np.linalg.norm(np.ptp(cache, axis=0), axis=1)
    assert moved.max() > 0.1 * size  # something visibly follows
    assert np.ptp(cache, axis=(0, 1)).max() < 3.0 * size  # and nothing flies away
    again = tmp_path / "again"
    again.mkdir()
    _perform(recording, character, again)
    assert (again / "c.pc2").read_bytes() == (tmp_path / "c.pc2").read_bytes()


def _smallest_of_each_kind(folder: Path) -> Iterator[Path]:
    """The smallest file with each suffix in a folder and below, but for the damaged ones."""
    kinds: dict[tuple[Path, str], Path] = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "bad" not in path.parts:
            kind = (path.parent, path.suffix)
            if kind not in kinds or path.stat().st_size < kinds[kind].stat().st_size:
                kinds[kind] = path
    yield from kinds.values()


@pytest.mark.parametrize("sensor", ["bvh", "kinect", "leap", "mediapipe"])
def test_every_kind_of_recording_is_opened(shared: Path, sensor: str) -> None:
    opened = 0
    for path in _smallest_of_each_kind(shared / sensor):
        if path.name == "actionLabel.txt":  # a table of contents
            continue
        recording = read_recording(path)
        assert len(recording) > 0
        assert not np.isinf(recording.positions).any()
        opened += 1
    assert opened > 0


@pytest.mark.parametrize("folder", ["mesh", "rig"])
def test_every_kind_of_character_is_opened(shared: Path, folder: str) -> None:
    pytest.importorskip("pygel3d", reason="needs the extra bunraku[characters]")
    opened = 0
    for path in _smallest_of_each_kind(shared / folder):
        if path.suffix not in SUFFIXES or path.stat().st_size > SMALL_FILE:
            continue
        character = load_character(str(path))
        assert np.isfinite(character.vertices).all()
        assert np.isfinite(character.skeleton.rest_positions).all()
        opened += 1
    assert opened > 2


@pytest.mark.parametrize("folder", ["mesh/bad", "rig/bad"])
def test_damaged_files_perform_or_are_refused_in_one_line(
    shared: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], folder: str
) -> None:
    pytest.importorskip("pygel3d", reason="needs the extra bunraku[characters]")
    recording = shared / "kinect" / "v1_msraction3d" / "a18_s01_e01_skeleton3D.txt"
    files = sorted((shared / folder).iterdir())
    small = [path for path in files if path.stat().st_size <= SMALL_FILE]
    for number, path in enumerate(third_of(small)):
        cache, report = tmp_path / f"{number}.pc2", tmp_path / f"{number}.json"
        show = ["replay", str(recording), "--character", str(path), "--headless", "--fast"]
        code = main([*show, "--cache", str(cache), "--report", str(report)])
        told = capsys.readouterr().err
        if code == 0:
            assert np.isfinite(np.frombuffer(cache.read_bytes(), "<f4", offset=32)).all()
            told_of = json.loads(report.read_text())
            few = told_of["character"]["vertices"] < 100  # a box has no edge that could be spared
            assert told_of["stretch"]["p99"] < (1.0 if few else 0.5)
        else:
            assert (code, told.count("\n")) == (2, 1)
            assert told.startswith("bunraku: error: ")
            assert path.name in told
            assert not cache.exists()
