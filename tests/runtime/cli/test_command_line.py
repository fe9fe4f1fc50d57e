"""The command line as a user meets it: a process, its exit code, its one line, its files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from replay.builtin import builtin_recording
from replay.formats import read_recording
from runtime.characters.builtin import builtin_character
from runtime.cli import main
from tests.runtime.cli.program import (
    CHARACTER,
    FRAMES,
    SMALL,
    Run,
    pictures,
    point_cache,
)


def test_help_tells_of_every_command(bunraku: Run, program: Run) -> None:
    done = program("--help")
    assert done.returncode == 0
    for command in ("demo", "replay", "live", "record", "devices", "info", "doctor", "bench"):
        assert command in done.stdout
        assert f"bunraku {command}" in bunraku(command, "--help").stdout


def test_replay_writes_everything_it_is_asked_for(
    program: Run, recording: Path, tmp_path: Path
) -> None:
    done = program(
        "replay", recording, "--character", CHARACTER, *SMALL, "--drive", "relative",
        "--report", "r.json", "--cache", "c.pc2", "--video", "v.mp4", "--frames", "pictures",
        "--record", "again.mcap", "--export", "e.glb",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"{CHARACTER}: left leg -> left leg, relative, 100 %; ")
    told = ["e.glb", "c.pc2", "v.mp4", "pictures", "again.mcap", "r.json"]
    assert [line.split(":")[0] for line in done.stdout.splitlines()] == [CHARACTER, *told]
    _check_report(json.loads((tmp_path / "r.json").read_text()))
    cache = point_cache(tmp_path / "c.pc2")
    assert cache.shape == (FRAMES, len(builtin_character(CHARACTER).surface.vertex), 3)
    assert np.isfinite(cache).all()
    assert np.ptp(cache, axis=0).max() > 0.2  # it waves
    assert len(pictures(tmp_path / "v.mp4")) == FRAMES
    assert [path.name for path in sorted((tmp_path / "pictures").iterdir())] == [
        f"{number:06d}.png" for number in range(FRAMES)
    ]
    kept, original = read_recording(tmp_path / "again.mcap"), read_recording(recording)
    np.testing.assert_array_equal(kept.positions, original.positions)
    assert (tmp_path / "e.glb").read_bytes()[:4] == b"glTF"


def _check_report(report: dict[str, Any]) -> None:
    character = builtin_character(CHARACTER)
    assert report["frames"] == FRAMES
    assert report["dropped"] == 0
    assert report["recording"]["frames"] == FRAMES
    assert report["recording"]["seconds"] == pytest.approx(5 * (FRAMES - 1) / 60.0)
    assert report["character"] == {
        "vertices": len(character.vertices),
        "faces": len(character.faces),
        "nodes": len(character.skeleton.names),
    }
    joints = set(builtin_recording("wave").skeleton.names)
    assert report["recording"]["joints"] == len(joints)
    assert np.isfinite(report["match"]["score"])
    for pair in report["match"]["pairs"]:
        assert set(pair["source"]) <= joints
        assert set(pair["target"]) <= set(range(len(character.skeleton.names)))
    assert set(report["stages_ms"]) == {
        "poll", "match", "retarget", "deform", "render", "publish", "frame", "settle", "latency",
    }  # fmt: skip
    for stage in report["stages_ms"].values():
        assert 0.0 <= stage["p50"] <= stage["p99"] <= stage["max"]
    assert 0.0 < report["stretch"]["mean"] < report["stretch"]["p99"] < 0.5
    assert set(report) == {
        "frames", "dropped", "recording", "record", "character", "match", "stages_ms", "stretch",
        "watchdog",
    }  # fmt: skip


def test_equal_shows_write_equal_caches_and_the_match_can_be_given_back(
    bunraku: Run, program: Run, recording: Path, tmp_path: Path
) -> None:
    show = ["replay", recording, "--character", CHARACTER, *SMALL, "--drive", "relative"]
    assert program(*show, "--cache", "a.pc2", "--report", "r.json").returncode == 0
    assert bunraku(*show, "--cache", "b.pc2", "--video", "v.mkv").returncode == 0
    match = json.loads((tmp_path / "r.json").read_text())["match"]
    (tmp_path / "mapping.json").write_text(json.dumps(match))
    assert bunraku(*show, "--cache", "c.pc2", "--mapping", "mapping.json").returncode == 0
    first = (tmp_path / "a.pc2").read_bytes()
    assert (tmp_path / "b.pc2").read_bytes() == first
    assert (tmp_path / "c.pc2").read_bytes() == first


@pytest.mark.parametrize(
    "options",
    [["--match", "2"], ["--source", "arms"], ["--flip"]],
    ids=lambda options: options[0],
)
def test_what_is_asked_of_the_matching_changes_the_show(
    bunraku: Run, recording: Path, tmp_path: Path, plain: NDArray[np.float32], options: list[str]
) -> None:
    done = bunraku(
        "replay", recording, "--character", CHARACTER, *SMALL, "--drive", "relative", *options,
        "--cache", "c.pc2", "--report", "r.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    cache = point_cache(tmp_path / "c.pc2")
    assert np.isfinite(cache).all()
    assert np.abs(cache - plain).max() > 0.01
    if options == ["--source", "arms"]:
        match = json.loads((tmp_path / "r.json").read_text())["match"]
        assert not any("Leg" in name for pair in match["pairs"] for name in pair["source"])


def test_a_chain_leads_to_a_leaf_or_stops_at_the_sub_tree(
    bunraku: Run, recording: Path, tmp_path: Path
) -> None:
    lengths = []
    for chains in ("extend", "stop"):
        done = bunraku(
            "replay", recording, "--character", "cactus", *SMALL, "--source", "arms",
            "--chains", chains, "--report", "r.json",
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        match = json.loads((tmp_path / "r.json").read_text())["match"]
        lengths.append(sum(len(pair["target"]) for pair in match["pairs"]))
    assert lengths[1] < lengths[0]


@pytest.fixture(scope="module")
def plain(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> NDArray[np.float32]:
    """What the show looks like with no other option."""
    path = tmp_path_factory.mktemp("plain") / "c.pc2"
    drive = ["--drive", "relative"]
    command = ["replay", recording, "--character", CHARACTER, *SMALL, *drive, "--cache", path]
    assert main(list(map(str, command))) == 0
    return point_cache(path)


def test_several_characters_write_a_file_each(
    bunraku: Run, recording: Path, tmp_path: Path
) -> None:
    mesh = tmp_path / "cactus.obj"  # a file, called as a built-in character is
    mesh.write_text("v 0 0 0\nv 0 1 0\nv 0 2 0\nv .3 0 0\nv .3 1 0\nv .3 2 0\n"
                    "f 1 4 2\nf 4 5 2\nf 2 5 3\nf 5 6 3\n")  # fmt: skip
    done = bunraku(
        "replay", recording, *SMALL, "--cache", "c.pc2", "--export", "e.bvh", "--report", "r.json",
        "--frames", "pictures", "--transparent",
        "--character", "paper", "--character", mesh, "--character", "paper",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    papers = [point_cache(tmp_path / f"c-paper{number}.pc2") for number in ("", "-2")]
    np.testing.assert_array_equal(papers[0], papers[1])
    assert point_cache(tmp_path / "c-cactus.pc2").shape == (FRAMES, 6, 3)
    for name in ("paper", "cactus", "paper-2"):
        assert (tmp_path / f"e-{name}.bvh").read_text().startswith("HIERARCHY")
    report = json.loads((tmp_path / "r.json").read_text())
    assert [one["name"] for one in report["characters"]] == ["paper", "cactus", "paper"]
    picture = np.asarray(Image.open(tmp_path / "pictures" / "000000.png"))
    assert picture.shape == (90, 160, 4)
    assert picture[..., 3].min() == 0
    assert picture[..., 3].max() == 255


@pytest.mark.parametrize("suffix", ["usda", "bvh"])
def test_export_writes_what_the_suffix_says(
    bunraku: Run, recording: Path, tmp_path: Path, suffix: str
) -> None:
    if suffix == "usda":
        pytest.importorskip("pxr")
    out = tmp_path / f"e.{suffix}"
    done = bunraku("replay", recording, "--character", "paper", *SMALL, "--export", out)
    assert done.returncode == 0, done.stderr
    assert out.read_text().startswith({"usda": "#usda 1.0", "bvh": "HIERARCHY"}[suffix])
    if suffix == "bvh":
        assert len(read_recording(out)) == FRAMES


def test_a_device_is_recorded_told_about_and_replayed(bunraku: Run, tmp_path: Path) -> None:
    done = bunraku("record", "--device", "sim://walk", "walk.mcap", "--seconds", "0.5")
    assert (done.returncode, done.stdout) == (0, "")
    told = bunraku("info", "walk.mcap")
    assert told.returncode == 0
    assert "MCAP" in told.stdout
    frames = len(read_recording(tmp_path / "walk.mcap"))
    assert 25 <= frames <= 30
    assert f"frames      {frames} in" in told.stdout
    played = bunraku("replay", "walk.mcap", "--character", "paper", *SMALL, "--report", "r.json")
    assert played.returncode == 0, played.stderr
    assert json.loads((tmp_path / "r.json").read_text())["frames"] == frames


def test_characters_and_devices_are_told_about(bunraku: Run) -> None:
    told = bunraku("info", "squid")
    assert told.returncode == 0
    assert f"vertices    {len(builtin_character('squid').vertices)}" in told.stdout
    there = bunraku("devices")
    assert there.returncode == 0
    assert "sim://" in there.stdout
    assert "BVH" in there.stdout
    assert "squid" in there.stdout


def test_the_doctor_looks_at_everything(bunraku: Run) -> None:
    told = bunraku("doctor")
    assert told.returncode in (0, 1)
    assert ("WRONG" in told.stdout) == (told.returncode == 1)
    for thing in ("python", "headless GL", "cache", "video", "characters"):
        assert thing in told.stdout


def test_a_benchmark_writes_its_figures(bunraku: Run, tmp_path: Path) -> None:
    done = bunraku("bench", "match", "--json", "b.json")
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "b.json").read_text())["match"]
