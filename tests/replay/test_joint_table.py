"""Our own table after a spreadsheet saved it: quoted, cut at commas, padded, with other signs."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.joint_table import write_joint_table
from replay.recording import Recording


@pytest.fixture(scope="module")
def walk() -> Recording:
    return builtin_recording("walk")


@pytest.fixture(scope="module")
def table(walk: Recording) -> str:
    file = io.StringIO()
    write_joint_table(file, walk)
    return "\n".join(file.getvalue().split("\n")[:12]) + "\n"


def saved(table: str, separator: str, *, decimal_comma: bool = False, padded: bool = True) -> str:
    """The table as a program writes it that has cut every line at its commas into cells."""
    rows = [line.split(",") for line in table.splitlines()]
    width = max(map(len, rows)) if padded else 0
    rows = [row + [""] * (width - len(row)) for row in rows]
    if decimal_comma:
        rows = [[_spelled(cell) for cell in row] for row in rows]
    out = io.StringIO()
    csv.writer(out, delimiter=separator, lineterminator="\r\n").writerows(rows)
    return out.getvalue()


def _spelled(cell: str) -> str:
    try:
        float(cell)
    except ValueError:
        return cell
    return cell.replace(".", ",")


def one_cell(table: str) -> str:
    """The table as a program writes it that took each line for one cell."""
    out = io.StringIO()
    csv.writer(out, delimiter=";", lineterminator="\r\n").writerows(
        [line] for line in table.splitlines()
    )
    return out.getvalue()


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("form", ["commas", "not padded", "semicolons", "tabs", "one cell"])
def test_what_a_spreadsheet_saves_is_read(
    form: str, encoding: str, table: str, walk: Recording, tmp_path: Path
) -> None:
    text = {
        "commas": lambda: saved(table, ","),
        "not padded": lambda: saved(table, ",", padded=False),
        "semicolons": lambda: saved(table, ";", decimal_comma=True),
        "tabs": lambda: saved(table, "\t"),
        "one cell": lambda: one_cell(table),
    }[form]()
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode(encoding))
    read = read_recording(path)
    assert read.skeleton.names == walk.skeleton.names
    assert read.skeleton.parents.tolist() == walk.skeleton.parents.tolist()
    np.testing.assert_allclose(read.positions, walk.positions[: len(read)])
    np.testing.assert_allclose(read.times, walk.times[: len(read)])
    assert len(read) == 10
    assert "spreadsheet" in read.notes[0]


def test_a_damaged_sheet_is_one_line(table: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for damaged in ('"# bunraku.skeleton x', saved(table, ",").replace("performer", "a", 1)[:2000]):
        path.write_text(damaged)
        with pytest.raises(InputError) as refused:
            read_recording(path)
        assert "\n" not in str(refused.value)
