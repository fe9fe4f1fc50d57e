from __future__ import annotations

import base64
import copy
import io
import json
import struct
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.gltf.rig import GltfModel, read_gltf
from runtime.characters.rig_body import body_around

TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125}
KINDS = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
QUARTER_TURN = [0.0, 0.0, float(np.sqrt(0.5)), float(np.sqrt(0.5))]  # about Z


class Scene:
    """A glTF document under construction; `save` writes it as .gltf or .glb."""

    def __init__(self, **top: Any) -> None:
        self.data = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": 0}],
            "bufferViews": [],
            "accessors": [],
            "meshes": [],
            "nodes": [],
            **top,
        }

    def view(self, content: bytes) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)}
        )
        self.data += content
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: ArrayLike, dtype: str = "float32", **extra: Any) -> int:
        array = np.asarray(values, dtype=dtype)
        stored = array.transpose(0, 2, 1) if array.shape[1:] == (4, 4) else array
        self.document["accessors"].append(
            {
                "bufferView": self.view(stored.tobytes()),
                "componentType": COMPONENTS.get(dtype, 5126),
                "count": len(array),
                "type": KINDS[array.shape[1:]],
                **extra,
            }
        )
        return len(self.document["accessors"]) - 1

    def mesh(self, positions: ArrayLike = TRIANGLE, **primitive: Any) -> int:
        attributes = {"POSITION": self.accessor(positions), **primitive.pop("attributes", {})}
        self.document["meshes"].append({"primitives": [{"attributes": attributes, **primitive}]})
        return len(self.document["meshes"]) - 1

    def node(self, **fields: Any) -> int:
        self.document["nodes"].append(fields)
        return len(self.document["nodes"]) - 1

    def save(self, path: Path) -> Path:
        document = copy.deepcopy(self.document)
        document["buffers"][0]["byteLength"] = len(self.data)
        if path.suffix == ".gltf":
            coded = base64.b64encode(self.data).decode()
            document["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{coded}"
            path.write_text(json.dumps(document))
        else:
            path.write_bytes(glb(json.dumps(document).encode(), self.data))
        return path


def glb(text: bytes, data: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def skinned_bar(*, bend: bool = False, scale: float = 1.0) -> Scene:
    """A strip of 2 x 3 vertices along Y on two joints, at y = 0 and y = 1, and an end at y = 2."""
    scene = Scene()
    positions = np.array([[x, y, 0.0] for y in (0.0, 1.0, 2.0) for x in (0.0, 0.5)]) / scale
    joints = np.zeros((6, 4))
    joints[:, 1] = 1
    weights = np.zeros((6, 4))
    weights[:, 0] = [1, 1, 0.5, 0.5, 0, 0]
    weights[:, 1] = 1.0 - weights[:, 0]
    bind = np.tile(np.eye(4), (2, 1, 1))
    bind[1, 1, 3] = -1.0 / scale
    mesh = scene.mesh(
        positions,
        attributes={
            "JOINTS_0": scene.accessor(joints, "uint8"),
            "WEIGHTS_0": scene.accessor(weights),
        },
        mode=5,
    )
    scene.document["skins"] = [{"joints": [1, 2], "inverseBindMatrices": scene.accessor(bind)}]
    scene.node(name="Armature", scale=[scale] * 3, children=[1])
    scene.node(name="low", children=[2])
    turn = {"rotation": QUARTER_TURN} if bend else {}
    scene.node(name="high", translation=[0, 1 / scale, 0], children=[3], **turn)
    scene.node(name="high_end", translation=[0, 1 / scale, 0])
    scene.node(name="skin", mesh=mesh, skin=0)
    scene.document["skins"][0]["joints"].append(3)
    bind = np.concatenate([bind, bind[1:]])
    scene.document["skins"][0]["inverseBindMatrices"] = scene.accessor(bind)
    return scene


def read(scene: Scene, folder: Path, suffix: str = ".glb") -> GltfModel:
    return read_gltf(scene.save(folder / f"model{suffix}"))


def refusal(scene: Scene, folder: Path, suffix: str = ".glb") -> str:
    with pytest.raises(InputError) as caught:
        read(scene, folder, suffix)
    message = str(caught.value)
    assert message.startswith(str(folder / f"model{suffix}"))
    assert "\n" not in message
    return message


def parent_names(skeleton: Skeleton | None) -> dict[str, str]:
    assert skeleton is not None
    names = (*skeleton.names, "")
    return {name: names[parent] for name, parent in zip(names, skeleton.parents, strict=False)}


def place(skeleton: Skeleton | None, name: str) -> NDArray[np.float64]:
    assert skeleton is not None
    result: NDArray[np.float64] = skeleton.rest_positions[skeleton.index(name)]
    return result


# Geometry


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".vrm"])
def test_nodes_place_meshes_in_the_scene(tmp_path: Path, suffix: str) -> None:
    scene = Scene()
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
    scene = Scene(scenes=[{"nodes": [2, 0]}])
    scene.node(mesh=scene.mesh(indices=scene.accessor([2, 1, 0], "uint16")))
    scene.node(mesh=0)  # not in the scene
    scene.node(mesh=0, translation=[7, 0, 0])
    model = read(scene, tmp_path)
    np.testing.assert_array_equal(model.file_vertices[:, 0], [7, 8, 7, 0, 1, 0])
    np.testing.assert_array_equal(model.faces, [[2, 1, 0], [5, 4, 3]])


