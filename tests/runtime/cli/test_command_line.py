"""The command line as a user meets it: a process, its exit code, its one line, its files."""

from __future__ import annotations

import json
import os
import signal
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.mcap.writer import McapWriter
from runtime.characters.builtin import builtin_character
from runtime.show.interrupts import interruptible, interrupts_deferred
from tests.waiting import PATIENCE

FRAMES = 12
CHARACTER = "mannequin"
BUNRAKU = [sys.executable, "-m", "runtime.cli"]
ROOT = Path(__file__).resolve().parents[3]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
SMALL = ["--headless", "--fast", "--size", "160x90"]
posix_only = pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A native recording of the first frames of the built-in performance."""
    path = tmp_path_factory.mktemp("recording") / "wave.mcap"
    played = builtin_recording("wave")
    with McapWriter(path, played.skeleton) as writer:
        for index in range(0, 5 * FRAMES, 5):
            writer.write(played.frame(index))
    return path


@pytest.fixture
def bunraku(tmp_path: Path) -> Run:
    """Runs the program in a folder of its own."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*BUNRAKU, *map(str, arguments)],
            cwd=tmp_path,
            env=ENVIRONMENT,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )

    return run


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder that this process is in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_help_tells_of_every_command(bunraku: Run) -> None:
    done = bunraku("--help")
    assert done.returncode == 0
    for command in ("demo", "replay", "live", "record", "devices", "info", "doctor", "bench"):
        assert command in done.stdout
        assert f"bunraku {command}" in bunraku(command, "--help").stdout


def test_replay_writes_everything_it_is_asked_for(
    bunraku: Run, recording: Path, tmp_path: Path
) -> None:
    done = bunraku(
        "replay", recording, "--character", CHARACTER, *SMALL,
        "--report", "r.json", "--cache", "c.pc2", "--video", "v.mp4", "--frames", "pictures",
        "--record", "again.mcap", "--export", "e.glb",
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    _check_report(json.loads((tmp_path / "r.json").read_text()))
    cache = _pc2(tmp_path / "c.pc2")
    assert cache.shape == (FRAMES, len(builtin_character(CHARACTER).surface.vertex), 3)
    assert np.isfinite(cache).all()
    assert np.ptp(cache, axis=0).max() > 0.2  # it waves
    assert len(_pictures(tmp_path / "v.mp4")) == FRAMES
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
    bunraku: Run, recording: Path, tmp_path: Path
) -> None:
    show = ["replay", recording, "--character", CHARACTER, *SMALL]
    assert bunraku(*show, "--cache", "a.pc2", "--report", "r.json").returncode == 0
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
        "replay", recording, "--character", CHARACTER, *SMALL, *options,
        "--cache", "c.pc2", "--report", "r.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    cache = _pc2(tmp_path / "c.pc2")
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
    """What the show looks like with no option."""
    path = tmp_path_factory.mktemp("plain") / "c.pc2"
    command = [*BUNRAKU, "replay", recording, "--character", CHARACTER, *SMALL, "--cache", path]
    subprocess.run(list(map(str, command)), env=ENVIRONMENT, check=True, timeout=PATIENCE)
    return _pc2(path)


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
    papers = [_pc2(tmp_path / f"c-paper{number}.pc2") for number in ("", "-2")]
    np.testing.assert_array_equal(papers[0], papers[1])
    assert _pc2(tmp_path / "c-cactus.pc2").shape == (FRAMES, 6, 3)
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


# -- Bad input ------------------------------------------------------------------------------------


def _refused(done: subprocess.CompletedProcess[str], *about: str) -> None:
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
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
def test_bad_recordings_are_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    path.write_bytes(BAD_FILES[name])
    _refused(_in_process(capsys, "replay", path, "--character", "paper", *SMALL), name)
    _refused(_in_process(capsys, "info", path), name)


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_meshes_are_refused(
    name: str, recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    path.write_bytes(BAD_MESHES[name])
    _refused(_in_process(capsys, "replay", recording, "--character", path, *SMALL), name)


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
    capsys: pytest.CaptureFixture[str],
    options: list[str],
    about: list[str],
) -> None:
    show = ["replay", recording, "--headless", "--fast", "--cache", "kept.pc2", *options]
    if "--character" not in options:
        show[2:2] = ["--character", "paper"]
    _refused(_in_process(capsys, *show), *about)
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
        (["bench", "patience"], ["patience", "arap"]),
        (["bench", "match", "--json", "nowhere/b.json"], ["nowhere"]),
    ],
    ids=lambda value: " ".join(value)[:40],
)
def test_bad_commands_are_refused(
    in_folder: Path, capsys: pytest.CaptureFixture[str], command: list[str], about: list[str]
) -> None:
    _refused(_in_process(capsys, *command), *about)
    assert list(in_folder.iterdir()) == []


def test_a_refusal_looks_so_from_outside(bunraku: Run, recording: Path) -> None:
    _refused(bunraku("replay", recording, "--character", "nobody"), "nobody")


