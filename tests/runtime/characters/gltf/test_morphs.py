"""Morph targets and expressions of glTF and VRM files become morphs of characters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from runtime.characters.character_file import read_character
from runtime.characters.gltf import morphs as reader
from runtime.characters.morphs import BLEND, BLOCK, Expression, canonical_name
from tests.runtime.characters.gltf.documents import QUARTER_TURN, Document, read, skinned_bar

UP = np.array([[0.0, 0.5, 0.0]] * 3)
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def talking(*, names: list[str] | None = None, **node: Any) -> Document:
    """A triangle with two targets, the second sparse: it moves vertex 2 alone."""
    scene = Document()
    whole = scene.accessor(UP)
    sparse = {
        "count": 1,
        "indices": {
            "bufferView": scene.view(np.array([2], dtype="uint8").tobytes()),
            "componentType": 5121,
        },
        "values": {"bufferView": scene.view(np.array([[1, 2, 3]], dtype="float32").tobytes())},
    }
    scene.document["accessors"].append(
        {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}
    )
    mesh = scene.mesh(targets=[{"POSITION": whole}, {"POSITION": whole + 1}])
    if names is not None:
        scene.document["meshes"][mesh]["extras"] = {"targetNames": names}
    scene.node(mesh=mesh, **node)
    return scene


def test_targets_are_read_with_their_names_and_turned_into_the_scene(tmp_path: Path) -> None:
    scene = talking(names=["aa", "smile"], rotation=QUARTER_TURN, scale=[2, 2, 2])
    model = read(scene, tmp_path)
    assert model.morph_names == ("aa", "smile")
    (first, up), (second, one) = model.morphs
    assert first.tolist() == [0, 1, 2]
    np.testing.assert_allclose(up, [[-1.0, 0, 0]] * 3, atol=1e-6)  # up turns to -x, twice as far
    assert second.tolist() == [2]
    np.testing.assert_allclose(one, [[-4.0, 2.0, 6.0]], atol=1e-6)


def test_targets_of_a_skinned_mesh_turn_with_its_pose(tmp_path: Path) -> None:
    scene = skinned_bar(bend=True)
    moves = scene.accessor(np.tile([0.0, 1.0, 0.0], (6, 1)))
    scene.document["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": moves}]
    ((vertices, deltas),) = read(scene, tmp_path).morphs
    assert vertices.tolist() == list(range(6))
    np.testing.assert_allclose(deltas[:2], [[0, 1, 0]] * 2, atol=1e-6)
    np.testing.assert_allclose(deltas[4:], [[-1, 0, 0]] * 2, atol=1e-6)  # turned with their bone


@pytest.mark.parametrize(
    "damage",
    [
        {"POSITION": 99},
        {"POSITION": "x"},
        {"POSITION": 0, "wrong": 1},
    ],
)
def test_damaged_targets_are_left_out_with_a_note(tmp_path: Path, damage: dict[str, Any]) -> None:
    scene = talking()
    if "wrong" in damage:  # four deltas for three vertices
        damage = {"POSITION": scene.accessor(SQUARE)}
    scene.document["meshes"][0]["primitives"][0]["targets"] = [damage]
    model = read(scene, tmp_path)
    assert all(len(vertices) == 0 for vertices, _ in model.morphs)
    assert any("morph targets are left out" in note for note in model.notes)
    assert len(model.faces) == 1


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30])
def test_deltas_beyond_bounds_are_left_out(tmp_path: Path, bad: float) -> None:
    scene = Document()
    wild = scene.accessor([[bad, 0, 0]] * 3)
    scene.node(mesh=scene.mesh(targets=[{"POSITION": wild}]))
    model = read(scene, tmp_path)
    assert any("left out" in note for note in model.notes)
    assert all(len(vertices) == 0 for vertices, _ in model.morphs)


def test_too_many_targets_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = talking()
    targets = scene.document["meshes"][0]["primitives"][0]["targets"]
    scene.document["meshes"][0]["primitives"][0]["targets"] = targets * 1000
    model = read(scene, tmp_path)
    assert len(model.morph_names) <= reader.MOST_TARGETS
    assert any("more than 1024" in note for note in model.notes)
    monkeypatch.setattr(reader, "MOST_READ", 5)
    assert any("too many vertices" in note for note in read(talking(), tmp_path).notes)


def test_names_from_a_file_are_short_and_printable(tmp_path: Path) -> None:
    scene = talking(names=["a\x1b[2J" + "x" * 500, 7])  # type: ignore[list-item]  # a damaged file
    names = read(scene, tmp_path).morph_names
    assert names[0].isprintable()
    assert len(names[0]) <= reader.LONGEST_NAME
    assert names[1] == "morph 1"


def vrm_1(expressions: dict[str, Any]) -> Document:
    scene = talking(names=["Fcl_A", "Fcl_Joy"])
    scene.document["extensions"] = {"VRMC_vrm": {"expressions": expressions}}
    return scene


def test_expressions_of_vrm_1(tmp_path: Path) -> None:
    bind = {"node": 0, "index": 1, "weight": 0.75}
    scene = vrm_1(
        {
            "preset": {
                "happy": {
                    "morphTargetBinds": [bind],
                    "isBinary": True,
                    "overrideBlink": "block",
                    "overrideMouth": "blend",
                }
            },
            "custom": {"Wink": {"morphTargetBinds": [{"node": 0, "index": 0}]}},
        }
    )
    happy, wink = read(scene, tmp_path).expressions
    assert happy == Expression("happy", ((1, 0.75),), True, blink=BLOCK, mouth=BLEND)
    assert wink == Expression("Wink", ((0, 1.0),))


def test_expressions_of_vrm_0(tmp_path: Path) -> None:
    scene = talking(names=["Fcl_A", "Fcl_Joy"])
    groups = [
        {"name": "Joy", "presetName": "joy", "binds": [{"mesh": 0, "index": 1, "weight": 50}]},
        {"name": "Cheeks", "presetName": "unknown", "isBinary": True, "binds": []},
        {"name": "A", "presetName": "a", "binds": [{"mesh": -1, "index": 0, "weight": 100}]},
    ]
    scene.document["extensions"] = {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}}
    joy, cheeks, a = read(scene, tmp_path).expressions
    assert joy == Expression("joy", ((1, 0.5),))
    assert cheeks == Expression("Cheeks", (), True)
    assert a == Expression("a", ())


@pytest.mark.parametrize(
    "expressions",
    [
        3,
        {"preset": []},
        {"preset": {"happy": {"morphTargetBinds": [{"node": 77, "index": 0}]}}},
        {"preset": {"happy": {"morphTargetBinds": [{"node": 0, "index": -1}]}}},
        {"preset": {"happy": {"morphTargetBinds": [{"node": 0, "index": 0}] * 2000}}},
        {"custom": {f"e{k}": {} for k in range(1000)}},
    ],
)
def test_damaged_expressions_leave_the_targets(tmp_path: Path, expressions: Any) -> None:
    model = read(vrm_1(expressions), tmp_path)
    assert model.expressions == ()
    assert any("expressions are left out" in note for note in model.notes)
    assert model.morph_names == ("Fcl_A", "Fcl_Joy")


def test_a_real_file_of_override_rules(shared: Path) -> None:
    path = shared / "rig/vrmc_expressions_isBinary_Overrides.vrm"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    character = read_character(path)
    assert character.morphs is not None
    happy, blink = character.morphs.expressions
    assert (happy.name, happy.is_binary, happy.blink) == ("happy", True, BLEND)
    assert (blink.name, blink.is_binary, blink.blink) == ("blink", False, "none")


def test_lips_that_touch_stay_two_and_seams_become_one(tmp_path: Path) -> None:
    """Two triangles share an edge in the file: a seam where they move alike, lips where not."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0], [0, -1, 0]]
    for lower, count in (([0.0, 0.3, 0.0], 4), ([0.0, -0.3, 0.0], 6)):
        scene = Document()
        deltas = [[0, 0.3, 0]] * 2 + [[0, 0, 0]] + [lower] * 2 + [[0, 0, 0]]
        scene.node(mesh=scene.mesh(corners, targets=[{"POSITION": scene.accessor(deltas)}]))
        vertices = read_character(scene.save(tmp_path / "lips.glb")).vertices
        assert len(vertices) == count


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Joy", "happy"),
        ("ANGRY", "angry"),
        ("Sorrow", "sad"),
        ("Fun", "relaxed"),
        ("A", "aa"),
        ("I", "ih"),
        ("U", "ou"),
        ("E", "ee"),
        ("O", "oh"),
        ("Blink", "blink"),
        ("Blink_L", "blinkLeft"),
        ("BLINK_R", "blinkRight"),
        ("LookUp", "lookUp"),
        ("eyeBlink_L", "eyeBlinkLeft"),
        ("JawOpen", "jawOpen"),
    ],
)
def test_names_of_both_versions_mean_the_same(one: str, other: str) -> None:
    assert canonical_name(one) == canonical_name(other)


def test_different_shapes_keep_different_names() -> None:
    names = ("aa", "ih", "jawOpen", "blink", "blinkLeft", "eyeBlinkLeft", "jawLeft", "happy")
    assert len({canonical_name(name) for name in names}) == len(names)
