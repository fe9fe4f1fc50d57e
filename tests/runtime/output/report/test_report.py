"""The report: its parts are whole and can be read as JSON."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.driving.driver import RELATIVE, DrivenPart
from runtime.output.report.report import Report
from tests.runtime.tentacle import NODES, make_show, make_tentacle

LEG = Skeleton(("Hip", "Knee"), np.array([-1, 0]), np.array([[0.0, 1, 0], [0, 0, 0]]))


def refuse(constant: str) -> NoReturn:
    raise AssertionError(f"{constant} is not JSON")


def test_the_report_has_the_keys_that_others_read(tmp_path: Path) -> None:
    character = make_tentacle()
    with Report(tmp_path / "r.json") as report:
        report.recorded(frames=np.int64(9), joints=25, seconds=np.float32(0.5))
        part = report.add_character(character)
        target = tuple(np.arange(3))
        knee = DrivenPart("left leg", "tentacle", (0, 1), target, RELATIVE, 0.5, flip=True)
        part.matched(np.float32(0.75), [knee], LEG)
        for frame in make_show(character, frames=7):
            part.write(frame)
            report.times.add("deform", 0.002)
        report.dropped += 2
    written = json.loads((tmp_path / "r.json").read_text(), parse_constant=refuse)
    stages = written.pop("stages_ms")
    assert list(stages) == [
        *("poll", "match", "retarget", "deform", "render", "publish", "frame", "settle", "latency")
    ]
    assert stages["deform"] == pytest.approx({"p50": 2.0, "p99": 2.0, "max": 2.0}, rel=0.005)
    assert stages["render"] == {"p50": 0.0, "p99": 0.0, "max": 0.0}
    stretch = written.pop("stretch")
    assert 0 < stretch["mean"] < stretch["p99"] < 0.2
    watchdog = written.pop("watchdog")
    assert 0 < watchdog["energy"]["p50"] <= watchdog["energy"]["max"] < 0.01
    assert 0 < watchdog["stretch"]["p99"] <= watchdog["stretch"]["max"] < 0.2
    assert watchdog["inverted"] == {"max": 0, "last": 0, "longest": 0, "frames": 0}
    assert written == {
        "frames": 7,
        "dropped": 2,
        "recording": {"frames": 9, "joints": 25, "seconds": 0.5},
        "record": None,
        "character": {
            "vertices": len(character.vertices),
            "faces": len(character.faces),
            "nodes": NODES,
        },
        "match": {
            "score": 0.75,
            "pairs": [
                {
                    "name": "left leg -> tentacle, relative, 50 %",
                    "source": ["Hip", "Knee"],
                    "target": [0, 1, 2],
                    "target_names": list(character.skeleton.names[:3]),
                    "drive": "relative",
                    "gain": 0.5,
                    "flip": True,
                    "delay": 0.0,
                }
            ],
        },
    }


def test_several_characters_are_listed_beside_the_first(tmp_path: Path) -> None:
    character = make_tentacle()
    with Report(tmp_path / "r.json") as report:
        first = report.add_character(character)
        second = report.add_character(replace(character, name="other"))
        second.matched(float("nan"), [], LEG)
        for frame in make_show(character, frames=3):
            first.write(frame)
            second.write(replace(frame, vertices=character.vertices))
    written = json.loads((tmp_path / "r.json").read_text())
    assert [entry["name"] for entry in written["characters"]] == ["tentacle", "other"]
    assert written["frames"] == 3
    assert written["stretch"] == written["characters"][0]["stretch"]
    unstretched = {"mean": pytest.approx(0.0, abs=1e-12), "p99": 0.0}
    assert written["characters"][1]["stretch"] == unstretched
    assert written["characters"][1]["match"] == {"score": None, "pairs": []}


def test_numbers_that_json_cannot_hold_become_null(tmp_path: Path) -> None:
    with Report(tmp_path / "r.json") as report:
        report.recorded(frames=1, joints=2, seconds=float("nan"))
        report.add_character(make_tentacle()).matched(float("-inf"), [], LEG)
    written = json.loads((tmp_path / "r.json").read_text(), parse_constant=refuse)
    assert written["recording"]["seconds"] is None
    assert written["match"]["score"] is None


def test_names_of_any_kind_can_be_written(tmp_path: Path) -> None:
    with Report(tmp_path / "r.json") as report:
        part = report.add_character(make_tentacle())
        names = ('"é\n', "\udc80")
        part.matched(1.0, [DrivenPart("", "", (0, 1), (0, 1), RELATIVE)], replace(LEG, names=names))
    pairs = json.loads((tmp_path / "r.json").read_bytes())["match"]["pairs"]
    assert pairs[0]["source"] == ['"é\n', "\udc80"]


def test_a_show_that_never_began_is_reported_too(tmp_path: Path) -> None:
    Report(tmp_path / "r.json").close()
    assert json.loads((tmp_path / "r.json").read_text())["frames"] == 0


def test_without_a_path_nothing_is_written_but_all_is_counted(tmp_path: Path) -> None:
    character = make_tentacle()
    with Report(None) as report:
        part = report.add_character(character)
        part.write(make_show(character, frames=1)[0])
    assert report.summary()["frames"] == 1
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_written_is_refused_before_the_show(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no folder"):
        Report(tmp_path / "missing" / "r.json")
