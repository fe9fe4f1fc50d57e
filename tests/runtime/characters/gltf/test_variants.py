"""glTF as exporters write it: default weights, odd joints, mirrored skins, coded URIs, odd JSON."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.characters.gltf.rig import GltfModel, read_gltf
from tests.runtime.characters.gltf.documents import (
    TRIANGLE,
    Document,
    glb,
    read,
    refusal,
    skinned_bar,
)

TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]


def volume(model: GltfModel) -> float:
    a, b, c = model.file_vertices[model.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def morphing(mesh_weights: list[float] | None, **node: Any) -> Document:
    """A triangle with two targets: one moves vertex 1 by +X, the other all by +Z."""
    scene = Document()
    first = np.zeros((3, 3))
    first[1, 0] = 1.0
    targets = [
        {"POSITION": scene.accessor(first)},
        {"POSITION": scene.accessor(np.tile([0.0, 0.0, 2.0], (3, 1)))},
    ]
    scene.node(mesh=scene.mesh(targets=targets), **node)
    if mesh_weights is not None:
        scene.document["meshes"][0]["weights"] = mesh_weights
    return scene


@pytest.mark.parametrize(
    ("mesh_weights", "node", "x", "z"),
    [
        ([0.5, 0.0], {}, 1.5, 0.0),
        ([0.5, 0.25], {}, 1.5, 0.5),
        ([0.5, 0.25], {"weights": [1.0, 0.0]}, 2.0, 0.0),
        (None, {"weights": [0.0, 1.0]}, 1.0, 2.0),
        (None, {}, 1.0, 0.0),
        ([1.0], {}, 2.0, 0.0),
    ],
)
def test_default_weights_shape_the_surface_at_rest(
    mesh_weights: list[float] | None, node: dict[str, Any], x: float, z: float, tmp_path: Path
) -> None:
    model = read(morphing(mesh_weights, **node), tmp_path)
    np.testing.assert_allclose(model.file_vertices[1], [x, 0, z], atol=1e-7)
    assert any("default weights" in note for note in model.notes) == ((x, z) != (1.0, 0.0))
    assert len(model.morphs) == 2


def test_default_weights_shape_a_skin_before_it_is_posed(tmp_path: Path) -> None:
    scene = skinned_bar(bend=True)
    primitive = scene.document["meshes"][0]["primitives"][0]
    primitive["targets"] = [{"POSITION": scene.accessor(np.tile([0.25, 0.0, 0.0], (6, 1)))}]
    scene.document["meshes"][0]["weights"] = [1.0]
    plain, moved = read(skinned_bar(bend=True), tmp_path), read(scene, tmp_path)
    np.testing.assert_allclose(
        moved.file_vertices[4] - plain.file_vertices[4], [0, 0.25, 0], atol=1e-6
    )


@pytest.mark.parametrize("weights", [["a"], [1e300], {}])
def test_damaged_default_weights_are_a_note(weights: Any, tmp_path: Path) -> None:
    scene = morphing(None)
    scene.document["meshes"][0]["weights"] = weights
    model = read(scene, tmp_path)
    np.testing.assert_allclose(model.file_vertices, TRIANGLE)
    assert any("left out" in note for note in model.notes)


def bar(width: int, dtype: str) -> Document:
    """`skinned_bar` with so many joints a vertex, of a type."""
    scene = skinned_bar()
    attributes = scene.document["meshes"][0]["primitives"][0]["attributes"]
    joints = np.zeros((6, 4))
    joints[:, 1] = 1
    weights = np.zeros((6, 4))
    weights[:, 0] = [1, 1, 0.5, 0.5, 0, 0]
    weights[:, 1] = 1.0 - weights[:, 0]
    shape = (6,) if width == 1 else (6, width)
    if width == 1:
        joints[:, 0], weights[:, 0] = [0, 0, 0, 0, 1, 1], 1.0
    attributes["JOINTS_0"] = scene.accessor(joints[:, :width].reshape(shape), dtype)
    attributes["WEIGHTS_0"] = scene.accessor(weights[:, :width].reshape(shape))
    return scene


@pytest.mark.parametrize(
    ("width", "dtype"), [(4, "float32"), (4, "int16"), (2, "uint8"), (3, "uint16"), (2, "float32")]
)
def test_joints_of_other_types_move_the_same(width: int, dtype: str, tmp_path: Path) -> None:
    plain, model = read(skinned_bar(), tmp_path), read(bar(width, dtype), tmp_path)
    assert model.weights is not None
    assert plain.weights is not None
    np.testing.assert_allclose(model.weights.toarray(), plain.weights.toarray())
    assert any("no unsigned" in note for note in model.notes) == (dtype in ("float32", "int16"))


def test_one_joint_a_vertex(tmp_path: Path) -> None:
    model = read(bar(1, "uint8"), tmp_path)
    assert model.weights is not None
    np.testing.assert_allclose(model.weights.toarray().max(axis=1), 1.0)


def test_joints_that_are_no_whole_numbers_are_refused(tmp_path: Path) -> None:
    scene = skinned_bar()
    attributes = scene.document["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = scene.accessor(np.full((6, 4), 0.5))
    assert "no unsigned integers" in refusal(scene, tmp_path)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -1, 1], [-1, -1, -1], [-1, -1, 1], [1, 1, 1]])
def test_a_mirrored_armature_keeps_its_skin_outside_out(scale: list[float], tmp_path: Path) -> None:
    scene = Document()
    mesh = scene.mesh(
        TETRAHEDRON,
        indices=scene.accessor(FACES, "uint16"),
        attributes={
            "JOINTS_0": scene.accessor(np.zeros((4, 4)), "uint8"),
            "WEIGHTS_0": scene.accessor(np.tile([1.0, 0, 0, 0], (4, 1))),
        },
    )
    scene.document["skins"] = [{"joints": [1, 2]}]
    scene.node(scale=scale, children=[1])
    scene.node(children=[2])
    scene.node(translation=[0, 1, 0])
    scene.node(mesh=mesh, skin=0)
    assert volume(read(scene, tmp_path)) == pytest.approx(1.0 / 6.0)


CODINGS: dict[str, Callable[[bytes], str]] = {
    "plain": lambda data: base64.b64encode(data).decode(),
    "percent-encoded": lambda data: (
        base64.b64encode(data).decode().replace("+", "%2B").replace("=", "%3D")
    ),
    "unpadded": lambda data: base64.b64encode(data).decode().rstrip("="),
    "wrapped": lambda data: base64.encodebytes(data).decode(),
    "wrapped, percent-encoded": lambda data: base64.encodebytes(data).decode().replace("\n", "%0A"),
    "of addresses": lambda data: base64.urlsafe_b64encode(data).decode(),
}


@pytest.mark.parametrize("head", ["data:application/octet-stream;base64", "data:;BASE64"])
@pytest.mark.parametrize("coding", CODINGS)
def test_data_uris(coding: str, head: str, tmp_path: Path) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh(np.array(TRIANGLE) * 0.7777 + 0.111))
    scene.document["buffers"] = [
        {"byteLength": len(scene.data), "uri": f"{head},{CODINGS[coding](scene.data)}"}
    ]
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(scene.document))
    np.testing.assert_allclose(
        read_gltf(path).file_vertices, np.array(TRIANGLE) * 0.7777 + 0.111, atol=1e-6
    )


def test_a_percent_encoded_data_uri_without_base64(tmp_path: Path) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh())
    coded = "".join(f"%{byte:02x}" for byte in scene.data)
    scene.document["buffers"] = [
        {"byteLength": len(scene.data), "uri": f"data:application/octet-stream,{coded}"}
    ]
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(scene.document))
    np.testing.assert_allclose(read_gltf(path).file_vertices, TRIANGLE)


@pytest.mark.parametrize("uri", ["parts\\a.bin", "parts%5Ca.bin", ".\\parts\\a.bin"])
def test_backslashes_part_folders(uri: str, tmp_path: Path) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh())
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.bin").write_bytes(scene.data)
    scene.document["buffers"] = [{"byteLength": len(scene.data), "uri": uri}]
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(scene.document))
    assert len(read_gltf(path).faces) == 1


def text_and_data() -> tuple[dict[str, Any], bytes]:
    scene = Document()
    scene.node(mesh=scene.mesh())
    scene.document["buffers"][0]["byteLength"] = len(scene.data)
    return scene.document, scene.data


def test_json_padded_with_zeros(tmp_path: Path) -> None:
    document, data = text_and_data()
    text = json.dumps(document).encode()
    path = tmp_path / "a.glb"
    path.write_bytes(glb(text + b"\0" * (4 + -len(text) % 4), data))
    assert len(read_gltf(path).faces) == 1


@pytest.mark.parametrize("bad", ["NaN", "nan", "-nan(ind)", "-Infinity", "inf", "1.#QNAN"])
def test_bounds_that_are_no_numbers(bad: str, tmp_path: Path) -> None:
    document, data = text_and_data()
    document["accessors"][0] |= {"min": ["@", 0, 0], "max": [1, 1, "@"]}
    text = json.dumps(document).replace('"@"', bad)
    path = tmp_path / "a.glb"
    path.write_bytes(glb(text.encode(), data))
    np.testing.assert_allclose(read_gltf(path).file_vertices, TRIANGLE)


def test_a_place_that_is_no_number_is_refused(tmp_path: Path) -> None:
    document, data = text_and_data()
    document["nodes"][0]["translation"] = [float("nan"), 0, 0]
    path = tmp_path / "a.glb"
    path.write_bytes(glb(json.dumps(document).encode(), data))
    with pytest.raises(InputError, match="sensible size"):
        read_gltf(path)


def outside(**top: Any) -> Document:
    scene = Document(**top)
    scene.node(name="camera")
    scene.node(mesh=scene.mesh(), translation=[0, 0, 3])
    return scene


def test_a_mesh_outside_the_default_scene_is_used(tmp_path: Path) -> None:
    model = read(outside(scenes=[{"nodes": [0]}], scene=0), tmp_path)
    np.testing.assert_allclose(model.file_vertices, np.add(TRIANGLE, [0, 0, 3]))
    assert any("default scene draws no mesh" in note for note in model.notes)


def test_a_mesh_of_another_scene_stays_out(tmp_path: Path) -> None:
    scene = outside(scenes=[{"nodes": [0]}, {"nodes": [1]}], scene=0)
    scene.document["nodes"][0]["mesh"] = scene.mesh()
    assert len(read(scene, tmp_path).faces) == 1


def test_a_mesh_of_no_node_is_used(tmp_path: Path) -> None:
    scene = Document()
    scene.mesh()
    model = read(scene, tmp_path)
    faces: NDArray[np.int64] = model.faces
    np.testing.assert_array_equal(faces, [[0, 1, 2]])
    assert any("no node draws a mesh" in note for note in model.notes)
