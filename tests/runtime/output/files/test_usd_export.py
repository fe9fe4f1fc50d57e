"""USD export: the animated character comes back from the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from runtime.characters.character import Character, Material
from runtime.output.files.usd_export import UsdExport, vertex_colors
from runtime.output.output import PerformedFrame
from tests.runtime.tentacle import disk_of, make_show, make_tentacle

pytest.importorskip("pxr")
from pxr import Usd, UsdGeom


def export(path: Path, character: Character, show: list[PerformedFrame]) -> None:
    with UsdExport(path, character, rate=30.0) as output:
        for frame in show:
            output.write(frame)


@pytest.mark.parametrize("name", ["a.usda", "a.usdc", "B.USDC"])
def test_the_surface_is_exact_in_every_frame(tmp_path: Path, name: str) -> None:
    character = make_tentacle()
    show = make_show(character, frames=6)
    show[3] = replace(show[3], time=0.11)  # a little late
    export(tmp_path / name, character, show)
    stage = Usd.Stage.Open(str(tmp_path / name))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Character/Surface"))
    assert UsdGeom.Mesh.ValidateTopology(
        mesh.GetFaceVertexIndicesAttr().Get(),
        mesh.GetFaceVertexCountsAttr().Get(),
        len(character.surface.vertex),
    )[0]
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    np.testing.assert_array_equal(indices, character.surface.faces)
    st = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get())
    np.testing.assert_allclose(st, character.surface.uvs * (1, -1) + (0, 1))  # v points up
    points = mesh.GetPointsAttr()
    seconds = np.array(points.GetTimeSamples()) / stage.GetTimeCodesPerSecond()
    np.testing.assert_allclose(seconds, [frame.time for frame in show], atol=1e-6)
    for time, frame in zip(points.GetTimeSamples(), show, strict=True):
        expected = frame.vertices[character.surface.vertex].astype(np.float32)
        np.testing.assert_array_equal(np.array(points.Get(time)), expected)
        extent = np.array(mesh.GetExtentAttr().Get(time))
        np.testing.assert_array_equal(extent, [expected.min(axis=0), expected.max(axis=0)])
    assert stage.GetEndTimeCode() == points.GetTimeSamples()[-1]


def test_colours_come_from_vertices_materials_and_textures() -> None:
    surface = make_tentacle().surface
    plain, textured = surface.materials
    red = surface.colors[:, 0]
    only_plain = replace(surface, materials=(plain, plain))
    np.testing.assert_allclose(vertex_colors(only_plain)[:, 0], 0.5 * red, atol=1e-6)
    blue_left = np.zeros((1, 2, 4), np.uint8)
    blue_left[0, 0] = (0, 0, 188, 255)
    material = Material(textured.color, blue_left)
    only_textured = replace(surface, materials=(material,), face_material=0 * surface.face_material)
    np.testing.assert_allclose(vertex_colors(only_textured)[:, 2], 0.503, atol=1e-3)


def test_a_show_without_frames_holds_the_rest_pose(tmp_path: Path) -> None:
    character = make_tentacle()
    export(tmp_path / "a.usda", character, [])
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    points = UsdGeom.Mesh(stage.GetPrimAtPath("/Character/Surface")).GetPointsAttr()
    assert points.GetTimeSamples() == []
    assert len(points.Get()) == len(character.surface.vertex)


@pytest.mark.parametrize("name", ["a.usda", "a.usdc"])
def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path: Path, name: str) -> None:
    character = make_tentacle()
    show = make_show(character, frames=30)
    with disk_of(20_000), pytest.raises(InputError, match="File too large") as caught:
        export(tmp_path / name, character, show)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_written_is_refused_before_the_show(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.usda, \.usdc"):
        UsdExport(tmp_path / "a.usdz", make_tentacle())
    with pytest.raises(InputError, match="there is no folder"):
        UsdExport(tmp_path / "missing" / "a.usda", make_tentacle())
