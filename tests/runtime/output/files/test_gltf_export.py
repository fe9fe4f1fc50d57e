"""glTF export: the animated character comes back from the file."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from replay.formats import read_recording
from runtime.characters.character import Character
from runtime.characters.morphs import Morphs
from runtime.driving.targets import PosedNodes
from runtime.output.files.gltf_export import GltfExport
from runtime.output.output import PerformedFrame
from solvers.deform.morph_targets import MorphTargets
from tests.runtime.output.files.glb_player import Player
from tests.runtime.tentacle import HEIGHT, NODES, disk_of, make_show, make_tentacle


def export(
    path: Path, character: Character, show: list[PerformedFrame], within: float | None = None
) -> GltfExport:
    with GltfExport(path, character, within=within) as output:
        for frame in show:
            output.write(frame)
    return output


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


def wobbling(character: Character, frames: int = 100) -> list[PerformedFrame]:
    """A show whose surface leaves what a skin can reach, each frame in its own way."""
    x, y, z = character.vertices.T
    show = []
    for frame in make_show(character, frames=frames):
        wave = np.sin(9.0 * y + 0.3 * frame.index) * np.clip(y - 0.3 * HEIGHT, 0.0, None)
        off = 0.2 * wave[:, None] * np.stack([z, 0.0 * y, x], axis=1)
        show.append(replace(frame, vertices=frame.vertices + off))
    return show


@pytest.mark.parametrize("within", [4e-3, 1e-3, 1e-4])
def test_corrective_shapes_bring_the_surface_to_the_stated_distance(
    tmp_path: Path, within: float
) -> None:
    character = make_tentacle()
    show = wobbling(character)
    skin_alone = export(tmp_path / "s.glb", character, show)
    assert skin_alone.deviation.greatest > 5e-3 * HEIGHT
    output = export(tmp_path / "a.glb", character, show, within)
    player = Player(tmp_path / "a.glb")
    off = [
        np.linalg.norm(
            player.vertices(frame.time) - frame.vertices[character.surface.vertex], axis=1
        )
        for frame in show
    ]
    assert np.max(off) < within * HEIGHT
    assert output.deviation.greatest >= np.max(off) - 2e-6 * HEIGHT
    assert output.deviation.rms >= np.sqrt(np.mean(np.square(off))) - 2e-6 * HEIGHT
    names = (player.gltf.meshes[0].extras or {}).get("targetNames", [])
    assert output.error.endswith(f"by a skin and {len(names)} corrective shapes")
    assert len(names) < 20, "far fewer shapes than frames"
    weights = np.array([player.morph_weights(frame.time) for frame in show])
    assert weights.size == 0 or (weights.min() >= 0.0 and weights.max() <= 1.0)


def test_corrective_shapes_leave_out_vertices_that_need_none(tmp_path: Path) -> None:
    character = make_tentacle()
    export(tmp_path / "a.glb", character, wobbling(character), 1e-3)
    player = Player(tmp_path / "a.glb")
    targets = player.gltf.meshes[0].primitives[0].targets
    corrected = {player.gltf.accessors[each["POSITION"]].sparse.count for each in targets}
    assert len(corrected) == 1
    assert 0 < corrected.pop() < 0.9 * len(character.surface.vertex)


def test_a_skin_that_is_near_enough_gets_no_shapes(tmp_path: Path) -> None:
    character = make_tentacle()
    output = export(tmp_path / "a.glb", character, make_show(character), 1e-2)
    assert not Player(tmp_path / "a.glb").gltf.meshes[0].primitives[0].targets
    assert output.error.endswith("by a skin and 0 corrective shapes")


def test_corrective_shapes_come_after_the_faces_morphs(tmp_path: Path) -> None:
    character = expressive(make_tentacle())
    targets = character.morphs.targets
    own = slice(targets.starts[1], targets.starts[2])
    show = []
    for index, plain in enumerate(wobbling(character, 40)):
        weight = 0.5 - 0.5 * np.cos(0.3 * index)
        wide = plain.vertices.copy()
        wide[targets.vertices[own]] += weight * targets.deltas[own]
        show.append(replace(plain, vertices=wide, weights=np.array([0.0, weight])))
    export(tmp_path / "b.glb", character, show, 1e-4)
    player = Player(tmp_path / "b.glb")
    names = player.gltf.meshes[0].extras["targetNames"]
    assert names[:2] == ["wide", "corrective 1"]
    for frame in (show[0], show[11], show[17], show[-1]):
        expected = frame.vertices[character.surface.vertex]
        np.testing.assert_allclose(player.vertices(frame.time), expected, atol=1e-4 * HEIGHT)


def test_vertices_that_a_skin_would_flatten_are_corrected_too(tmp_path: Path) -> None:
    character = make_tentacle()
    show = []
    for frame in make_show(character, frames=30):  # every second node turns over by half a turn
        twist = Rotation.from_euler("y", np.where(np.arange(NODES) % 2, 6.0 * frame.index, 0.0)
                                    [:, None], degrees=True)  # fmt: skip
        nodes = PosedNodes(character.skeleton.rest_positions, twist.as_quat())
        show.append(replace(frame, vertices=character.vertices, nodes=nodes))
    export(tmp_path / "a.glb", character, show, 1e-4)
    player = Player(tmp_path / "a.glb")
    for frame in show[::5] + show[-1:]:
        off = player.vertices(frame.time) - character.vertices[character.surface.vertex]
        assert np.linalg.norm(off, axis=1).max() < 1e-4 * HEIGHT


@pytest.mark.parametrize("frames", [0, 1, 2])
def test_short_shows_are_corrected(tmp_path: Path, frames: int) -> None:
    character = make_tentacle()
    show = wobbling(character, frames)
    export(tmp_path / "a.glb", character, [*show, *show[-1:]], 1e-4)
    player = Player(tmp_path / "a.glb")
    for frame in show:
        expected = frame.vertices[character.surface.vertex]
        np.testing.assert_allclose(player.vertices(frame.time), expected, atol=1e-4 * HEIGHT)


def test_a_full_disk_leaves_no_corrected_file(tmp_path: Path) -> None:
    character = make_tentacle()
    output = GltfExport(tmp_path / "a.glb", character, within=1e-4)
    show = make_show(character, frames=400)
    with disk_of(200_000), pytest.raises(InputError, match=r"cannot write .*a\.glb"):
        list(map(output.write, show))
    output.close()
    assert list(tmp_path.iterdir()) == []


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
