"""Takes never overwrite an earlier recording."""

from __future__ import annotations

from pathlib import Path

import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.player import EveryFrame, Player
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from runtime.cli import main
from runtime.show.takes import MOST, Takes, set_aside


def test_a_second_take_under_the_same_name_leaves_the_first(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    take, kept = tmp_path / "take.mcap", tmp_path / "take-1.mcap"
    record = ["record", "--device", "sim://show", "--seconds", "0.2", str(take)]
    assert main(record) == 0
    first = take.read_bytes()
    assert main(record) == 0
    assert kept.read_bytes() == first
    assert "take-1.mcap" in capfd.readouterr().err
    replay = ["replay", str(kept), "--character", "paper", "--headless", "--fast"]
    assert main([*replay, "--record", str(take)]) == 0
    assert (tmp_path / "take-2.mcap").is_file()
    for path in (take, kept, tmp_path / "take-2.mcap"):
        assert len(read_recording(path)) > 5


def test_nothing_is_set_aside_that_is_no_take(tmp_path: Path) -> None:
    told: list[str] = []
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "folder.mcap").mkdir()
    for name in ("absent.mcap", "empty.mcap", "folder.mcap"):
        set_aside(tmp_path / name, told.append)
    assert {path.name for path in tmp_path.iterdir()} == {"empty.mcap", "folder.mcap"}
    assert told == []


def test_a_take_takes_no_name_that_is_taken(tmp_path: Path) -> None:
    told: list[str] = []
    for name in ("take.mcap", "take-1.mcap"):
        (tmp_path / name).write_text(name)
    set_aside(tmp_path / "take.mcap", told.append)
    assert (tmp_path / "take-1.mcap").read_text() == "take-1.mcap"
    assert (tmp_path / "take-2.mcap").read_text() == "take.mcap"
    assert not (tmp_path / "take.mcap").exists()
    assert len(told) == 1


def test_where_all_names_are_taken_the_take_stays(tmp_path: Path) -> None:
    for number in range(1, MOST + 1):
        (tmp_path / f"take-{number}.mcap").touch()
    (tmp_path / "take.mcap").write_text("kept")
    with pytest.raises(InputError, match="move some away"):
        set_aside(tmp_path / "take.mcap", [].append)
    assert (tmp_path / "take.mcap").read_text() == "kept"


def test_a_flood_of_starts_makes_three_takes_in_three_seconds(tmp_path: Path) -> None:
    clip = builtin_recording("wave")
    now, told = [0.0], list[str]()
    takes = Takes(
        RecordedStream(Player(clip, EveryFrame())),
        tmp_path / "take.mcap",
        lambda path: Recorder(path, clip.skeleton, tell=told.append),
        tell=lambda line: None,
        warn=told.append,
        clock=lambda: now[0],
    )
    for press in range(2300):  # a hundred a second
        now[0] = press / 100
        takes.start()
        takes.stop()
    takes.close()
    assert len(list(tmp_path.iterdir())) == 24  # in 23 s
    assert 0 < len(told) < 24  # and not a line for each of 2300 presses
    assert set(told) == {"3 takes began within 3 s: no other one is started yet"}
