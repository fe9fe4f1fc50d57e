"""Damaged and hostile glTF files: one clear line, or a model that is whole."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.errors import InputError
from runtime.characters.gltf.rig import read_gltf
from tests.runtime.characters.gltf.documents import (
    TRIANGLE,
    Document,
    glb,
    png,
    read,
    refusal,
    skinned_bar,
    textured,
)
from tests.thorough import examples


def test_a_buffer_beside_the_file_is_read(tmp_path: Path) -> None:
    scene = Document()
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
    scene = Document()
    scene.node(mesh=scene.mesh())
    (tmp_path.parent / "model.bin").write_bytes(scene.data)
    scene.document["buffers"] = [{"byteLength": len(scene.data), "uri": uri}]
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(scene.document))
    with pytest.raises(InputError, match="beside"):
        read_gltf(path)


def change(scene: Document, where: str, value: Any) -> None:
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
    scene = Document()
    scene.node(mesh=scene.mesh(extensions={"KHR_draco_mesh_compression": {"bufferView": 0}}))
    assert len(read(scene, tmp_path).faces) == 1
    del scene.document["accessors"][0]["bufferView"]
    assert "KHR_draco_mesh_compression" in refusal(scene, tmp_path)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30])
def test_positions_that_are_no_places_are_refused(tmp_path: Path, bad: float) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh([*TRIANGLE[:2], [0, bad, 0]]))
    assert "vertex 2" in refusal(scene, tmp_path)


def test_a_signalling_nan_is_refused_and_not_warned_of(tmp_path: Path) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh())
    scene.data = bytes.fromhex("0000817f") + scene.data[4:]
    assert "vertex 0" in refusal(scene, tmp_path)


def test_indices_beyond_the_vertices_are_refused(tmp_path: Path) -> None:
    scene = Document()
    scene.node(mesh=scene.mesh(indices=scene.accessor([0, 1, 3], "uint32")))
    assert "vertex 3 of 3" in refusal(scene, tmp_path)


def test_a_file_with_neither_mesh_nor_rig_is_refused(tmp_path: Path) -> None:
    scene = Document()
    scene.node()
    assert "neither" in refusal(scene, tmp_path)


def test_many_copies_of_a_mesh_are_bounded(tmp_path: Path) -> None:
    scene = Document()
    mesh = scene.mesh(np.ones((9_999, 3)))
    scene.document["meshes"][mesh]["primitives"] *= 20
    for _ in range(20):
        scene.node(mesh=mesh)
    assert "reduce" in refusal(scene, tmp_path)


def test_nodes_nested_too_deep_are_refused(tmp_path: Path) -> None:
    scene = Document(nodes=[{"children": [number + 1]} for number in range(2_000)])
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


@settings(max_examples=examples(400), deadline=None, suppress_health_check=list(HealthCheck))
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
