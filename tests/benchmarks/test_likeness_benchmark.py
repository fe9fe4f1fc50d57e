"""The likeness benchmark shows a performance, measures it, and draws it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image

from devices.bodies.body_plan import SIDES
from devices.bodies.plan_by_names import plan_by_names
from devices.skeleton import Skeleton
from replay.builtin import builtin_recording
from runtime.benchmarks.likeness import figures_of, lines, run
from runtime.benchmarks.resemblance.body_track import off_body
from runtime.benchmarks.resemblance.contact_sheet import MOMENTS, SIZE, draw_performer
from runtime.benchmarks.resemblance.performance import perform
from runtime.characters.character import Character
from runtime.cli import main
from runtime.show.settings import MatchSettings, ShowSettings
from tests.benchmarks.moved_bodies import BODY
from tests.runtime.stick_figures import make_figure

CLIP = builtin_recording("wave")
OTHER = dict(zip(SIDES, reversed(SIDES), strict=True))


@pytest.fixture
def take(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    path = tmp_path / "take.mcap"
    assert main(["record", "--device", "sim://wave", "--seconds", "0.5", str(path)]) == 0
    capsys.readouterr()
    return path


@pytest.fixture(scope="module")
def figure() -> Character:
    body = make_figure()
    return replace(body, plan=plan_by_names(body.skeleton))


def test_a_line_for_each_limb_and_a_file_of_all_figures(
    take: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / "figures.json"
    options = ["--recording", str(take), "--character", "paper", "--character", "mannequin"]
    assert main(["bench", "likeness", *options, "--json", str(out)]) == 0
    pairs = json.loads(out.read_text(encoding="utf-8"))["likeness"]["pairs"]
    assert [(each["recording"], each["character"]) for each in pairs] == [
        ("take.mcap", "paper"),
        ("take.mcap", "mannequin"),
    ]
    printed = capsys.readouterr().out
    assert "take.mcap on paper, 30 frames" in printed
    for pair in pairs:
        surface = pair["surface"]
        assert 0.0 < surface["stretch_mean"] < surface["stretch_p99"]
        assert 0.0 < surface["jump"] < 0.1
        assert 0.0 < surface["tick_p50"] <= surface["tick_p99"]
        for name in pair.get("limbs", {}):
            assert name in printed


def test_the_limbs_of_an_absolute_body_point_as_the_performers(figure: Character):
    shown = perform(CLIP, figure, ShowSettings(match=MatchSettings(driver="absolute")))
    figures = figures_of(shown, None)
    for name in ("left upper arm", "right forearm", "left thigh", "right shin"):
        assert figures["limbs"][name]["error"] < 3.0, name
    assert figures["limbs"]["right forearm"]["kept"] == pytest.approx(1.0, abs=0.05)
    assert figures["limbs"]["right forearm"]["gain"] == pytest.approx(1.0, abs=0.05)
    assert figures["sides"]["arms"] == "right"
    assert figures["ground"]["hover"] == 0.0
    assert figures["tips"]["right arm"]["up"] > 0.95
    assert figures["tips"]["right arm"]["seen"] > 0.5
    assert all(0.8 < kept < 1.2 for kept in figures["ends_kept"].values())
    printed = "\n".join(lines({"recording": "wave", "character": "figure", **figures}))
    for word in (
        "right forearm",
        "volume",
        "sides",
        "travel",
        "slide",
        "squat",
        "yaw",
        "jitter",
        "tick",
    ):
        assert word in printed


def test_a_limb_that_follows_another_one_shows_as_an_error(figure: Character):
    plan = figure.plan
    assert plan is not None
    crossed = replace(
        figure, plan=replace(plan, arms={side: plan.arms[OTHER[side]] for side in SIDES})
    )
    shown = perform(CLIP, crossed, ShowSettings(match=MatchSettings(driver="absolute")))
    assert shown.character is not None
    # The driver took the arms for each other; the plan of the body as it is tells.
    honest = replace(shown, character=replace(shown.character, plan=plan))
    figures = figures_of(honest, None)
    assert figures["sides"]["arms"] in ("swapped", "mirrored")
    assert figures["limbs"]["right forearm"]["error"] > 20.0


def test_a_performer_without_a_body_leaves_the_figures_of_the_surface(figure: Character):
    shown = replace(perform(CLIP, figure), performer=None)
    figures = figures_of(shown, None)
    assert "limbs" not in figures
    assert figures["surface"]["stretch_p99"] > 0.0
    printed = "\n".join(lines({"recording": "wave", "character": "figure", **figures}))
    assert "no limbs to compare" in printed


def test_a_sheet_shows_the_performer_above_the_character(
    take: Path, tmp_path: Path, context: moderngl.Context
):
    run([take], ["mannequin"], sheets=tmp_path / "sheets")
    (path,) = (tmp_path / "sheets").iterdir()
    assert path.name == "take-on-mannequin.png"
    sheet = np.asarray(Image.open(path))
    width, height = SIZE
    assert sheet.shape[1] == MOMENTS * width
    for column in range(MOMENTS):
        across = slice(column * width, (column + 1) * width)
        character, stick = sheet[-height:, across], sheet[-2 * height : -height, across]
        assert len(np.unique(character.reshape(-1, 3), axis=0)) > 100
        assert len(np.unique(stick.reshape(-1, 3), axis=0)) > 3


def test_the_performers_left_is_red_and_on_the_right_of_the_picture():
    picture = np.asarray(draw_performer(BODY, BODY.rest_positions, 2.0)).astype(int)
    red = np.argwhere(picture[..., 0] - picture[..., 2] > 100)
    blue = np.argwhere(picture[..., 2] - picture[..., 0] > 100)
    assert red[:, 1].min() > blue[:, 1].max()


def test_a_root_on_the_floor_is_no_part_of_the_body():
    names, parents = ("root", *BODY.names), [-1, *(BODY.parents + 1)]
    places = np.concatenate([[[5.0, 0.0, 0.0]], BODY.rest_positions])
    assert off_body(Skeleton(names, np.array(parents), places)) == [0]
    assert off_body(BODY) == []


def test_joints_that_were_not_seen_are_not_drawn():
    nothing = np.full_like(BODY.rest_positions, np.nan)
    picture = np.asarray(draw_performer(BODY, nothing, 1.0))
    assert (picture == picture[0, 0]).all()


def test_what_is_for_likeness_is_refused_elsewhere(capsys: pytest.CaptureFixture[str]):
    assert main(["bench", "clips", "--sheets", "there"]) == 2
    assert "--sheets is for `bunraku bench likeness`" in capsys.readouterr().err
    assert main(["bench", "tick", "--character", "squid"]) == 2
    there = "`bunraku bench clips` and `bunraku bench likeness`"
    assert f"--character is for {there}" in capsys.readouterr().err
