"""Full disks are reported at once, the show goes on, and every file that is not whole is named."""

from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path

import pytest

from replay.mcap.reader import read_mcap
from tests.full_disk import files_of_at_most, posix_limits
from tests.runtime.cli.program import BUNRAKU, ENVIRONMENT, FRAMES, SMALL, Run, point_cache
from tests.waiting import PATIENCE

pytestmark = posix_limits


def test_files_that_do_not_fit_are_named_and_the_others_are_whole(
    recording: Path, tmp_path: Path, bunraku: Run
) -> None:
    with files_of_at_most(400_000):
        done = bunraku(
            "replay", recording, "--character", "mannequin", *SMALL,
            "--cache", "c.pc2", "--export", "e.glb", "--frames", "p", "--report", "r.json",
        )  # fmt: skip
    assert done.returncode == 2, done.stderr
    *warnings, error = done.stderr.splitlines()
    assert error == "bunraku: error: not kept whole: e.glb, c.pc2"
    assert len(warnings) == 2
    for line, name in zip(warnings, ("c.pc2", "e.glb"), strict=True):
        assert f"warning: cannot write {name}: File too large; free some space" in line
    held = len(point_cache(tmp_path / "c.pc2"))
    assert 0 < held < FRAMES
    size = sum(path.stat().st_size for path in (tmp_path / "p").iterdir())
    said = done.stdout.splitlines()
    assert f"c.pc2: stopped after {held} frames, " in said[-3]
    assert said[-4] == "e.glb: not written"
    assert said[-2] == f"p: {FRAMES} pictures, {size / 1e3:.1f} kB"
    assert said[-1].startswith("r.json: ")
    assert json.loads((tmp_path / "r.json").read_text())["frames"] == FRAMES
    assert not (tmp_path / "e.glb").exists()


def test_a_show_outlives_each_of_its_files(recording: Path, tmp_path: Path, bunraku: Run) -> None:
    pytest.importorskip("av")
    with files_of_at_most(9000):
        done = bunraku(
            "replay", recording, "--character", "paper", *SMALL,
            "--video", "v.mp4", "--frames", "p", "--record", "t.mcap",
        )  # fmt: skip
    assert done.returncode == 2
    *warnings, error = done.stderr.splitlines()
    assert error == "bunraku: error: not kept whole: v.mp4, p, t.mcap"
    assert len(warnings) == 3
    for name in ("v.mp4", "p/000000.png", "t.mcap"):
        assert any(f"warning: cannot write {name}: File too large" in line for line in warnings)
    held = len(read_mcap(tmp_path / "t.mcap"))
    assert 0 < held < FRAMES
    said = done.stdout.splitlines()[-3:]
    assert said[1] == "p: stopped after 0 pictures, 0 bytes kept"
    assert said[2].startswith(f"t.mcap: {held} frame")
    assert f" {FRAMES - held} lost, " in said[2]


def test_every_file_is_told_with_its_size_and_error(recording: Path, bunraku: Run) -> None:
    done = bunraku(
        "replay", recording, "--character", "mannequin", *SMALL,
        "--cache", "c.pc2", "--export", "e.glb", "--record", "t.mcap",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    glb, cache, take = done.stdout.splitlines()[-3:]
    deviation = json.loads(_json_of(Path("e.glb")))["meshes"][0]["extras"]
    rms = next(value for key, value in deviation.items() if "rms" in key.lower())
    assert glb.startswith(f"e.glb: {FRAMES} frames, {Path('e.glb').stat().st_size / 1e3:.1f} kB, ")
    assert float(glb.split("skinned ")[1].split(" mm")[0]) == pytest.approx(1e3 * rms, rel=0.1)
    assert cache == f"c.pc2: {FRAMES} frames, {Path('c.pc2').stat().st_size / 1e6:.1f} MB"
    assert take == f"t.mcap: {FRAMES} frames, {Path('t.mcap').stat().st_size / 1e3:.1f} kB"


def _json_of(glb: Path) -> bytes:
    data = glb.read_bytes()
    return data[20 : 20 + int.from_bytes(data[12:16], "little")]


def test_a_video_says_that_it_holds_no_transparency(recording: Path, bunraku: Run) -> None:
    pytest.importorskip("av")
    show = ["replay", recording, "--character", "paper", *SMALL, "--transparent"]
    told = bunraku(*show, "--video", "v.mp4").stderr
    assert told == (
        "bunraku: warning: v.mp4 is black where it is transparent: --frames keeps transparency\n"
    )
    assert bunraku(*show, "--frames", "p").stderr == ""


def test_an_endless_show_that_nobody_gets_anything_of_says_so(
    recording: Path, tmp_path: Path
) -> None:
    show = ["replay", str(recording), "--character", "paper", *SMALL, "--loop"]
    with subprocess.Popen(
        [*BUNRAKU, *show],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("paper: ")  # it performs
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
    assert "nobody sees it" in said
    assert process.returncode == 130
