"""Bad input of the command line: one line, nothing written."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.runtime.cli.program import (
    SMALL,
    Run,
)


def _refused(done: subprocess.CompletedProcess[str], *about: str) -> None:
    assert done.stdout == ""
    _told(done, *about)


def _told(done: subprocess.CompletedProcess[str], *about: str) -> None:
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("bunraku: error: ")
    assert done.stderr.endswith("\n")
    assert done.stderr.count("\n") == 1
    for word in about:
        assert word in done.stderr


BAD_FILES = {
    "empty.bvh": b"",
    "empty.mcap": b"",
    "noise.bin": bytes(range(256)) * 4,
    "noise.json.lz": bytes(range(256)) * 4,
    "cut.bvh": b"HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 3 Xrotation",
    "short.bvh": b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\nEnd Site\n{\n"
    b"OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 99999999999\nFrame Time: 1\n",
    "deep.bvh": b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n"
    + b"JOINT b\n{\nOFFSET 0 1 0\nCHANNELS 0\n" * 20_000,
    "deep.json": b"[" * 100_000,
    "latin.csv": "Zeit;Hüfte\n".encode("latin-1"),
}
BAD_MESHES = {
    "nan.obj": b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
    "huge.off": b"OFF\n999999999999 999999999999 0\n",
    "index.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "point.obj": b"v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n",
    "noise.ply": bytes(range(256)) * 4,
    "noise.stl": bytes(range(256)) * 4,
    "noise.glb": b"glTF" + bytes(range(256)) * 4,
    "list.gltf": b"[1, 2]",
    "what.fbx": b"Kaydara",
    "empty.obj": b"",
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_recordings_are_refused(name: str, tmp_path: Path, bunraku: Run) -> None:
    path = tmp_path / name
    path.write_bytes(BAD_FILES[name])
    _refused(bunraku("replay", path, "--character", "paper", *SMALL), name)
    _refused(bunraku("info", path), name)


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_meshes_are_refused(name: str, recording: Path, tmp_path: Path, bunraku: Run) -> None:
    path = tmp_path / name
    path.write_bytes(BAD_MESHES[name])
    _refused(bunraku("replay", recording, "--character", path, *SMALL), name)


@pytest.mark.parametrize(
    ("options", "about"),
    [
        (["--character", "nobody"], ["nobody", "squid"]),
        (["--character", "nowhere.obj"], ["nowhere.obj", "no such file"]),
        (["--source", "tail"], ["tail", "left-arm"]),
        (["--source", ""], ["--source", "empty"]),
        (["--size", "0x0"], ["--size"]),
        (["--size", "large"], ["--size", "large"]),
        (["--speed", "-1"], ["--speed"]),
        (["--speed", "nan"], ["--speed"]),
        (["--match", "0"], ["--match"]),
        (["--match", "999"], ["--match 999"]),
        (["--match", "2", "--map", "head -> head"], ["--match 2", "--map"]),
        (["--map", "head -> pig: snout"], ["pig", "there are: paper"]),
        (["--iterations", "many"], ["--iterations"]),
        (["--chains", "both"], ["--chains", "extend"]),
        (["--mapping", "nowhere.json"], ["nowhere.json"]),
        (["--cache", "nowhere/c.pc2"], ["nowhere", "folder"]),
        (["--cache", "."], ["folder"]),
        (["--report", "nowhere/r.json"], ["nowhere"]),
        (["--record", "nowhere/r.mcap"], ["nowhere"]),
        (["--video", "v.avi"], ["v.avi", ".mp4"]),
        (["--export", "e.fbx"], ["e.fbx", ".glb"]),
        (["--frames", "nowhere/pictures"], ["nowhere"]),
        (["--cache", "one", "--report", "one"], ["--cache", "--report", "one"]),
        (["--cache", "one", "--record", "./one"], ["--cache", "--record", "one"]),
        (["--cache"], ["--cache", "--help"]),
        (["--nonsense"], ["--nonsense"]),
    ],
    ids=" ".join,
)
def test_bad_options_are_refused_and_nothing_is_written(
    recording: Path,
    in_folder: Path,
    bunraku: Run,
    options: list[str],
    about: list[str],
) -> None:
    show = ["replay", recording, "--headless", "--fast", *options]
    if "--cache" not in options:
        show += ["--cache", "kept.pc2"]
    if "--character" not in options:
        show[2:2] = ["--character", "paper"]
    _refused(bunraku(*show), *about)
    assert list(in_folder.iterdir()) == []


@pytest.mark.parametrize(
    ("command", "about"),
    [
        ([], ["COMMAND"]),
        (["juggle"], ["juggle", "replay"]),
        (["replay"], ["RECORDING"]),
        (["replay", "nowhere.bvh", "--character", "paper"], ["nowhere.bvh"]),
        (["live", "--device", "carrier-pigeon://a", "--character", "paper"], ["sim://"]),
        (["live", "--device", "sim://sleep", "--character", "paper"], ["sleep", "walk"]),
        (["live", "--device", "sim://[", "--character", "paper"], ["sim://["]),
        (["record", "--device", "sim://walk", "nowhere/o.mcap"], ["nowhere"]),
        (["record", "--device", "sim://walk", "o.mcap", "--seconds", "0"], ["--seconds"]),
        (["info", "nowhere.mcap"], ["nowhere.mcap"]),
        (["info", "a" * 300 + ".obj"], ["aaa"]),
        (["figures", "o", "--of", "editing", "--character", "squid"], ["--character", "editing"]),
        (["bench", "patience"], ["patience", "arap"]),
        (["bench", "match", "--json", "nowhere/b.json"], ["nowhere"]),
    ],
    ids=lambda value: " ".join(value)[:40],
)
def test_bad_commands_are_refused(
    in_folder: Path, bunraku: Run, command: list[str], about: list[str]
) -> None:
    _refused(bunraku(*command), *about)
    assert list(in_folder.iterdir()) == []


def test_a_refusal_looks_so_from_outside(program: Run, recording: Path) -> None:
    _refused(program("replay", recording, "--character", "nobody"), "nobody")


def test_nothing_is_written_over_what_is_read(
    recording: Path, tmp_path: Path, bunraku: Run
) -> None:
    before = recording.read_bytes()
    link = tmp_path / "link.mcap"
    link.hardlink_to(recording)
    for out in (recording, link):
        done = bunraku("replay", recording, "--character", "paper", *SMALL, "--record", out)
        _refused(done, "--record", "RECORDING")
    assert recording.read_bytes() == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("option", ["--cache", "--record"])
def test_a_full_disk_is_told_in_one_line(recording: Path, bunraku: Run, option: str) -> None:
    done = bunraku("replay", recording, "--character", "paper", *SMALL, option, "/dev/full")
    _told(done, "/dev/full")
