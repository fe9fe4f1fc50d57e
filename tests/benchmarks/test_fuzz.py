"""The fuzzer finds no fault in any reader or decoder, and finds planted ones."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from runtime.benchmarks.fuzzing.damage import MOST_BYTES, damaged
from runtime.benchmarks.fuzzing.watch import Watch
from tests.replay.kinect import test_readers as kinect
from tests.replay.kinect.test_tables import POSES
from tests.replay.kinect.test_tables import azure as azure_json
from tests.replay.markers.marked_bodies import c3d_bytes, marked, trc_text
from tests.replay.mediapipe.test_reader import POSE
from tests.replay.studio.studio_files import motive_bones, motive_table, mvnx_text, openpose_json
from tests.runtime.cli.program import BUNRAKU, ENVIRONMENT
from tests.thorough import THOROUGH

INPUTS = 20_000 if THOROUGH else 2_000


def other_recordings(folder: Path) -> Iterator[Path]:
    """Files of the formats that the program reads and does not write."""
    markers = {name: track[:3] for name, track in marked()[1].items()}
    made: dict[str, str | bytes] = {
        "a_s01_e01_skeleton3D.txt": kinect.msr(),
        "joints_s01_e01.txt": kinect.ut(),
        "laban.csv": kinect.laban(),
        "azure.csv": kinect.azure(),
        "ntu.skeleton": kinect.ntu(),
        "azure.json": azure_json(POSES),
        "pose.binarypb": POSE,
        "markers.c3d": c3d_bytes(markers),
        "integers.c3d": c3d_bytes(markers, scale=0.1, processor=86, analogue=2),
        "markers.trc": trc_text(markers),
        "motive.csv": motive_table({n: t[:3] for n, t in motive_bones().items()}, "Bone"),
        "suit.mvnx": mvnx_text(2),
        "people_keypoints.json": openpose_json((0.0, {}), (90.0, {})),
    }
    for name, content in made.items():
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        yield path


def test_no_door_lets_anything_through(tmp_path: Path) -> None:
    """A process of its own: it starts with no warning filter, and its memory is its own."""
    files = [word for path in other_recordings(tmp_path) for word in ("--recording", str(path))]
    command = [*BUNRAKU, "bench", "fuzz", "--inputs", str(INPUTS), "--seed", "1", *files]
    done = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert f"fuzz: {INPUTS} inputs of " in done.stdout


PLANTED: dict[str, tuple[Callable[[Path], object], str]] = {
    "exception": (lambda _: {}["a"], "KeyError at "),
    "warning": (lambda _: warnings.warn("odd", stacklevel=1), "warning: odd"),
    "division": (lambda _: np.ones(2) / np.zeros(2), "divide by zero"),
    "output": (lambda _: os.write(2, b"noise"), "wrote to the terminal"),
    "print": (lambda _: sys.stdout.write("noise"), "wrote to the terminal"),
    "file": (lambda folder: (folder / "a").write_text("a"), "for writing"),
    "removal": (lambda folder: (folder / "there").unlink(), "os.remove"),
    "process": (lambda _: subprocess.run(["true"], check=True), "subprocess.Popen"),
    "memory": (lambda _: len(b"a" * (1 << 30)), "MiB"),
    "two lines": (lambda _: _refuse("a\nb"), "several lines"),
    "none": (lambda _: _refuse("a"), ""),
}
PLANTS = r"""
import sys
from pathlib import Path
from runtime.benchmarks.fuzzing import watch as watching
from tests.benchmarks.test_fuzz import PLANTED
watching.MOST_KIB = 128 << 10
watch = watching.Watch()
folder = Path(sys.argv[1])
with watch.quiet():
    faults = {name: watch.fault(lambda: do(folder)) for name, (do, _) in PLANTED.items()}
for name, fault in faults.items():
    print(name, fault.replace("\n", " "), sep=": ")
"""


def _refuse(text: str) -> None:
    raise InputError(text)


@pytest.mark.skipif(sys.platform != "linux", reason="memory and processes as on Linux")
def test_the_watch_sees_what_no_reader_may_do(tmp_path: Path) -> None:
    (tmp_path / "there").touch()
    done = subprocess.run(
        [sys.executable, "-c", PLANTS, str(tmp_path)],
        env=ENVIRONMENT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    said = dict(line.split(": ", 1) for line in done.stdout.splitlines())
    assert done.stderr == ""
    for name, (_, fault) in PLANTED.items():
        assert (fault in said[name]) if fault else said[name] == ""


def test_an_input_that_hangs_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("runtime.benchmarks.fuzzing.watch.MOST_SECONDS", 0.05)
    watch = Watch()

    def hang() -> None:
        while True:
            pass

    with watch.quiet():
        fault = watch.fault(hang)
    assert fault == "took longer than 0.05 s"


def test_readers_write_in_their_scratch_folder_alone(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    watch = Watch(tmp_path / "own")
    with watch.quiet():
        own = watch.fault(lambda: _write(tmp_path / "own" / "new" / "a"))
        other = watch.fault(lambda: _write(tmp_path / "own" / ".." / "b" / "a"))
    assert own == ""
    assert "os.mkdir" in other
    assert "for writing" in other


def _write(path: Path) -> None:
    path.parent.mkdir()
    path.write_text("a", encoding="ascii")


def test_damage_depends_on_the_seed_alone() -> None:
    import random

    samples = [b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", bytes(range(100))]
    one, same = ([damaged(random.Random(k), samples) for k in range(300)] for _ in range(2))
    assert one == same
    assert len(set(one)) > 250
    assert max(map(len, one)) <= MOST_BYTES
