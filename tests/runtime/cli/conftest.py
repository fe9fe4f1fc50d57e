"""Fixtures of the command line: a short recording, the program, a folder to be in."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from replay.builtin import builtin_recording
from replay.mcap.writer import McapWriter
from tests.runtime.cli.program import (
    BUNRAKU,
    ENVIRONMENT,
    FRAMES,
    Run,
)
from tests.waiting import PATIENCE


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A native recording of the first frames of the built-in performance."""
    path = tmp_path_factory.mktemp("recording") / "wave.mcap"
    played = builtin_recording("wave")
    with McapWriter(path, played.skeleton) as writer:
        for index in range(0, 5 * FRAMES, 5):
            writer.write(played.frame(index))
    return path


@pytest.fixture
def bunraku(in_folder: Path, capfd: pytest.CaptureFixture[str]) -> Run:
    """Runs commands of the program within this process, which saves its start, in `tmp_path`."""
    from runtime.cli import main

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        capfd.readouterr()
        try:
            code = main(list(map(str, arguments)))
        except SystemExit as ended:  # as --help ends
            code = int(ended.code or 0)
        out, err = capfd.readouterr()
        return subprocess.CompletedProcess(arguments, code, out, err)

    return run


@pytest.fixture
def program(tmp_path: Path) -> Run:
    """Runs the program as a process of its own, in `tmp_path`."""

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
