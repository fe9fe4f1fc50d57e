"""The benchmark of dense characters runs, prints a line a size and gives figures for JSON."""

from __future__ import annotations

import json

import pytest

from runtime.benchmarks.dense import run


def test_figures_are_whole_and_json(capsys: pytest.CaptureFixture[str]):
    figures = json.loads(json.dumps(run((3_000,), frames=20)))
    (row,) = figures["sizes"]
    assert row["vertices"] == pytest.approx(3_000, rel=0.05)
    assert row["full_ms"] > 0
    assert row["proxy_ms"] > row["follow_ms"] > 0
    assert 0 < row["error"]["rms"] < 0.5
    assert row["settled"]["rms"] > 0
    assert len(capsys.readouterr().out.splitlines()) == 3