def test_a_mirrored_node_keeps_its_outside_outside(tmp_path: Path) -> None:
    scene = Scene()
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
    scene = Scene()
    scene.node(mesh=scene.mesh(np.arange(18.0).reshape(6, 3) ** 2, mode=mode))
    np.testing.assert_array_equal(read(scene, tmp_path).faces, faces)


def test_points_and_lines_are_left_out_with_a_note(tmp_path: Path) -> None:
    scene = Scene()
    scene.node(mesh=scene.mesh(mode=1))
    scene.node(mesh=scene.mesh(mode=0))
    scene.node(mesh=scene.mesh())
    model = read(scene, tmp_path)
    assert len(model.faces) == 1
    assert model.notes == ("2 groups of points, lines or nothing left out",)


def test_quantised_interleaved_and_sparse_accessors(tmp_path: Path) -> None:
    scene = Scene()
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


# Skins


def test_the_default_pose_is_skinned(tmp_path: Path) -> None:
    model = read(skinned_bar(bend=True), tmp_path)
    # The upper end turns by 90 degrees about (0, 1, 0); the middle is half-way between both poses.
    np.testing.assert_allclose(
        model.file_vertices,
        [[0, 0, 0], [0.5, 0, 0], [0, 1, 0], [0.25, 1.25, 0], [-1, 1, 0], [-1, 1.5, 0]],
        atol=1e-6,
    )
    np.testing.assert_allclose(place(model.skeleton, "high_end"), [-1, 1, 0], atol=1e-7)
    assert parent_names(model.skeleton) == {"low": "", "high": "low", "high_end": "high"}
    assert model.weights is not None
    np.testing.assert_allclose(
        model.weights.toarray()[:, :2], [[1, 0], [1, 0], [0.5, 0.5], [0.5, 0.5], [0, 1], [0, 1]]
    )


def test_an_armature_in_centimetres_stands_as_one_in_metres(tmp_path: Path) -> None:
    one, hundred = (read(skinned_bar(bend=True, scale=s), tmp_path) for s in (1.0, 0.01))
    assert one.skeleton is not None
    assert hundred.skeleton is not None
    np.testing.assert_allclose(one.file_vertices, hundred.file_vertices, atol=1e-5)
    np.testing.assert_allclose(
        one.skeleton.rest_positions, hundred.skeleton.rest_positions, atol=1e-6
    )


