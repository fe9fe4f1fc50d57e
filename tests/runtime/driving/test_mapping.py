"""Mappings made by hand: read back as written, and every mistake told in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.driving.mapping import MAX_FILE, Drive, Mapping, mapping_as_json, read_mapping

SOURCE = Skeleton(
    ("chest", "shoulder", "elbow", "wrist"),
    np.array([-1, 0, 1, 2]),
    np.arange(12, dtype=float).reshape(4, 3),
)
TARGET = Skeleton(
    ("root", "left", "leaf", "right"),
    np.array([-1, 0, 1, 0]),
    np.arange(12, dtype=float).reshape(4, 3),
)
GOOD = {"source": ["shoulder", "elbow"], "target": [0, 1]}


def written(tmp_path: Path, content: object) -> Path:
    path = tmp_path / "hand.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_a_mapping_is_read_as_it_was_written(tmp_path: Path) -> None:
    drives = Drive((0, 1, 2), (0, 1)), Drive((1, 3), (2, 1, 0, 3), flip=True, delay=0.25)
    mapping = Mapping(drives, score=1.5)
    path = written(tmp_path, mapping_as_json(mapping, SOURCE))
    read = read_mapping(path, SOURCE, TARGET)
    assert read.drives == mapping.drives
    assert np.isnan(read.score)
    assert mapping_as_json(read, SOURCE)["score"] is None
    assert mapping_as_json(mapping, SOURCE)["score"] == 1.5


def test_nodes_may_be_named_and_joints_skipped(tmp_path: Path) -> None:
    pair = {"source": ["chest", "wrist"], "target": ["root", "left", 2], "note": "ignored"}
    read = read_mapping(written(tmp_path, {"pairs": [pair]}), SOURCE, TARGET)
    assert read.drives == (Drive((0, 3), (0, 1, 2)),)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{", "is not a mapping: expected"),
        ("\x00\x01", "is not a mapping: expected"),
        ("", "is not a mapping: expected"),
        ("[" * 100_000, "is not a mapping: expected"),
        ("[1]", "is not a mapping: expected"),
        ("null", "is not a mapping: expected"),
        ({"pair": []}, "KeyError: 'pairs'"),
        ({"pairs": []}, "maps nothing"),
        ({"pairs": {}}, "`pairs` is a list, got dict"),
        ({"pairs": "shoulder"}, "`pairs` is a list, got str"),
        ({"pairs": [7]}, "is not a mapping: expected"),
        ({"pairs": [GOOD | {"delay": "late"}]}, "`delay` is a number of seconds, got 'late'"),
        ({"pairs": [GOOD | {"delay": 9}]}, "`delay` is from 0 to 4 s, got 9"),
        ({"pairs": [GOOD | {"delay": -0.1}]}, "`delay` is from 0 to 4 s, got -0.1"),
        ({"pairs": [["shoulder", "elbow"]]}, "is not a mapping: expected"),
        ({"pairs": [{"source": ["shoulder", "elbow"]}]}, "KeyError: 'target'"),
        ({"pairs": [{**GOOD, "source": "shoulder"}]}, "`source` is a list, got str"),
        ({"pairs": [{**GOOD, "target": 3}]}, "`target` is a list, got int"),
        ({"pairs": [{**GOOD, "flip": "false"}]}, "`flip` is true or false, got 'false'"),
        ({"pairs": [{**GOOD, "source": ["shoulder", "paw"]}]}, "no joint is called 'paw'; known"),
        ({"pairs": [{**GOOD, "source": [1, 2]}]}, "no joint is called '1'"),
        ({"pairs": [{**GOOD, "target": ["root", "tail"]}]}, "no joint is called 'tail'; known"),
        ({"pairs": [{**GOOD, "target": [0, 4]}]}, "no target node 4; they go from 0 to 3"),
        ({"pairs": [{**GOOD, "target": [-1, 0]}]}, "no target node -1; they go from 0 to 3"),
        ({"pairs": [{**GOOD, "target": [0, 1.0]}]}, "a name or a number, got 1.0"),
        ({"pairs": [{**GOOD, "target": [0, True]}]}, "a name or a number, got True"),
        ({"pairs": [{**GOOD, "target": [0, None]}]}, "a name or a number, got None"),
        ({"pairs": [{**GOOD, "target": [1, 3]}]}, "target nodes left and right share no bone"),
        ({"pairs": [{**GOOD, "target": [0, 2]}]}, "target nodes root and leaf share no bone"),
        ({"pairs": [{**GOOD, "target": [0, 1, 0]}]}, "each target polyline needs two or more"),
        ({"pairs": [{**GOOD, "target": [0]}]}, "each target polyline needs two or more"),
        ({"pairs": [{**GOOD, "source": ["elbow", "elbow"]}]}, "each source polyline needs two"),
        ({"pairs": [{**GOOD, "source": []}]}, "each source polyline needs two or more"),
        ({"pairs": [GOOD, {**GOOD, "target": [0, 9]}]}, "no target node 9"),
        (" " * (MAX_FILE + 1), "is too large for a mapping"),
    ],
)
def test_every_mistake_is_told_in_one_line(tmp_path: Path, content: object, says: str) -> None:
    path = written(tmp_path, content)
    with pytest.raises(InputError) as told:
        read_mapping(path, SOURCE, TARGET)
    text = str(told.value)
    assert says in text
    assert text.startswith(str(path))
    assert "\n" not in text


def test_a_file_that_is_not_there_or_is_a_folder_is_told(tmp_path: Path) -> None:
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(InputError, match="cannot read the mapping") as told:
            read_mapping(path, SOURCE, TARGET)
        assert str(path) in str(told.value)


def test_an_endless_file_is_not_read_to_its_end() -> None:
    endless = Path("/dev/zero")
    if not endless.exists():
        pytest.skip("this system has no endless file")
    with pytest.raises(InputError, match="too large for a mapping"):
        read_mapping(endless, SOURCE, TARGET)
