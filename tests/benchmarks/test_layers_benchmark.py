"""The benchmark of layers runs, prints its lines and gives figures for JSON."""

from __future__ import annotations

import json

import pytest

from runtime.benchmarks.layers import run


def test_figures_are_whole_and_json(capsys: pytest.CaptureFixture[str]) -> None:
    figures = json.loads(json.dumps(run(frames=30)))
    assert len(capsys.readouterr().out.splitlines()) == 5
    ticks = figures["tick_ms"]
    for times in (figures["alone_ms"], ticks["performed"], ticks["layers"]):
        assert 0.0 < times["p50"] <= times["p99"]