def test_rigid_parts_follow_the_joint_above_and_loose_ones_the_nearest(tmp_path: Path) -> None:
    scene = skinned_bar()
    scene.document["nodes"][3]["children"] = [5]
    scene.node(children=[6])
    scene.node(mesh=scene.mesh())
    scene.node(mesh=scene.mesh(), translation=[0.0, -3.0, 0.0])
    model = read(scene, tmp_path)
    assert model.skeleton is not None
    assert model.weights is not None
    names = [model.skeleton.names[joint] for joint in model.weights.toarray().argmax(axis=1)]
    assert names[:3] + names[9:] == ["high_end"] * 3 + ["low"] * 3
    assert any("1 parts without a joint" in note for note in model.notes)


def test_two_skins_become_one_skeleton(tmp_path: Path) -> None:
    scene = skinned_bar()
    joints = scene.accessor(np.zeros((3, 4)), "uint8")
    weights = scene.accessor(np.tile([1.0, 0, 0, 0], (3, 1)))
    mesh = scene.mesh(attributes={"JOINTS_0": joints, "WEIGHTS_0": weights})
    scene.document["nodes"][1]["children"].append(5)
    scene.node(name="between", translation=[-1, 0, 0], children=[6])
    scene.node(name="tail", translation=[-1, 0, 0])
    scene.node(mesh=mesh, skin=1)
    scene.document["skins"].append({"joints": [6]})
    model = read(scene, tmp_path)
    parents = parent_names(model.skeleton)
    assert parents["tail"] == "between"
    assert parents["between"] == "low"
    np.testing.assert_allclose(model.file_vertices[6:], np.add(TRIANGLE, [-2, 0, 0]))
    assert model.weights is not None
    np.testing.assert_allclose(model.weights.sum(axis=1), 1.0)


def test_joints_that_move_nothing_are_left_out(tmp_path: Path) -> None:
    """An idle stem, an IK target at the root, a foot that hangs on it, a joint at its parent."""
    scene = skinned_bar()
    nodes = scene.document["nodes"]
    nodes[0]["children"] = [5]
    stem = scene.node(name="root", children=[1, 6, 7])
    target = scene.node(name="PoleTarget", translation=[3, 0, 3])
    foot = scene.node(name="high", translation=[0.0, 2.5, 0.0])
    nodes[3]["children"] = [8]
    twist = scene.node(name="twist")
    part = scene.mesh()
    nodes[foot]["mesh"] = nodes[twist]["mesh"] = part
    scene.document["skins"][0] = {"joints": [1, 2, 3, stem, target, foot, twist]}
    model = read(scene, tmp_path)
    expected = {"low": "", "high.2": "low", "twist": "high.2", "high": "twist"}
    assert parent_names(model.skeleton) == expected
    np.testing.assert_allclose(place(model.skeleton, "high"), [0.0, 2.5, 0.0])
    assert model.weights is not None
    assert model.weights.shape == (12, 4)


