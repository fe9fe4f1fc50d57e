"""The benchmark of trajectories runs, prints a line for each case and gives figures for JSON."""

from __future__ import annotations

import json

import pytest

from runtime.benchmarks.spacetime import PAPER, run


def test_figures_are_whole_and_json(capsys: pytest.CaptureFixture[str]) -> None:
    figures = json.loads(json.dumps(run(frames=50)))
    assert [row["examples"] for row in figures["rows"]] == list(PAPER)
    for row in figures["rows"]:
        assert min(row["s"], row["held_s"], row["general_s"]) > 0.0
    assert len(capsys.readouterr().out.splitlines()) == 2 + len(PAPER)
