"""AniMesh's figures on editing: what they claim holds, and the command draws them."""

from __future__ import annotations

from pathlib import Path

import pytest
from numpy.testing import assert_allclose
from PIL import Image
from scipy.spatial.transform import Rotation

from runtime.cli.command_line import main
from runtime.figures.editing import figure_6, figure_7, figure_13
from solvers.editing.part import Part
from solvers.editing.part_pose import pose_at

TIMES = (0.0, 0.4, 0.9, 1.0)


def turn(part: Part, node: int, time: float) -> float:
    """[degrees] of a node's bone about z."""
    rotation = Rotation.from_quat(pose_at(part, time).rotation(node))
    return float(rotation.as_rotvec(degrees=True)[2])


def test_figure_6_keeps_the_whole_turning_and_the_orientations_of_a_graft() -> None:
    a, b, _, d, _, f, _, h, i = figure_6()
    for time in TIMES:
        assert_allclose(turn(a.parts[0], 1, time), 90.0 * time, atol=1e-9)
        assert_allclose(turn(b.parts[0], 1, time), 90.0 * time, atol=1e-9)
        assert_allclose(turn(d.parts[0], 1, time), 90.0 * time, atol=1e-9)
    assert h.parts == i.parts
    assert len(h.parts[0]) == len(f.parts[0]) + len(f.parts[1]) - 1
    assert_allclose(turn(h.parts[0], h.parts[0].nodes[-1].id, 1.0), 90.0, atol=1e-9)


def test_figure_7_cuts_without_a_jump() -> None:
    before, cut, _ = figure_7()
    whole, off = before.parts[0], cut.parts[1]
    assert_allclose(turn(off, off.nodes[-1].id, 0.66), turn(whole, 2, 0.66), atol=1e-9)


def test_figure_13_keeps_what_the_paper_gives_up() -> None:
    whole, gone, again = (panel.parts[0] for panel in figure_13())
    tip = whole.nodes[-1].id
    for time in TIMES:
        assert_allclose(turn(gone, tip, time), turn(whole, tip, time), atol=1e-9)
        assert_allclose(pose_at(again, time).positions, pose_at(whole, time).positions, atol=1e-9)


def test_the_command_draws_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["figures", str(tmp_path), "--of", "editing", "--size", "240x60"]) == 0
    names = [Path(line).name for line in capsys.readouterr().out.splitlines()]
    assert names == ["figure-6.png", "figure-7.png", "figure-8.png", "figure-13.png"]
    for name in names:
        with Image.open(tmp_path / name) as picture:
            assert picture.size == (240, 180 if name == "figure-6.png" else 60)
            assert len(picture.convert("RGB").getcolors(100_000) or ()) > 20