def test_weights_are_normalised_and_a_lost_vertex_follows_the_first_joint(tmp_path: Path) -> None:
    scene = skinned_bar()
    attributes = scene.document["meshes"][0]["primitives"][0]["attributes"]
    weights = np.zeros((6, 4))
    weights[1:, 1] = 3.0
    attributes["WEIGHTS_0"] = scene.accessor(weights)
    model = read(scene, tmp_path)
    assert model.weights is not None
    np.testing.assert_allclose(model.weights.toarray()[:, 0], [1, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(model.weights.sum(axis=1), 1.0)


# VRM


HUMAN = {"hips": [0, 1.0, 0], "spine": [0, 0.3, 0], "head": [0, 0.4, 0]}


def vrm(*, old: bool, reach: float) -> Scene:
    scene = Scene()
    size = np.array(TRIANGLE) * reach
    scene.node(mesh=scene.mesh(size))
    for number, (name, offset) in enumerate(HUMAN.items(), start=1):
        scene.node(name=f"J_{name}", translation=offset, children=[number + 1])
    scene.document["nodes"][-1]["children"] = []
    if old:
        bones = [{"bone": name, "node": i} for i, name in enumerate(HUMAN, start=1)]
        bones.append({"bone": "jaw", "node": -1})
        scene.document["extensions"] = {"VRM": {"humanoid": {"humanBones": bones}}}
    else:
        named = {name: {"node": i} for i, name in enumerate(HUMAN, start=1)}
        scene.document["extensions"] = {"VRMC_vrm": {"humanoid": {"humanBones": named}}}
    return scene


@pytest.mark.parametrize("old", [True, False])
def test_only_vrm_0_faces_backward(tmp_path: Path, old: bool) -> None:
    model = read(vrm(old=old, reach=1.7), tmp_path, ".vrm")
    assert model.faces_backward is old
    expected = {"J_hips": "", "J_spine": "J_hips", "J_head": "J_spine"}
    assert parent_names(model.skeleton) == expected
    np.testing.assert_allclose(place(model.skeleton, "J_head"), [0, 1.7, 0])


def test_humanoid_bones_beside_the_mesh_are_no_rig_of_it(tmp_path: Path) -> None:
    model = read(vrm(old=False, reach=0.2), tmp_path, ".vrm")
    assert model.skeleton is None
    assert "humanoid" in model.notes[0]


# Materials


def png(pixels: ArrayLike) -> str:
    stream = io.BytesIO()
    Image.fromarray(np.array(pixels, dtype=np.uint8)).save(stream, "PNG")
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def textured(uri: str, **material: Any) -> Scene:
    scene = Scene(
        materials=[
            {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 1.5, 0.25, 0.5],
                    "baseColorTexture": {"index": 0},
                },
                **material,
            }
        ],
        textures=[{"source": 0}],
        images=[{"uri": uri, "name": "skin"}],
    )
    uvs = scene.accessor([[0, 0], [1, 0], [0, 0.5]])
    scene.node(mesh=scene.mesh(attributes={"TEXCOORD_0": uvs}, material=0))
    scene.node(mesh=scene.mesh())
    return scene


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


# Damage and malice


def test_a_buffer_beside_the_file_is_read(tmp_path: Path) -> None:
    scene = Scene()
    scene.node(mesh=scene.mesh())
    (tmp_path / "some parts.bin").write_bytes(scene.data)
    document = scene.document
    document["buffers"] = [{"byteLength": len(scene.data), "uri": "some%20parts.bin"}]
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    assert len(read_gltf(tmp_path / "a.gltf").faces) == 1


@pytest.mark.parametrize(
    "uri",
    ["/etc/passwd", "../model.bin", "%2e%2e/model.bin", "https://example.org/a.bin",
     "file:///etc/passwd", "a/../../b.bin", "C:\\a.bin", "\\\\host\\a.bin", "a\0b", ".", ""],
)  # fmt: skip
def test_a_buffer_elsewhere_is_refused(tmp_path: Path, uri: str) -> None:
    scene = Scene()
    scene.node(mesh=scene.mesh())
    (tmp_path.parent / "model.bin").write_bytes(scene.data)
    scene.document["buffers"] = [{"byteLength": len(scene.data), "uri": uri}]
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(scene.document))
    with pytest.raises(InputError, match="beside"):
        read_gltf(path)


def change(scene: Scene, where: str, value: Any) -> None:
    *way, last = (int(step) if step.isdigit() else step for step in where.split("."))
    spot: Any = scene.document
    for step in way:
        spot = spot[step]
    spot[last] = value


