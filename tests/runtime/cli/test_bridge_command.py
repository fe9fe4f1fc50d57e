"""`bunraku bridge` and a show that publishes, as a user meets them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from devices.bridge.stream import BridgeStream
from devices.stream import open_stream
from runtime.cli import main
from tests.runtime.cli.loopback import (
    ANYWHERE,
    ROOT,
    posix_only,
    take,
)
from tests.waiting import PATIENCE


def bunraku(*arguments: object, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "runtime.cli", *map(str, arguments)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def endpoint_of(process: subprocess.Popen[str]) -> str:
    """The address that a bridge tells of on its first line."""
    assert process.stderr is not None
    line = process.stderr.readline()
    assert "zmq+tcp://" in line, line + process.stderr.read()
    return line.split()[-1]


@posix_only
def test_ctrl_c_ends_a_bridge_with_a_word_on_what_it_did(tmp_path: Path) -> None:
    process = bunraku("bridge", "--device", "sim://walk", "--bind", ANYWHERE, folder=tmp_path)
    try:
        with open_stream(f"{endpoint_of(process)}?mode=lossless") as stream:
            assert isinstance(stream, BridgeStream)
            frames = take(stream, lambda frames: len(frames) >= 30)
        # Each correction of the clock's offset shifts one step: most are as they were sent.
        steps = np.diff([one.time for one in frames])
        assert np.median(steps) == pytest.approx(1.0 / 60.0, abs=0.002)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130, said
    assert "frames received" in said.splitlines()[-1]
    assert "sent to subscribers" in said.splitlines()[-1]
    assert "Traceback" not in said


def test_a_show_publishes_its_performers_to_another(tmp_path: Path) -> None:
    show = bunraku(
        *("live", "--device", "sim://walk?performers=2", "--performers", "2", "--headless"),
        *("--character", "paper", "--character", "paper", "--publish", ANYWHERE),
        folder=tmp_path,
    )
    try:
        with open_stream(f"{endpoint_of(show)}?mode=lossless") as stream:
            assert isinstance(stream, BridgeStream)
            heard = take(stream, lambda frames: {one.performer for one in frames} >= {0, 1})
            assert "HandLeft" in stream.skeleton.names
    finally:
        show.kill()
        show.communicate()
    assert {one.performer for one in heard} == {0, 1}
    assert all(np.isfinite(one.positions).all() for one in heard)


def test_the_command_refuses_in_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for arguments, words in (
        (["bridge"], "--device URL"),
        (["bridge", "--device", "sim://walk", "--bind", "tcp://0.0.0.0:5570"], "--keys DIR"),
        (["demo", "--headless", "--publish", "tcp://0.0.0.0:5570"], "--publish-keys DIR"),
        (["bridge", "--make-keys", str(tmp_path / "file" / "keys")], "cannot write keys"),
    ):
        (tmp_path / "file").touch()
        assert main(arguments) == 2
        said = capsys.readouterr().err
        assert words in said
        assert said.count("\n") == 1
