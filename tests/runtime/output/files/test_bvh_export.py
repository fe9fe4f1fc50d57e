"""BVH export: the performed motion comes back from the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.bvh.motion import forward_kinematics
from replay.bvh.reader import read_bvh
from replay.bvh.text import read_bvh_text
from runtime.characters.character import Character
from runtime.driving.targets import PosedNodes
from runtime.output.files.bvh_export import BvhExport
from runtime.output.output import PerformedFrame
from tests.runtime.output.files.bvh_player import BvhPlayer
from tests.runtime.tentacle import HEIGHT, NODES, make_show, make_tentacle


def export(
    path: Path, character: Character, show: list[PerformedFrame], within: float | None = None
) -> BvhExport:
    with BvhExport(path, character, within=within) as output:
        for frame in show:
            output.write(frame)
    return output


def read(path: Path) -> tuple[list[str], NDArray[np.float64], NDArray[np.float64], float]:
    """Joint names, positions (T, J, 3) [m], rotations (T, J, 4), frame time [s]; no end sites."""
    text = read_bvh_text(path)
    positions, rotations = forward_kinematics(text)
    joints = [index for index, joint in enumerate(text.joints) if joint.channels]
    names = [text.joints[joint].name for joint in joints]
    return names, positions[:, joints] / 100, rotations[:, joints], text.frame_time


def test_a_rigid_chain_comes_back_exactly(tmp_path: Path) -> None:
    character = make_tentacle()
    show = make_show(character)
    export(tmp_path / "a.bvh", character, show)
    names, positions, rotations, step = read(tmp_path / "a.bvh")
    assert names == [f"node_{k}" for k in range(NODES)]
    assert step == pytest.approx(1 / 30, abs=1e-8)
    expected = np.stack([frame.nodes.positions for frame in show])
    np.testing.assert_allclose(positions, expected, atol=1e-6)
    turns = Rotation.from_quat(np.stack([frame.nodes.rotations for frame in show]))
    assert (turns.inv() * Rotation.from_quat(rotations)).magnitude().max() < 1e-5


def test_bones_point_where_the_nodes_are_whatever_the_nodes_rotations_say(tmp_path: Path) -> None:
    character = make_tentacle()
    show = [
        replace(
            frame,
            nodes=replace(frame.nodes, rotations=np.roll(frame.nodes.rotations, 1, axis=0)),
        )
        for frame in make_show(character)
    ]
    export(tmp_path / "a.bvh", character, show)
    positions = read(tmp_path / "a.bvh")[1]
    expected = np.stack([frame.nodes.positions for frame in show])
    np.testing.assert_allclose(positions, expected, atol=1e-5)


def test_a_branching_skeleton_comes_back_with_its_limbs(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    parents = np.array([1, -1, 1, 2, 2, 0])  # the root is not the first
    rest = random.normal(size=(6, 3))
    skeleton = Skeleton(tuple("abcdef"), parents, rest)
    character = replace(make_tentacle(), skeleton=skeleton)
    show = []
    for frame in make_show(make_tentacle(), frames=8):
        turns = Rotation.random(6, rng=random)
        positions = np.zeros((6, 3))
        for node in skeleton.order:
            if parents[node] >= 0:
                bone = turns[int(parents[node])].apply(rest[node] - rest[parents[node]])
                positions[node] = positions[parents[node]] + bone
        show.append(replace(frame, nodes=PosedNodes(positions, turns.as_quat())))
    export(tmp_path / "a.bvh", character, show)
    names, positions, _, _ = read(tmp_path / "a.bvh")
    assert names == ["b", "a", "f", "c", "d", "e"]
    order = [skeleton.index(name) for name in names]
    expected = np.stack([frame.nodes.positions[order] for frame in show])
    np.testing.assert_allclose(positions, expected, atol=1e-5)


def stretching(character: Character) -> list[PerformedFrame]:
    """A show in which the last bone grows to twice its length."""
    show = []
    for frame in make_show(character):
        positions = frame.nodes.positions.copy()
        positions[-1] += frame.index / 39 * (positions[-1] - positions[-2])
        show.append(replace(frame, nodes=replace(frame.nodes, positions=positions)))
    return show


def furthest(path: Path, show: list[PerformedFrame]) -> float:
    """How far a joint is from its node at most [m], as another program plays the file."""
    player = BvhPlayer(path)
    off = [
        np.linalg.norm(0.01 * player.positions(number)[f"node_{node}"] - place)
        for number, frame in enumerate(show)
        for node, place in enumerate(frame.nodes.positions)
    ]
    return float(np.max(off))


def test_rigid_bones_are_told_by_how_much_they_are_off(tmp_path: Path) -> None:
    character = make_tentacle()
    show = stretching(character)
    output = export(tmp_path / "a.bvh", character, show)
    bone = HEIGHT / (NODES - 1)
    assert furthest(tmp_path / "a.bvh", show) == pytest.approx(bone, rel=1e-3)
    assert output.error == f"joints within {1e3 * bone:.0f} mm"


def test_a_joint_whose_bone_grows_slides_where_that_is_asked_for(tmp_path: Path) -> None:
    character = make_tentacle()
    show = stretching(character)
    output = export(tmp_path / "a.bvh", character, show, 1e-4)
    assert furthest(tmp_path / "a.bvh", show) < 1e-4 * HEIGHT
    assert float(output.error.split()[2]) < 0.1 * HEIGHT
    assert (tmp_path / "a.bvh").read_text().count("CHANNELS 6") == 2, "the root and the last joint"
    np.testing.assert_allclose(read(tmp_path / "a.bvh")[1][39], show[39].nodes.positions, atol=1e-6)


def test_jitter_and_gaps_keep_their_timing(tmp_path: Path) -> None:
    character = make_tentacle()
    show = [frame for frame in make_show(character, frames=60) if not 20 <= frame.index < 40]
    show = [replace(frame, time=frame.time + 0.002 * np.sin(frame.index)) for frame in show]
    export(tmp_path / "a.bvh", character, show)
    _, positions, _, step = read(tmp_path / "a.bvh")
    length = show[-1].time - show[0].time
    assert (len(positions) - 1) * step == pytest.approx(length, abs=1e-5)
    assert step == pytest.approx(1 / 30, rel=0.05)
    late = show[30]
    shown = positions[round((late.time - show[0].time) / step)]
    np.testing.assert_allclose(shown, late.nodes.positions, atol=0.02)


def test_angles_do_not_jump(tmp_path: Path) -> None:
    character = make_tentacle()
    spins = Rotation.from_euler("y", np.arange(0, 900, 9)[:, None], degrees=True)
    show = [
        replace(
            frame,
            nodes=PosedNodes(
                spin.apply(np.array(character.skeleton.rest_positions)),
                np.tile(spin.as_quat(), (NODES, 1)),
            ),
        )
        for frame, spin in zip(make_show(character, frames=len(spins)), spins, strict=True)
    ]
    export(tmp_path / "a.bvh", character, show)
    assert np.abs(np.diff(read_bvh_text(tmp_path / "a.bvh").motion, axis=0)).max() < 10


@pytest.mark.parametrize("frames", [1, 2])
def test_short_shows_can_be_replayed(tmp_path: Path, frames: int) -> None:
    character = make_tentacle()
    export(tmp_path / "a.bvh", character, make_show(character, frames=frames))
    recording = read_bvh(tmp_path / "a.bvh")
    assert len(recording) == frames
    bones = np.linalg.norm(np.diff(recording.positions[:, :NODES], axis=1), axis=2)
    np.testing.assert_allclose(bones, 0.2, atol=1e-6)  # metres again


def test_names_that_would_end_early_or_meet_are_mended(tmp_path: Path) -> None:
    character = make_tentacle()
    names = ("a b", "a_b", "a{b", "{", " ", "mixamorig:Hips", "é")
    skeleton = Skeleton(names, character.skeleton.parents, character.skeleton.rest_positions)
    character = replace(character, skeleton=skeleton)
    export(tmp_path / "a.bvh", character, make_show(character, frames=2))
    found = read(tmp_path / "a.bvh")[0]
    assert len(set(found)) == NODES
    assert found[0] == "a_b"
    assert found[5:] == ["mixamorig:Hips", "é"]


def test_a_very_long_chain_is_no_trouble(tmp_path: Path) -> None:
    count = 3000
    rest = np.linspace([0, 0, 0], [0, 1, 0], count)
    skeleton = Skeleton(tuple(f"n{k}" for k in range(count)), np.arange(count) - 1, rest)
    character = replace(make_tentacle(), skeleton=skeleton)
    BvhExport(tmp_path / "a.bvh", character).close()
    text = (tmp_path / "a.bvh").read_text()
    assert text.count("{") == text.count("}") == count + 1


def test_another_suffix_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.bvh"):
        BvhExport(tmp_path / "a.txt", make_tentacle())
