"""What `bunraku info` says about a recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from devices.skeleton import Skeleton
from replay.info import MOST_GAPS, stamps_of, summary
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


def test_gaps_are_told_with_place_length_and_frames() -> None:
    times = np.delete(np.arange(100) / 10, [*range(20, 24), *range(60, 69)])
    lines = summary(recording(times.tolist(), [3] * len(times)), Path("a"), "x")
    assert line(lines, "gaps").endswith(
        "2, the longest 1.000 s; 1.500 s in all, about 13 frames missing"
    )
    where = [text.strip() for text in lines if "performer 3, about" in text]
    assert where == [
        "from 1.900 s for 0.500 s, performer 3, about 4 frames",
        "from 5.900 s for 1.000 s, performer 3, about 9 frames",
    ]


def test_only_the_longest_gaps_are_listed() -> None:
    times = np.cumsum([0.0] + [0.01, 0.01, 0.01, 0.1] * 20)
    times[-1] += 5.0
    lines = summary(recording(times.tolist(), [0] * len(times)), Path("a"), "x")
    assert "20, the longest 5.100 s" in line(lines, "gaps")
    assert sum(text.strip().startswith("from ") for text in lines) == MOST_GAPS
    assert any("for 5.100 s" in text for text in lines)


def test_repeated_and_late_stamps_are_counted() -> None:
    steady = recording([0.0, 0.1, 0.2, 0.3], [0] * 4, arrivals=0.01)
    assert stamps_of(steady) == (0, 0)
    assert line(summary(steady, Path("a"), "x"), "stamps").endswith("rising")
    mixed = recording([0.0, 0.1, 0.1, 0.2, 0.3, 0.4], [0] * 6, arrivals=0.01)
    mixed.arrivals[3] = 0.35  # after the one at 0.3
    assert stamps_of(mixed) == (1, 1)
    assert line(summary(mixed, Path("a"), "x"), "stamps").endswith(
        "1 repeated, 1 came after a later one"
    )


def test_each_of_several_performers_has_a_line() -> None:
    both = recording([0.0, 0.01, 0.1, 0.11, 0.2], [1, 2, 1, 2, 1])
    lines = summary(both, Path("a"), "x")
    told = [text.strip() for text in lines if text.strip().startswith("performer ")]
    assert [text.split(",")[0] for text in told] == [
        "performer 1: 3 frames",
        "performer 2: 2 frames",
    ]
    assert "0.010 to 0.110 s" in told[1]


def test_a_text_from_the_file_cannot_command_the_terminal() -> None:
    hostile = replace(
        recording([0.0, 0.1], [0, 0]), source={"origin": "\x1b]0;mine\x07" + "x" * 5000}
    )
    told = line(summary(hostile, Path("a"), "x"), "origin")
    assert told.isprintable()
    assert len(told) < 400