def test_nothing_is_written_over_what_is_read(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = recording.read_bytes()
    link = tmp_path / "link.mcap"
    link.hardlink_to(recording)
    for out in (recording, link):
        done = _in_process(
            capsys, "replay", recording, "--character", "paper", *SMALL, "--record", out
        )
        _refused(done, "--record", "RECORDING")
    assert recording.read_bytes() == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("option", ["--cache", "--report", "--record"])
def test_a_full_disk_is_told_in_one_line(
    recording: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    done = _in_process(
        capsys, "replay", recording, "--character", "paper", *SMALL, option, "/dev/full"
    )
    _refused(done, "/dev/full")


def _in_process(
    capsys: pytest.CaptureFixture[str], *arguments: object
) -> subprocess.CompletedProcess[str]:
    """The same without a process of its own, which takes most of a second."""
    from runtime.cli import main

    capsys.readouterr()
    code = main(list(map(str, arguments)))
    out, err = capsys.readouterr()
    return subprocess.CompletedProcess([], code, out, err)


# -- Being asked to stop ---------------------------------------------------------------------------


@posix_only
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["Ctrl-C", "SIGTERM"]
)
def test_an_interrupted_show_leaves_whole_files(
    recording: Path, tmp_path: Path, number: signal.Signals, code: int
) -> None:
    show = [
        "replay", recording, "--character", CHARACTER, *SMALL, "--loop",
        "--cache", "c.pc2", "--report", "r.json", "--video", "v.mp4", "--record", "o.mcap",
        "--export", "e.glb", "--frames", "pictures",
    ]  # fmt: skip
    with _performing(show, tmp_path, tmp_path / "c.pc2") as process:
        process.send_signal(number)
        process.send_signal(number)  # nor does an impatient second one do any harm
        _, told = process.communicate(timeout=PATIENCE)
    assert (process.returncode, told) == (code, "")
    cache = _pc2(tmp_path / "c.pc2")
    report = json.loads((tmp_path / "r.json").read_text())
    assert len(cache) == report["frames"] == len(read_recording(tmp_path / "o.mcap"))
    assert len(_pictures(tmp_path / "v.mp4")) == report["frames"]
    assert len(list((tmp_path / "pictures").iterdir())) == report["frames"]
    assert np.isfinite(cache).all()
    glb = (tmp_path / "e.glb").read_bytes()
    assert struct.unpack("<4sII", glb[:12]) == (b"glTF", 2, len(glb))


@posix_only
def test_the_demo_and_a_live_show_perform_until_they_are_stopped(tmp_path: Path) -> None:
    live = ["live", "--device", "sim://wave", "--character", "paper", "--headless"]
    for show, first in ((["demo"], "squid"), (live, "")):
        cache = tmp_path / f"c{'-' if first else ''}{first}.pc2"
        options = ["--size", "160x90", "--headless", "--cache", "c.pc2", "--report", "r.json"]
        with _performing([*show, *options], tmp_path, cache) as process:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        frames = json.loads((tmp_path / "r.json").read_text())["frames"]
        assert len(_pc2(cache)) == frames > 0


@posix_only
def test_an_interrupted_record_is_whole(tmp_path: Path) -> None:
    out = tmp_path / "o.mcap"
    record = ["record", "--device", "sim://walk", out]
    with _performing(record, tmp_path, out, at_least=20_000) as process:
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert told == f"bunraku: {len(read_recording(out))} frames in {out}\n"


class _performing:  # noqa: N801  # reads as the `with` that it is
    """A process that is known to perform: its file `grows` beyond `at_least` bytes."""

    def __init__(self, arguments: list[Any], folder: Path, grows: Path, at_least: int = 32) -> None:
        self._grows, self._at_least = grows, at_least
        self.process = subprocess.Popen(
            [*BUNRAKU, *map(str, arguments)],
            cwd=folder,
            env=ENVIRONMENT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> subprocess.Popen[str]:
        while not self._grows.exists() or self._grows.stat().st_size <= self._at_least:
            try:
                code = self.process.wait(timeout=0.02)
            except subprocess.TimeoutExpired:
                continue
            _, told = self.process.communicate()
            pytest.fail(f"it ended by itself ({code}): {told}")
        return self.process

    def __exit__(self, *exc: object) -> None:
        self.process.kill()
        self.process.communicate()


@posix_only
def test_a_held_block_is_finished_first() -> None:
    done = []

    def work() -> None:
        with interruptible(), interrupts_deferred():
            with interrupts_deferred():
                signal.raise_signal(signal.SIGTERM)
                done.append("inner")
            done.append("outer")

    with pytest.raises(KeyboardInterrupt) as raised:
        work()
    assert done == ["inner", "outer"]
    assert raised.value.code == 143


@posix_only
def test_signals_are_handled_as_before_afterwards() -> None:
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with interruptible(), interrupts_deferred():
        pass
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


@posix_only
def test_a_reader_that_has_seen_enough_is_no_error(recording: Path, tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [*BUNRAKU, "info", recording],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=write,
        stderr=subprocess.PIPE,
        timeout=PATIENCE,
        check=False,
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (0, b"")


# -- What the files hold, read by other means than our own -----------------------------------------


def _pc2(path: Path) -> NDArray[np.float32]:
    """The samples (S, P, 3) of a point cache."""
    data = path.read_bytes()
    magic, version, points, start, rate, samples = struct.unpack_from("<12siiffi", data)
    assert (magic, version, start, rate) == (b"POINTCACHE2\0", 1, 0.0, 1.0)
    assert len(data) == 32 + samples * points * 12
    return np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)


def _pictures(path: Path) -> list[tuple[int, int]]:
    """Width and height of every picture of a video, decoded."""
    av = pytest.importorskip("av")

    def decoded() -> Iterator[tuple[int, int]]:
        with av.open(str(path)) as container:
            for picture in container.decode(video=0):
                yield picture.width, picture.height

    return list(decoded())
