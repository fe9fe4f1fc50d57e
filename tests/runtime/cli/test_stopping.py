"""Signals and closed pipes: whole files, the right exit code, no traceback."""

from __future__ import annotations

import json
import os
import signal
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replay.formats import read_recording
from runtime.show.interrupts import interruptible, interrupts_deferred
from tests.runtime.cli.program import (
    BUNRAKU,
    CHARACTER,
    ENVIRONMENT,
    SMALL,
    pictures,
    point_cache,
    posix_only,
)
from tests.waiting import PATIENCE


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
    cache = point_cache(tmp_path / "c.pc2")
    report = json.loads((tmp_path / "r.json").read_text())
    assert len(cache) == report["frames"] == len(read_recording(tmp_path / "o.mcap"))
    assert len(pictures(tmp_path / "v.mp4")) == report["frames"]
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
        assert len(point_cache(cache)) == frames > 0


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
