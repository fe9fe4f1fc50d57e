"""Rigs of glTF and VRM files: skins, joints, weights and humanoids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from runtime.characters.open_character import load_character
from tests.runtime.characters.gltf.documents import (
    TRIANGLE,
    Document,
    parent_names,
    place,
    read,
    skinned_bar,
)


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


HUMAN = {"hips": [0, 1.0, 0], "spine": [0, 0.3, 0], "head": [0, 0.4, 0]}


def vrm(*, old: bool, reach: float) -> Document:
    scene = Document()
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


BODY = {
    "hips": ("", [0, 1.0, 0]),
    "spine": ("hips", [0, 0.2, 0]),
    "chest": ("spine", [0, 0.2, 0]),
    "head": ("chest", [0, 0.2, 0]),
    **{
        f"{side}{bone}": (
            above if above in ("hips", "chest") else f"{side}{above}",
            [sign * x, y, 0],
        )
        for side, sign in (("left", 1), ("right", -1))
        for bone, above, x, y in (
            ("UpperArm", "chest", 0.2, 0.1),
            ("LowerArm", "UpperArm", 0.3, 0),
            ("Hand", "LowerArm", 0.3, 0),
            ("UpperLeg", "hips", 0.1, 0),
            ("LowerLeg", "UpperLeg", 0, -0.5),
            ("Foot", "LowerLeg", 0, -0.5),
        )
    },
}


def declared_body(*, old: bool, called: dict[str, str]) -> Document:
    """A VRM file whose nodes have other names than the humanoid bones that they are."""
    scene = Document()
    size = np.array([[-0.8, 0, 0], [0.8, 0, 0], [0, 1.7, 0]])
    scene.node(mesh=scene.mesh(size))
    number = {bone: index for index, bone in enumerate(BODY, start=1)}
    for bone, (_, offset) in BODY.items():
        below = [number[child] for child, (above, _) in BODY.items() if above == bone]
        scene.node(name=called[bone], translation=offset, children=below)
    if old:
        bones = [{"bone": bone, "node": index} for bone, index in number.items()]
        scene.document["extensions"] = {"VRM": {"humanoid": {"humanBones": bones}}}
    else:
        named = {bone: {"node": index} for bone, index in number.items()}
        scene.document["extensions"] = {"VRMC_vrm": {"humanoid": {"humanBones": named}}}
    return scene


@pytest.mark.parametrize("old", [True, False])
@pytest.mark.parametrize("naming", ["nameless", "misleading"])
def test_what_a_vrm_file_declares_beats_the_names_of_its_nodes(
    tmp_path: Path, old: bool, naming: str
) -> None:
    bones = list(BODY)
    called = {bone: f"node_{number}" for number, bone in enumerate(bones)}
    if naming == "misleading":
        called = dict(zip(bones, reversed(bones), strict=True))
    scene = declared_body(old=old, called=called)
    character = load_character(scene.save(tmp_path / "body.vrm"))
    plan = character.plan
    assert plan is not None
    names = character.skeleton.names
    for side, arm in plan.arms.items():
        wanted = [called[f"{side}{bone}"] for bone in ("UpperArm", "LowerArm", "Hand")]
        assert [names[joint] for joint in arm.chain] == wanted
    for side, leg in plan.legs.items():
        wanted = [called[f"{side}{bone}"] for bone in ("UpperLeg", "LowerLeg", "Foot")]
        assert [names[joint] for joint in leg.chain] == wanted
    assert len(plan.arms) == len(plan.legs) == 2
    assert [names[joint] for joint in plan.trunk] == [called[b] for b in ("hips", "spine", "chest")]


def test_a_damaged_declaration_does_not_spoil_a_skin(tmp_path: Path) -> None:
    scene = skinned_bar()
    scene.document["extensions"] = {
        "VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 999}}}}
    }
    model = read(scene, tmp_path, ".vrm")
    assert model.skeleton is not None
    assert not model.humanoid
    assert "humanoid bones are left out" in model.notes[-1]