@pytest.mark.parametrize(
    ("where", "value", "said"),
    [
        ("asset.version", "1.0", "glTF 2.0"),
        ("nodes.3.children", [1], "two nodes"),
        ("nodes.3.children", [0], "cycle"),
        ("nodes.3.children", [99], "index below"),
        ("nodes.1.translation", [1e300, 0, 0], "sensible"),
        ("nodes.1.scale", [1, 2], "3 numbers"),
        ("nodes.1.rotation", [0, 0, 0, 0], "quaternion"),
        ("nodes.4.mesh", 7, "not there"),
        ("nodes.4.skin", -1, "skin"),
        ("skins.0.joints", [], "no joints"),
        ("skins.0.joints", [1], "beyond the 1"),
        ("skins.0.joints", [1] * 9, "inverse bind"),
        ("accessors.0.count", 10**12, "count"),
        ("accessors.2.count", 8_000_000, "reduce"),
        ("accessors.0.count", True, "count"),
        ("accessors.0.componentType", 5124, "type"),
        ("accessors.2.type", "VEC2", "VEC3"),
        ("bufferViews.0.byteOffset", 10**9, "buffer"),
        ("bufferViews.0.byteLength", 8, "do not fit"),
        ("bufferViews.2.byteStride", 4, "overlap"),
        ("bufferViews.0.buffer", 1, "not there"),
        ("meshes.0.primitives", {}, "list"),
        ("meshes.0.primitives.0.mode", 9, "mode"),
        ("extensionsRequired", ["KHR_draco_mesh_compression"], "KHR_draco_mesh_compression"),
        ("extensionsRequired", ["EXT_meshopt_compression"], "EXT_meshopt_compression"),
    ],
)
def test_damage_is_named(tmp_path: Path, where: str, value: Any, said: str) -> None:
    scene = skinned_bar()
    change(scene, where, value)
    assert said in refusal(scene, tmp_path)


def test_compression_without_a_copy_is_refused(tmp_path: Path) -> None:
    scene = Scene()
    scene.node(mesh=scene.mesh(extensions={"KHR_draco_mesh_compression": {"bufferView": 0}}))
    assert len(read(scene, tmp_path).faces) == 1
    del scene.document["accessors"][0]["bufferView"]
    assert "KHR_draco_mesh_compression" in refusal(scene, tmp_path)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30])
def test_positions_that_are_no_places_are_refused(tmp_path: Path, bad: float) -> None:
    scene = Scene()
    scene.node(mesh=scene.mesh([*TRIANGLE[:2], [0, bad, 0]]))
    assert "vertex 2" in refusal(scene, tmp_path)


def test_a_signalling_nan_is_refused_and_not_warned_of(tmp_path: Path) -> None:
    scene = Scene()
    scene.node(mesh=scene.mesh())
    scene.data = bytes.fromhex("0000817f") + scene.data[4:]
    assert "vertex 0" in refusal(scene, tmp_path)


def test_indices_beyond_the_vertices_are_refused(tmp_path: Path) -> None:
    scene = Scene()
    scene.node(mesh=scene.mesh(indices=scene.accessor([0, 1, 3], "uint32")))
    assert "vertex 3 of 3" in refusal(scene, tmp_path)


def test_a_file_with_neither_mesh_nor_rig_is_refused(tmp_path: Path) -> None:
    scene = Scene()
    scene.node()
    assert "neither" in refusal(scene, tmp_path)


def test_many_copies_of_a_mesh_are_bounded(tmp_path: Path) -> None:
    scene = Scene()
    mesh = scene.mesh(np.ones((9_999, 3)))
    scene.document["meshes"][mesh]["primitives"] *= 20
    for _ in range(20):
        scene.node(mesh=mesh)
    assert "reduce" in refusal(scene, tmp_path)


def test_nodes_nested_too_deep_are_refused(tmp_path: Path) -> None:
    scene = Scene(nodes=[{"children": [number + 1]} for number in range(2_000)])
    scene.node(mesh=scene.mesh())
    assert "deeper" in refusal(scene, tmp_path)


def test_json_nested_too_deep_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "deep.gltf"
    path.write_text("[" * 200_000)
    with pytest.raises(InputError, match="damaged"):
        read_gltf(path)


@pytest.mark.parametrize("content", [b"", b"glTF", b"{}", b"[]", b"\xff\xfe", b'{"asset": NaN}'])
def test_what_is_no_gltf_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(content)
    with pytest.raises(InputError):
        read_gltf(path)


