"""Meshes of glTF files: nodes, primitives and accessors."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from tests.runtime.characters.gltf.documents import (
    QUARTER_TURN,
    TRIANGLE,
    Document,
    read,
)


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".vrm"])
def test_nodes_place_meshes_in_the_scene(tmp_path: Path, suffix: str) -> None:
    scene = Document()
    moved = np.eye(4)
    moved[:3, 3] = [0, 0, 5]
    scene.node(matrix=moved.T.ravel().tolist(), children=[1])
    scene.node(translation=[1, 0, 0], rotation=QUARTER_TURN, scale=[2, 3, 1], mesh=scene.mesh())
    model = read(scene, tmp_path, suffix)
    np.testing.assert_allclose(model.file_vertices, [[1, 0, 5], [1, 2, 5], [-2, 0, 5]], atol=1e-7)
    np.testing.assert_array_equal(model.faces, [[0, 1, 2]])
    assert model.skeleton is None
    assert model.weights is None


def test_primitives_follow_each_other_in_scene_order(tmp_path: Path) -> None:
    scene = Document(scenes=[{"nodes": [2, 0]}])
    scene.node(mesh=scene.mesh(indices=scene.accessor([2, 1, 0], "uint16")))
    scene.node(mesh=0)  # not in the scene
    scene.node(mesh=0, translation=[7, 0, 0])
    model = read(scene, tmp_path)
    np.testing.assert_array_equal(model.file_vertices[:, 0], [7, 8, 7, 0, 1, 0])
    np.testing.assert_array_equal(model.faces, [[2, 1, 0], [5, 4, 3]])


def test_a_mirrored_node_keeps_its_outside_outside(tmp_path: Path) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh(), scale=[-1, 1, 1])
    model = read(scene, tmp_path)
    a, b, c = model.file_vertices[model.faces[0]]
    assert np.cross(b - a, c - a)[2] > 0.0


@pytest.mark.parametrize(
    ("mode", "faces"),
    [(4, [[0, 1, 2], [3, 4, 5]]), (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]),
     (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]])],
)  # fmt: skip
def test_triangles_strips_and_fans(tmp_path: Path, mode: int, faces: list[list[int]]) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh(np.arange(18.0).reshape(6, 3) ** 2, mode=mode))
    np.testing.assert_array_equal(read(scene, tmp_path).faces, faces)


def test_points_and_lines_are_left_out_with_a_note(tmp_path: Path) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh(mode=1))
    scene.node(mesh=scene.mesh(mode=0))
    scene.node(mesh=scene.mesh())
    model = read(scene, tmp_path)
    assert len(model.faces) == 1
    assert model.notes == ("2 groups of points, lines or nothing left out",)


def test_quantised_interleaved_and_sparse_accessors(tmp_path: Path) -> None:
    scene = Document()
    rows = np.zeros(3, dtype=[("p", "<i2", 3), ("pad", "<i2"), ("c", "u1", 4)])
    rows["p"] = np.array(TRIANGLE) * 32767
    rows["c"] = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 51, 255]]
    view = scene.view(rows.tobytes())
    scene.document["bufferViews"][view]["byteStride"] = 12
    common = {"bufferView": view, "count": 3, "normalized": True}
    where, what = scene.view(struct.pack("<H", 2)), scene.view(struct.pack("<3h", 0, -32768, 0))
    sparse = {
        "count": 1,
        "indices": {"bufferView": where, "componentType": 5123},
        "values": {"bufferView": what},
    }
    scene.document["accessors"] = [
        {**common, "componentType": 5122, "type": "VEC3", "sparse": sparse},
        {**common, "componentType": 5121, "type": "VEC4", "byteOffset": 8},
    ]
    scene.document["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}}]}]
    scene.node(mesh=0)
    model = read(scene, tmp_path)
    np.testing.assert_array_equal(model.file_vertices, [[0, 0, 0], [1, 0, 0], [0, -1, 0]])
    np.testing.assert_allclose(
        model.colors, [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 0.2, 1]], atol=1e-6
    )
