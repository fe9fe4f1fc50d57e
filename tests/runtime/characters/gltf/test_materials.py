"""Materials of glTF files: factors, textures, and pictures that cannot be read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.runtime.characters.gltf.documents import (
    png,
    read,
    textured,
)


def test_colour_factors_and_textures(tmp_path: Path) -> None:
    pixels = [[[255, 0, 0, 0], [0, 255, 0, 9]]]
    model = read(textured(png(pixels), alphaMode="BLEND"), tmp_path)
    np.testing.assert_allclose(model.materials[0].color, [0.5, 1.0, 0.25, 0.5])
    np.testing.assert_array_equal(model.materials[0].texture, pixels)
    np.testing.assert_array_equal(model.face_material, [0, 1])
    assert model.materials[1].texture is None
    assert model.uvs is not None
    np.testing.assert_allclose(model.uvs[:3], [[0, 0], [1, 0], [0, 0.5]])


def test_an_opaque_material_ignores_alpha(tmp_path: Path) -> None:
    model = read(textured(png([[[9, 9, 9, 0]]])), tmp_path)
    assert model.materials[0].color[3] == 1.0
    np.testing.assert_array_equal(model.materials[0].texture, [[[9, 9, 9, 255]]])


def test_a_texture_transform_moves_the_coordinates(tmp_path: Path) -> None:
    scene = textured(png([[[9, 9, 9, 0]]]))
    info = scene.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    turned = {"offset": [0.25, 0], "rotation": np.pi / 2, "scale": [2, 1]}
    info["extensions"] = {"KHR_texture_transform": turned}
    model = read(scene, tmp_path)
    assert model.uvs is not None
    # Counter-clockwise as seen, and v points down.
    np.testing.assert_allclose(model.uvs[:3], [[0.25, 0], [0.25, -2], [0.75, 0]], atol=1e-6)


@pytest.mark.parametrize(
    "uri", ["gone.png", "../gone.png", "http://example.org/a.png", "data:image/png;base64,AAAA"]
)
def test_a_missing_image_is_a_note(tmp_path: Path, uri: str) -> None:
    model = read(textured(uri), tmp_path)
    assert model.materials[0].texture is None
    assert len(model.notes) == 1
    assert "'skin'" in model.notes[0]


def test_an_image_beyond_the_budget_is_a_note(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("runtime.characters.gltf.material.MOST_PIXELS", 3)
    model = read(textured(png(np.zeros((2, 2, 4)))), tmp_path)
    assert "2 x 2 pixels" in model.notes[0]
