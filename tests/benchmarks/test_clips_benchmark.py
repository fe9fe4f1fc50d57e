"""The clips benchmark performs every clip with every character and tells the worst."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from runtime.benchmarks.clips import run
from runtime.cli import main


def test_a_line_a_clip_and_figures_for_every_character(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    take = tmp_path / "take.mcap"
    assert main(["record", "--device", "sim://wave", "--seconds", "0.3", str(take)]) == 0
    capsys.readouterr()
    figures = json.loads(json.dumps(run([take], ["mannequin", "paper"])))
    rows = figures["clips"]["take.mcap"]
    assert set(rows) == {"mannequin", "paper"}
    for row in rows.values():
        assert 0.0 < row["p50"] <= row["p99"] <= row["max"]
        assert 0.0 < row["stretch_p99"] < 0.4
        assert row["inverted_last"] == 0
    assert len(capsys.readouterr().out.splitlines()) == 3


def test_files_are_for_clips_only(capsys: pytest.CaptureFixture[str]):
    assert main(["bench", "tick", "--recording", "a.bvh"]) == 2
    assert "--recording is for `bunraku bench clips`" in capsys.readouterr().err
