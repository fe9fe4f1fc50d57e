"""The progress bar of a show: what it prints, and where it stays silent."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from runtime.status.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_log_gets_a_line_at_every_tenth_of_a_long_work() -> None:
    log, now = io.StringIO(), [0.0]
    with Progress("replay", 200, stream=log, clock=lambda: now[0]) as progress:
        for _ in range(200):
            now[0] += 0.5
            progress.advance()
    assert log.getvalue().splitlines() == [f"replay: {tenth}0 %" for tenth in range(1, 11)]


def test_a_log_hears_nothing_of_a_short_work_or_one_without_end() -> None:
    log, now = io.StringIO(), [0.0]
    with Progress("replay", 200, stream=log, clock=lambda: now[0]) as progress:
        for _ in range(200):
            now[0] += 0.01
            progress.advance()
    with Progress("live", None, stream=log, clock=lambda: now[0]) as progress:
        for _ in range(200):
            now[0] += 10
            progress.advance()
    assert log.getvalue() == ""


@pytest.mark.parametrize("total", [30, None])
def test_a_terminal_gets_a_bar(total: int | None) -> None:
    terminal = Terminal()
    with Progress("replay", total, stream=terminal) as progress:
        for _ in range(30):
            progress.advance(said="3.1 ms")
    assert "replay" in terminal.getvalue()
    assert "30" in terminal.getvalue()
    assert "3.1 ms" in terminal.getvalue()
    assert terminal.getvalue().endswith("\n")
    progress.close()


def test_a_stream_that_closes_is_no_error() -> None:
    now = [0.0]
    for stream in (io.StringIO(), Terminal()):
        progress = Progress("replay", 10, stream=stream, clock=lambda: now[0])
        stream.close()
        now[0] += 100
        progress.advance(5)
        progress.close()
        Progress("replay", 10, stream=stream).close()


@pytest.mark.skipif(sys.platform == "win32", reason="needs a POSIX pipe")
def test_a_reader_that_goes_away_is_no_error() -> None:
    program = """
from runtime.status.progress import Progress
import itertools
clock = itertools.count(0, 100).__next__
with Progress("replay", 1000, clock=clock) as progress:
    for _ in range(1000):
        progress.advance()
print("done")
"""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).resolve().parents[3],
        stdout=subprocess.PIPE,
        stderr=writing,
        check=False,
    )
    os.close(writing)
    assert done.stdout == b"done\n"
