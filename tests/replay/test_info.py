from __future__ import annotations

from pathlib import Path

import numpy as np

from devices.skeleton import Skeleton
from replay.info import summary
from replay.recording import Recording

PAIR = Skeleton(("hip", "knee"), np.array([-1, 0]), np.zeros((2, 3)))


def recording(times: list[float], performers: list[int], arrivals: float = np.nan) -> Recording:
    count = len(times)
    positions = np.zeros((count, 2, 3))
    positions[0, 1] = np.nan
    positions[-1, 0] = [2.0, 1.0, 0.5]
    return Recording(
        skeleton=PAIR,
        times=np.array(times),
        positions=positions,
        rotations=None,
        confidence=np.ones((count, 2)),
        performers=np.array(performers),
        arrivals=np.array(times) + arrivals,
        notes=("a note",),
    )


def line(lines: list[str], begin: str) -> str:
    return next(text for text in lines if text.startswith(begin))


def test_the_summary_tells_rate_gaps_missing_joints_and_notes() -> None:
    lines = summary(recording([0.0, 0.1, 0.2, 0.3, 1.0], [0] * 5), Path("a/b.csv"), "a table")
    assert lines[0] == "b.csv: a table"
    assert "5 in 1.000 s" in line(lines, "frames")
    assert "10.00 frames/s" in line(lines, "rate")
    assert "1, the longest 0.700 s" in line(lines, "gaps")
    assert "2, root hip: hip, knee" in line(lines, "joints")
    assert "10.0 % of joints; most often knee (20.0 %)" in line(lines, "missing")
    assert "2.00 x 1.00 x 0.50 m" in line(lines, "size")
    assert line(lines, "note").endswith("a note")
    assert not any(text.startswith("latency") for text in lines)


def test_rates_are_of_each_performer_alone() -> None:
    both = recording([0.0, 0.01, 0.1, 0.11, 0.2, 0.21], [1, 2] * 3)
    lines = summary(both, Path("a"), "x")
    assert "10.00 frames/s" in line(lines, "rate")
    assert line(lines, "gaps").endswith("none")
    assert line(lines, "performers").endswith("2")


def test_a_single_empty_frame_has_a_summary() -> None:
    one = recording([0.0], [0])
    one.positions[:] = np.nan
    lines = summary(one, Path("a"), "x")
    assert "unknown" in line(lines, "rate")
    assert "100.0 %" in line(lines, "missing")
    assert "nothing was seen" in line(lines, "size")


def test_latency_is_told_where_arrivals_are_known() -> None:
    lines = summary(recording([0.0, 0.1], [0, 0], arrivals=0.02), Path("a"), "x")
    assert "20.0 ms" in line(lines, "latency")
