"""Opening characters by file: every suffix, and what is refused."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
import pytest

from runtime.characters.character_file import read_character
from runtime.characters.gltf.rig import read_gltf
from runtime.characters.open_character import is_character, load_character

FOOT, TOP = [0.5, 3.0, 2.0], [0.5, 5.0, 2.0]
CORNERS = np.array(  # a seam at the second corner; the last two are one place, bound differently
    [[0, 3, 2], [1, 3, 2], [1, 3, 2], [0, 5, 2], [1, 5, 2], [1, 5, 2.5], [1, 5, 2.5]], dtype="<f4"
)
FACES = np.array([[0, 1, 3], [2, 4, 3], [4, 5, 3], [4, 6, 3]], dtype="<u2")
WEIGHTS = np.array([[1, 0], [1, 0], [1, 0], [0, 1], [0, 1], [1, 0], [0, 1]], dtype="<f4")


def skinned(path: Path, *, extensions: dict[str, object]) -> Path:
    """A strip of triangles on two joints, in the place where it stands."""
    joints = np.tile(np.array([0, 1, 0, 0], dtype="u1"), (len(CORNERS), 1))
    weights = np.pad(WEIGHTS, ((0, 0), (0, 2)))
    binds = np.tile(np.eye(4, dtype="<f4"), (2, 1, 1))
    binds[:, :3, 3] = -np.array([FOOT, TOP])
    blocks = [CORNERS, FACES, joints, weights, binds.transpose(0, 2, 1)]
    content, views = b"", []
    for block in blocks:
        views.append({"buffer": 0, "byteOffset": len(content), "byteLength": block.nbytes})
        content += block.tobytes().ljust(-(-block.nbytes // 4) * 4, b"\0")
    kinds = [(5126, "VEC3"), (5123, "SCALAR"), (5121, "VEC4"), (5126, "VEC4"), (5126, "MAT4")]
    counts = [len(CORNERS), FACES.size, len(CORNERS), len(CORNERS), 2]
    uri = "data:application/octet-stream;base64," + base64.b64encode(content).decode()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0, "skin": 0},
            {"name": "foot", "translation": FOOT, "children": [2]},
            {"name": "top", "translation": [0, 2, 0]},
        ],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 4}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}
                ]
            }
        ],
        "accessors": [
            {"bufferView": i, "componentType": component, "type": kind, "count": count}
            for i, ((component, kind), count) in enumerate(zip(kinds, counts, strict=True))
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(content), "uri": uri}],
        "extensions": extensions,
    }
    path.write_text(json.dumps(document))
    return path


def test_a_rig_comes_on_stage_with_its_skin(tmp_path: Path) -> None:
    character = read_character(skinned(tmp_path / "strip.gltf", extensions={}))
    assert character.name == "strip"
    assert character.skeleton.names == ("foot", "top")
    np.testing.assert_array_equal(character.surface.vertex, [0, 1, 1, 2, 3, 4, 4])
    np.testing.assert_allclose(character.in_file_coordinates(character.vertices), CORNERS)
    scale = 1.7 / 2.0  # as tall as the stage allows, standing on it, in its middle
    np.testing.assert_allclose(
        character.skeleton.rest_positions, [[0, 0, -0.25 * scale], [0, 1.7, -0.25 * scale]]
    )
    assert character.weights is not None
    np.testing.assert_allclose(
        character.weights.toarray(), [[1, 0], [1, 0], [0, 1], [0, 1], [0.5, 0.5]]
    )


def test_an_old_vrm_is_turned_to_the_front_and_a_new_one_left(tmp_path: Path) -> None:
    plain = read_character(skinned(tmp_path / "a.gltf", extensions={}))
    old = read_character(skinned(tmp_path / "b.gltf", extensions={"VRM": {}}))
    new = read_character(skinned(tmp_path / "c.gltf", extensions={"VRMC_vrm": {}}))
    np.testing.assert_allclose(old.vertices, plain.vertices * [-1, 1, -1], atol=1e-12)
    np.testing.assert_allclose(
        old.skeleton.rest_positions, plain.skeleton.rest_positions * [-1, 1, -1], atol=1e-12
    )
    np.testing.assert_array_equal(new.vertices, plain.vertices)


def test_a_mesh_file_is_found_by_the_name_of_its_file(tmp_path: Path) -> None:
    path = tmp_path / "Thing.OFF"
    path.write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n0 2 0\n1 2 0\n3 0 1 2\n3 1 3 2\n")
    assert is_character(str(path))
    character = load_character(str(path))
    assert character.name == "Thing"
    assert character.weights is None
    np.testing.assert_allclose(np.ptp(character.vertices, axis=0), [0.85, 1.7, 0.0])
    assert len(character.skeleton.names) >= 2


@pytest.mark.parametrize(
    "name", ["khronos_Fox.glb", "m2m_spider-animations.glb", "raylib_robot_RobotExpressive.glb"]
)
def test_real_rigs_keep_their_vertices_joints_and_weights(shared: Path, name: str) -> None:
    model = read_gltf(shared / "rig" / name)
    character = read_character(shared / "rig" / name)
    assert model.skeleton is not None
    assert character.weights is not None
    size = np.ptp(model.file_vertices, axis=0).max()
    back = character.in_file_coordinates(character.vertices)
    np.testing.assert_allclose(back, model.file_vertices, atol=1e-6 * size)
    assert len(character.vertices) < 0.9 * len(back)  # seams are welded
    np.testing.assert_allclose(character.weights.sum(axis=1), 1.0)
    matrix = character.file_to_stage
    joints = model.skeleton.rest_positions @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(character.skeleton.rest_positions, joints)
    surface = character.surface
    np.testing.assert_array_equal(surface.vertex[surface.faces], character.faces)


def test_real_meshes_come_on_stage_with_a_tree_inside_them(shared: Path) -> None:
    for name in ("mesh/cat_dt/cat_reference.obj", "mesh/octopus-low.mesh", "mesh/cgal_cactus.off"):
        character = read_character(shared / name)
        low, high = character.vertices.min(axis=0), character.vertices.max(axis=0)
        nodes = character.skeleton.rest_positions
        assert len(nodes) > 10
        assert ((nodes > low - 0.05) & (nodes < high + 0.05)).all()
        np.testing.assert_allclose(low[1], 0.0, atol=1e-9)
