"""glTF export: the animated character comes back from the file."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pygltflib
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation, Slerp

from devices.errors import InputError
from replay.formats import read_recording
from runtime.characters.character import Character
from runtime.characters.morphs import Morphs
from runtime.driving.targets import PosedNodes
from runtime.output.files.gltf_export import GltfExport
from runtime.output.output import PerformedFrame
from solvers.deform.morph_targets import MorphTargets
from tests.runtime.tentacle import HEIGHT, NODES, make_show, make_tentacle


def export(path: Path, character: Character, show: list[PerformedFrame]) -> GltfExport:
    with GltfExport(path, character) as output:
        for frame in show:
            output.write(frame)
    return output


class Player:
    """Poses a .glb as the specification says, from what pygltflib reads."""

    def __init__(self, path: Path) -> None:
        self.gltf = pygltflib.GLTF2().load(str(path))
        self.blob = self.gltf.binary_blob()

    def array(self, accessor: int) -> NDArray[np.generic]:
        described = self.gltf.accessors[accessor]
        view = self.gltf.bufferViews[described.bufferView]
        kinds = {5126: "<f4", 5125: "<u4", 5123: "<u2"}
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[described.type]
        values = np.frombuffer(
            self.blob, kinds[described.componentType], described.count * width, view.byteOffset
        )
        assert values.nbytes == view.byteLength
        return values.reshape(described.count, width)

    def node_matrices(self, time: float) -> NDArray[np.float64]:
        """Global matrices (nodes, 4, 4) at `time` [s]."""
        local = [[np.array(node.translation or (0, 0, 0)), Rotation.identity()]
                 for node in self.gltf.nodes]  # fmt: skip
        for animation in self.gltf.animations:
            for channel in animation.channels:
                if channel.target.path == "weights":
                    continue
                sampler = animation.samplers[channel.sampler]
                times = self.array(sampler.input)[:, 0].astype(float)
                values = self.array(sampler.output).astype(float)
                if channel.target.path == "translation":
                    moved = [np.interp(time, times, values[:, axis]) for axis in range(3)]
                    local[channel.target.node][0] = np.array(moved)
                else:
                    turns = Rotation.from_quat(values)
                    shown = np.clip(time, times[0], times[-1])
                    turn = Slerp(times, turns)(shown) if len(times) > 1 else turns[0]
                    local[channel.target.node][1] = turn
        matrices = np.tile(np.eye(4), (len(local), 1, 1))

        def place(node: int, parent: NDArray[np.float64]) -> None:
            matrices[node, :3, :3] = local[node][1].as_matrix()
            matrices[node, :3, 3] = local[node][0]
            matrices[node] = parent @ matrices[node]
            for child in self.gltf.nodes[node].children or ():
                place(child, matrices[node])

        for root in self.gltf.scenes[self.gltf.scene].nodes:
            place(root, np.eye(4))
        return matrices

    def morph_weights(self, time: float) -> NDArray[np.float64]:
        """The weights of the mesh's morph targets at `time` [s]."""
        for animation in self.gltf.animations:
            for channel in animation.channels:
                if channel.target.path == "weights":
                    assert self.gltf.nodes[channel.target.node].mesh == 0
                    sampler = animation.samplers[channel.sampler]
                    times = self.array(sampler.input)[:, 0].astype(float)
                    rows = self.array(sampler.output).astype(float).reshape(len(times), -1)
                    return np.array([np.interp(time, times, row) for row in rows.T])
        return np.array(self.gltf.meshes[0].weights or [])

    def vertices(self, time: float) -> NDArray[np.float64]:
        """Morphed and skinned file vertices (M, 3) at `time` [s]."""
        primitive = self.gltf.meshes[0].primitives[0]
        attributes = primitive.attributes
        positions = self.array(attributes.POSITION).astype(float)
        for weight, target in zip(self.morph_weights(time), primitive.targets or [], strict=True):
            positions += weight * self.array(target["POSITION"])
        skin = self.gltf.skins[0]
        bind = self.array(skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
        joints = self.node_matrices(time)[skin.joints] @ bind
        nodes = self.array(attributes.JOINTS_0)
        weights = self.array(attributes.WEIGHTS_0).astype(float)
        np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
        rest = np.c_[positions, np.ones(len(nodes))]
        return np.einsum("nc,ncij,nj->ni", weights, joints[nodes], rest)[:, :3]


def test_the_skinned_surface_follows_the_performed_one(tmp_path: Path) -> None:
    character = make_tentacle()
    show = make_show(character)
    output = export(tmp_path / "a.glb", character, show)
    player = Player(tmp_path / "a.glb")
    for frame in (show[0], show[17], show[-1]):
        expected = frame.vertices[character.surface.vertex]
        np.testing.assert_allclose(player.vertices(frame.time), expected, atol=0.003 * HEIGHT)
    # The show is skinned with two nodes a vertex, so that a fit can be nearly perfect.
    assert 0 < output.deviation.rms < 5e-4 * HEIGHT
    assert output.deviation.greatest < 3e-3 * HEIGHT
    extras = player.gltf.meshes[0].extras
    assert extras["skinDeviationRms"] == output.deviation.rms


def expressive(character: Character) -> Character:
    """The character with a target that is never moved, and one that widens its upper half."""
    upper = np.flatnonzero(character.vertices[:, 1] > 0.5 * HEIGHT)
    wider = 0.5 * character.vertices[upper] * [1.0, 0.0, 1.0]
    targets = MorphTargets.of([(upper, -wider), (upper, wider)])
    return replace(character, morphs=Morphs.of(targets, ["thin", "wide"]))


def test_morphs_are_written_with_their_weights(tmp_path: Path) -> None:
    character = expressive(make_tentacle())
    targets = character.morphs.targets
    own = slice(targets.starts[1], targets.starts[2])
    show = []
    for index in range(40):
        weight = 0.5 - 0.5 * np.cos(0.3 * index)
        wide = character.vertices.copy()
        wide[targets.vertices[own]] += weight * targets.deltas[own]
        performed = make_show(replace(character, vertices=wide))[index]
        show.append(replace(performed, weights=np.array([0.0, weight])))
    output = export(tmp_path / "b.glb", character, show)
    player = Player(tmp_path / "b.glb")
    mesh = player.gltf.meshes[0]
    assert mesh.extras["targetNames"] == ["wide"], "what never moves is not written"
    assert mesh.weights == [0.0]
    assert all(len(primitive.targets) == 1 for primitive in mesh.primitives)
    for frame in (show[0], show[11], show[17], show[-1]):
        expected = frame.vertices[character.surface.vertex]
        np.testing.assert_allclose(player.vertices(frame.time), expected, atol=0.004 * HEIGHT)
    assert output.deviation.rms < 1e-3 * HEIGHT


def test_a_show_without_a_face_gives_the_same_file(tmp_path: Path) -> None:
    character = make_tentacle()
    export(tmp_path / "a.glb", character, make_show(character, frames=5))
    still = [replace(f, weights=np.zeros(2)) for f in make_show(character, frames=5)]
    export(tmp_path / "b.glb", expressive(character), still)
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


def test_the_nodes_are_exactly_where_they_were(tmp_path: Path) -> None:
    character = make_tentacle()
    random = np.random.default_rng(3)
    show = [  # nodes that move and turn freely, beyond what rigid bones could do
        replace(
            frame,
            nodes=PosedNodes(
                frame.nodes.positions + random.normal(0, 0.05, (NODES, 3)),
                Rotation.random(NODES, rng=random).as_quat(),
            ),
        )
        for frame in make_show(character, frames=6)
    ]
    export(tmp_path / "a.glb", character, show)
    player = Player(tmp_path / "a.glb")
    for frame in show:
        matrices = player.node_matrices(frame.time)[:NODES]
        np.testing.assert_allclose(matrices[:, :3, 3], frame.nodes.positions, atol=1e-5)
        turns = Rotation.from_quat(frame.nodes.rotations).as_matrix()
        np.testing.assert_allclose(matrices[:, :3, :3], turns, atol=1e-5)


def test_what_is_exported_plays_back(tmp_path: Path) -> None:
    character = make_tentacle()
    show = make_show(character)
    export(tmp_path / "a.glb", character, show)
    recording = read_recording(tmp_path / "a.glb")
    places = [recording.skeleton.index(name) for name in character.skeleton.names]
    assert len(recording) == len(show)
    assert recording.times[-1] == pytest.approx(show[-1].time - show[0].time, abs=1e-5)
    expected = np.array([frame.nodes.positions for frame in show])
    played = recording.positions[:, places]
    np.testing.assert_allclose(
        played - played[:1, :1], expected - expected[:1, :1], atol=1e-5 * HEIGHT
    )


def test_weights_of_the_file_are_kept(tmp_path: Path) -> None:
    character = make_tentacle()
    random = np.random.default_rng(0)
    weights = random.dirichlet(np.ones(3), len(character.vertices))
    columns = np.array([random.permutation(NODES)[:3] for _ in weights])
    rows = np.repeat(np.arange(len(weights)), 3)
    matrix = csr_array((weights.ravel(), (rows, columns.ravel())), (len(weights), NODES))
    export(tmp_path / "a.glb", replace(character, weights=matrix), make_show(character, frames=2))
    player = Player(tmp_path / "a.glb")
    attributes = player.gltf.meshes[0].primitives[0].attributes
    written = np.zeros((len(character.surface.vertex), NODES))
    nodes = player.array(attributes.JOINTS_0)
    np.add.at(written, (np.arange(len(nodes))[:, None], nodes), player.array(attributes.WEIGHTS_0))
    np.testing.assert_allclose(written, matrix.toarray()[character.surface.vertex], atol=1e-6)


def test_other_readers_see_the_mesh_and_its_materials(tmp_path: Path) -> None:
    character = make_tentacle()
    export(tmp_path / "a.glb", character, make_show(character, frames=3))
    scene = trimesh.load_scene(tmp_path / "a.glb")
    assert sum(len(mesh.faces) for mesh in scene.geometry.values()) == len(character.faces)
    placed = scene.to_mesh()
    placed.merge_vertices(merge_tex=True, merge_norm=True)
    assert placed.is_watertight
    np.testing.assert_allclose(placed.bounds[1] - placed.bounds[0], [0.3, HEIGHT, 0.3], atol=1e-6)
    assert placed.volume > 0
    materials = [mesh.visual.material for mesh in scene.geometry.values()]
    assert {material.baseColorTexture is None for material in materials} == {True, False}
    textured = next(m for m in materials if m.baseColorTexture is not None)
    assert np.asarray(textured.baseColorTexture.convert("RGB"))[0, 0].tolist() == [255, 128, 0]


def test_equal_shows_give_equal_bytes(tmp_path: Path) -> None:
    character = make_tentacle()
    for name in ("a.glb", "b.glb"):
        export(tmp_path / name, character, make_show(character, frames=3))
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


@pytest.mark.parametrize("frames", [0, 1, 2])
def test_short_shows_are_valid(tmp_path: Path, frames: int) -> None:
    character = make_tentacle()
    show = make_show(character, frames=frames)
    export(tmp_path / "a.glb", character, [*show, *show[-1:]])  # the last time comes twice
    data = (tmp_path / "a.glb").read_bytes()
    length, kind = struct.unpack_from("<I4s", data, 12)
    document = json.loads(data[20 : 20 + length])
    assert kind == b"JSON"
    assert len(data) % 4 == 0
    assert struct.unpack_from("<I", data, 8)[0] == len(data)
    for sampler in document.get("animations", [{"samplers": []}])[0]["samplers"]:
        assert document["accessors"][sampler["input"]]["count"] == frames
    Player(tmp_path / "a.glb").vertices(0.0)


def test_rotations_do_not_take_the_long_way(tmp_path: Path) -> None:
    character = make_tentacle()
    random = np.random.default_rng(0)
    show = [
        replace(
            frame,
            nodes=replace(frame.nodes, rotations=frame.nodes.rotations * signs[:, None]),
        )
        for frame, signs in zip(
            make_show(character), random.choice([-1, 1], (40, NODES)), strict=True
        )
    ]
    export(tmp_path / "a.glb", character, show)
    player = Player(tmp_path / "a.glb")
    animation = player.gltf.animations[0]
    turning = [c.sampler for c in animation.channels if c.target.path == "rotation"]
    assert turning
    for sampler in turning:
        values = player.array(animation.samplers[sampler].output)
        assert np.sum(values[1:] * values[:-1], axis=1).min() > 0.9


def test_a_long_show_is_fitted_to_all_of_it(tmp_path: Path) -> None:
    character = make_tentacle()
    moving = make_show(character, frames=60)
    still = [replace(moving[0], time=2 + index / 30) for index in range(600)]
    export(tmp_path / "a.glb", character, moving + still)
    player = Player(tmp_path / "a.glb")
    late = moving[-1]  # long gone when the show ends
    expected = late.vertices[character.surface.vertex]
    np.testing.assert_allclose(player.vertices(late.time), expected, atol=0.003 * HEIGHT)


def test_another_suffix_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.glb"):
        GltfExport(tmp_path / "a.fbx", make_tentacle())