def test_a_file_cut_short_anywhere_is_refused(tmp_path: Path) -> None:
    whole = skinned_bar().save(tmp_path / "model.glb").read_bytes()
    path = tmp_path / "short.glb"
    for end in range(0, len(whole), 7):
        path.write_bytes(whole[:end])
        with pytest.raises(InputError):
            read_gltf(path)


ODD = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 12), st.sampled_from([2**31, 2**63, 1e308, -1e9]),
    st.floats(-3, 3), st.text(max_size=3), st.lists(st.integers(-1, 8), max_size=5),
    st.just({}), st.just({"node": 1}),
)  # fmt: skip


def ways(value: Any) -> list[list[Any]]:
    """Every path to a member of a JSON value."""
    if isinstance(value, dict):
        members = list(value.items())
    else:
        members = list(enumerate(value)) if isinstance(value, list) else []
    return [[key, *rest] for key, member in members for rest in [[], *ways(member)]]


@settings(max_examples=400, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_document_reads_or_is_refused(tmp_path: Path, data: st.DataObject) -> None:
    scene = data.draw(st.sampled_from([skinned_bar, lambda: textured(png([[[1, 2, 3, 4]]]))]))()
    scene.node(mesh=scene.mesh())  # so that few are left with a rig only, which takes long to dress
    for _ in range(data.draw(st.integers(1, 3))):
        *way, last = data.draw(st.sampled_from(ways(scene.document)))
        spot: Any = scene.document
        for step in way:
            spot = spot[step]
        if data.draw(st.booleans()):
            spot[last] = copy.deepcopy(data.draw(ODD))  # it may be changed in its turn
        else:
            del spot[last]
    path = tmp_path / "mutated.glb"
    path.write_bytes(glb(json.dumps(scene.document).encode(), scene.data))
    try:
        model = read_gltf(path)
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017  # either outcome is fine, one is checked
        return
    assert np.isfinite(model.file_vertices).all()
    assert model.faces.max() < len(model.file_vertices)
    if model.weights is not None:
        np.testing.assert_allclose(model.weights.sum(axis=1), 1.0, atol=1e-9)


# Rigs without a mesh


def edges_of(faces: NDArray[np.int64]) -> Counter[tuple[int, int]]:
    return Counter(map(tuple, faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))


def figure() -> Skeleton:
    names = ("hip", "chest", "head", "arm_l", "hand_l", "arm_r", "hand_r", "foot_l", "foot_r")
    positions = np.array(
        [[0, 1, 0], [0, 1.4, 0], [0, 1.7, 0], [0.2, 1.4, 0], [0.7, 1.4, 0.1],
         [-0.2, 1.4, 0], [-0.7, 1.4, 0.1], [0.2, 0, 0], [-0.2, 0, 0]]
    )  # fmt: skip
    return Skeleton(names, np.array([-1, 0, 1, 1, 3, 1, 5, 0, 0]), positions)


def test_the_body_of_a_rig_is_one_closed_surface_round_its_bones() -> None:
    pytest.importorskip("manifold3d")
    skeleton = figure()
    vertices, faces, weights = body_around(skeleton)
    assert 3_000 <= len(vertices) <= 8_000
    edges = edges_of(faces)
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert len(vertices) - len(edges) // 2 + len(faces) == 2  # one piece without handles
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    assert np.einsum("mi,mi->", a, np.cross(b, c)) > 0.0  # faces outward
    assert weights.shape == (len(vertices), 9)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    hand = vertices[:, 0] > 0.4
    assert set(weights[hand].indices.tolist()) == {skeleton.index("arm_l")}


def test_the_body_of_a_rig_goes_with_its_unit() -> None:
    pytest.importorskip("manifold3d")
    small = figure()
    large = Skeleton(small.names, small.parents, 100.0 * small.rest_positions + [5.0, 0.0, -9.0])
    one, hundred = body_around(small)[0], body_around(large)[0]
    np.testing.assert_allclose(100.0 * one + [5.0, 0.0, -9.0], hundred, atol=1e-6)


# Real files


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
    for path in files:
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
