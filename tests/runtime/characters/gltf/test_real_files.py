"""glTF and VRM files of other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from runtime.characters.gltf.rig import read_gltf
from tests.runtime.characters.gltf.documents import (
    parent_names,
)
from tests.thorough import third_of

REAL = {
    "khronos_Fox.glb": (1728, 576, 22),
    "khronos_SimpleSkin.gltf": (10, 8, 0),
    "m2m_bird-animations.glb": (1797, 2166, 54),
    "m2m_model-human.glb": (7399, 13757, 0),
    "m2m_spider-animations.glb": (924, 1600, 55),
    "raylib_robot_RobotExpressive.glb": (7218, 3238, 40),
    "vrmc_expressions_isBinary_Overrides.vrm": (16, 8, 0),
}


def test_every_real_file_reads_whole(shared: Path) -> None:
    pytest.importorskip("manifold3d")
    files = [p for p in sorted((shared / "rig").iterdir()) if p.is_file()]
    assert files
    for path in third_of(files):
        model = read_gltf(path)
        assert np.isfinite(model.file_vertices).all()
        assert model.faces.min() >= 0
        assert model.faces.max() < len(model.file_vertices)
        assert len(model.face_material) == len(model.faces)
        joints = 0 if model.skeleton is None else len(model.skeleton.names)
        if path.name in REAL:
            assert (len(model.file_vertices), len(model.faces), joints) == REAL[path.name]
        if "_rig-" in path.name:
            assert joints > 20
            assert 3_000 <= len(model.file_vertices) <= 8_000
        if model.skeleton is not None:
            assert model.weights is not None
            assert model.weights.shape == (len(model.file_vertices), joints)
            np.testing.assert_allclose(model.weights.sum(axis=1), 1.0, atol=1e-6)
            size = np.ptp(model.file_vertices, axis=0).max()
            inside = model.skeleton.rest_positions
            assert (inside > model.file_vertices.min(axis=0) - 0.2 * size).all(), path.name
            assert (inside < model.file_vertices.max(axis=0) + 0.2 * size).all(), path.name


def test_bad_real_files_are_refused_in_one_line(shared: Path) -> None:
    for name, said in (
        ("BoxWithInfinites.glb", "vertex 0"),
        ("MissingBin_BoxTextured.gltf", "BoxTextured0.bin"),
    ):
        with pytest.raises(InputError, match=said) as caught:
            read_gltf(shared / "rig" / "bad" / name)
        assert "\n" not in str(caught.value)


def test_a_robots_feet_hang_on_its_legs_not_on_the_ik_root(shared: Path) -> None:
    parents = parent_names(read_gltf(shared / "rig" / "raylib_robot_RobotExpressive.glb").skeleton)
    assert parents["Foot.L"] == "LowerLeg.L"
    assert parents["Foot.R"] == "LowerLeg.R"
    assert not any(name.startswith("PoleTarget") for name in parents)
