"""The ARAP benchmark runs, prints one line a size and gives figures that can be written as JSON."""

from __future__ import annotations

import json

import pytest

from runtime.benchmarks.arap import run


def test_figures_are_whole_and_json(capsys: pytest.CaptureFixture[str]):
    figures = json.loads(json.dumps(run((400, 900))))
    assert [row["vertices"] for row in figures["sizes"]] == pytest.approx([400, 900], rel=0.05)
    for row in figures["sizes"]:
        assert row["tick_ms"] > 0
        assert row["local_ms"] > 0
        assert row["solve_ms"] > 0
        assert row["megabytes"] > 0
    assert len(capsys.readouterr().out.splitlines()) == 4
