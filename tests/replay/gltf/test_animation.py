"""glTF animations as recordings: interpolation, sparse keys, humanoids, units, damage."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import Kind
from devices.errors import InputError
from replay.formats import read_recording, recognise
from replay.gltf.reader import animations_in
from replay.recording import Recording
from replay.stated import Stated

HALF = float(np.sqrt(0.5))


class Clip:
    """A glTF document of two nodes, "hip" at 1 m and "knee" 0.5 m below it, with channels."""

    def __init__(self, **top: Any) -> None:
        self.data = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "nodes": [
                {"name": "hip", "translation": [0, 1, 0], "children": [1]},
                {"name": "knee", "translation": [0, -0.5, 0]},
            ],
            "bufferViews": [],
            "accessors": [],
            "animations": [{"name": "walk", "samplers": [], "channels": []}],
            **top,
        }

    def view(self, values: np.ndarray) -> int:
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes}
        )
        self.data += values.tobytes() + b"\0" * (-values.nbytes % 4)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: Any, **more: Any) -> int:
        rows = np.array(values, dtype=np.float32)
        kind = "SCALAR" if rows.ndim == 1 else f"VEC{rows.shape[1]}"
        entry = {"componentType": 5126, "count": len(rows), "type": kind, **more}
        if "sparse" not in more:
            entry["bufferView"] = self.view(rows)
        self.document["accessors"].append(entry)
        return len(self.document["accessors"]) - 1

    def move(self, node: int, path: str, times: Any, values: Any, way: str | None = None) -> None:
        animation = self.document["animations"][0]
        output = values if isinstance(values, int) else self.accessor(values)
        sampler: dict[str, Any] = {"input": self.accessor(times), "output": output}
        if way is not None:
            sampler["interpolation"] = way
        animation["samplers"].append(sampler)
        target = {"node": node, "path": path}
        number = len(animation["samplers"]) - 1
        animation["channels"].append({"sampler": number, "target": target})

    def save(self, folder: Path, name: str = "walk.gltf") -> Path:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        document = self.document | {"buffers": [{"byteLength": len(self.data), "uri": uri}]}
        (folder / name).write_text(json.dumps(document))
        return folder / name


def small_valid_file(folder: Path) -> Path:
    clip = Clip()
    clip.move(0, "translation", [0.0, 1.0], [[0, 1, 0], [0, 1, 2]])
    return clip.save(folder)


def at(recording: Recording, name: str) -> np.ndarray:
    """The way of a joint since the first frame."""
    way = recording.positions[:, recording.skeleton.index(name)]
    return way - way[0]


def test_straight_lines_are_sampled_sixty_times_a_second(tmp_path: Path) -> None:
    path = small_valid_file(tmp_path)
    recording = read_recording(path)
    assert recognise(path).name.startswith("glTF")
    assert len(recording) == 61
    np.testing.assert_allclose(recording.times, np.arange(61) / 60, atol=1e-9)
    np.testing.assert_allclose(at(recording, "hip")[30], [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(at(recording, "knee"), at(recording, "hip"), atol=1e-6)


def test_even_keys_are_the_frames(tmp_path: Path) -> None:
    clip = Clip()
    times = np.arange(20) / 24
    clip.move(0, "translation", times, [[0, 1, 3 * t] for t in times])
    recording = read_recording(clip.save(tmp_path))
    np.testing.assert_allclose(recording.times, times, atol=1e-5)


def test_rotations_take_the_shorter_way_at_constant_speed(tmp_path: Path) -> None:
    clip = Clip()
    clip.move(0, "rotation", [0.0, 1.0], [[0, 0, 0, 1], [-HALF, 0, 0, -HALF]])
    recording = read_recording(clip.save(tmp_path))
    knee = recording.positions[:, 1] - recording.positions[:, 0]
    angle = np.pi / 2 * np.arange(61) / 60
    expected = 0.5 * np.column_stack([0 * angle, -np.cos(angle), -np.sin(angle)])
    np.testing.assert_allclose(knee, expected, atol=1e-6)
    assert recording.rotations is not None
    np.testing.assert_allclose(np.abs(recording.rotations[60, 1]), [HALF, 0, 0, HALF], atol=1e-6)


def test_steps_hold_until_the_next_key(tmp_path: Path) -> None:
    clip = Clip()
    clip.move(0, "translation", [0.0, 0.5, 1.0], [[0, 1, 0], [0, 1, 1], [0, 1, 2]], "STEP")
    way = at(read_recording(clip.save(tmp_path)), "hip")[:, 2]
    assert way[[0, 29, 30, 59, 60]].tolist() == [0, 0, 1, 1, 2]


def test_cubic_splines_follow_their_tangents(tmp_path: Path) -> None:
    clip = Clip()
    keys = [[0, 0, 0], [0, 1, 0], [0, 0, 4], [0, 0, 8], [0, 1, 1], [0, 0, 0]]
    clip.move(0, "translation", [0.0, 2.0], keys, "CUBICSPLINE")
    way = at(read_recording(clip.save(tmp_path)), "hip")[:, 2]
    # p(1/2) = (p0 + p1) / 2 + 2 s (m0 - m1) / 8 = 0.5 + 2 (4 - 8) / 8
    assert way[60] == pytest.approx(-0.5, abs=1e-6)
    assert way[120] == pytest.approx(1.0, abs=1e-6)


def test_sparse_keys_replace_zeros(tmp_path: Path) -> None:
    clip = Clip()
    indices = clip.view(np.array([1], dtype=np.uint16))
    values = clip.view(np.array([[0, 0, 5]], dtype=np.float32))
    output = clip.accessor(
        np.zeros((3, 3)),
        sparse={
            "count": 1,
            "indices": {"bufferView": indices, "componentType": 5123},
            "values": {"bufferView": values},
        },
    )
    clip.move(0, "translation", [0.0, 0.5, 1.0], output)
    way = at(read_recording(clip.save(tmp_path)), "hip")[:, 2]
    assert way[[0, 30, 60]] == pytest.approx([0, 5, 0])


def test_scaled_and_turned_parents_carry_their_children(tmp_path: Path) -> None:
    clip = Clip()
    clip.document["nodes"][0] |= {"scale": [1, 3, 1], "rotation": [0, 0, HALF, HALF]}
    clip.move(1, "translation", [0.0, 1.0], [[0, -0.5, 0], [0, -0.25, 0]])
    clip.move(0, "translation", [0.0], [[0, 1, 0]])
    recording = read_recording(clip.save(tmp_path))
    bone = recording.positions[[0, 60], 1] - recording.positions[[0, 60], 0]
    np.testing.assert_allclose(bone, [[1.5, 0, 0], [0.75, 0, 0]], atol=1e-6)
    assert recording.rotations is None  # no rotation is left of a stretched axis


def test_a_body_in_centimetres_is_noted(tmp_path: Path) -> None:
    clip = Clip()
    clip.document["nodes"][1]["translation"] = [0, -100, 0]
    clip.move(0, "translation", [0.0, 1.0], [[0, 1, 0], [0, 1, 200]])
    path = clip.save(tmp_path)
    recording = read_recording(path)
    assert at(recording, "hip")[60, 2] == pytest.approx(2.0)
    assert any("--unit-input" in note for note in recording.notes)
    assert at(read_recording(path, Stated(unit="m")), "hip")[60, 2] == pytest.approx(200.0)


def test_the_first_animation_that_moves_is_taken(tmp_path: Path) -> None:
    clip = Clip()
    clip.move(0, "translation", [0.0, 1.0], [[0, 1, 0], [0, 1, 2]])
    first = clip.document["animations"][0]
    still = {
        "name": "rest",
        "samplers": [{"input": clip.accessor([0.0]), "output": clip.accessor([[0, 1, 0]])}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
    }
    clip.document["animations"] = [still, first]
    recording = read_recording(clip.save(tmp_path))
    assert len(recording) == 61
    said = "2 'walk'; by --animation-input: 1 'rest' (0.0 s)"
    assert recording.source == {"animation": said}
    assert animations_in(tmp_path / "walk.gltf") == "1 'rest' (0.0 s), 2 'walk' (1.0 s)"


def several(folder: Path) -> Path:
    clip = Clip()
    clip.move(0, "translation", [0.0, 1.0], [[0, 1, 0], [0, 1, 2]])
    for name, far in (("Run", 5.0), ("1", 7.0), ("", 9.0)):
        output = clip.accessor([[0, 1, 0], [0, 1, far]])
        clip.document["animations"].append(
            {
                "name": name,
                "samplers": [{"input": clip.accessor([0.0, 1.0]), "output": output}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            }
        )
    return clip.save(folder)


@pytest.mark.parametrize(
    ("wanted", "far"),
    [(None, 2.0), ("walk", 2.0), ("Run", 5.0), ("run", 5.0), ("2", 5.0), ("1", 7.0), ("4", 9.0)],
)
def test_an_animation_is_chosen_by_its_name_or_number(
    wanted: str | None, far: float, tmp_path: Path
) -> None:
    recording = read_recording(several(tmp_path), Stated(animation=wanted))
    assert at(recording, "hip")[60, 2] == pytest.approx(far)


@pytest.mark.parametrize("wanted", ["jump", "5", "0", "", "9" * 5000, "a\nb"])
def test_an_unknown_animation_is_answered_with_the_known_ones(wanted: str, tmp_path: Path) -> None:
    path = several(tmp_path)
    if wanted == "":
        assert len(read_recording(path, Stated(animation=wanted))) == 61  # the one without a name
        return
    with pytest.raises(InputError, match="it has 1 'walk'") as refused:
        read_recording(path, Stated(animation=wanted))
    assert "\n" not in str(refused.value)


def test_other_formats_have_no_animations_to_choose(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text("HIERARCHY")
    with pytest.raises(InputError, match="leave it out"):
        read_recording(tmp_path / "a.bvh", Stated(animation="walk"))


def test_lost_numbers_are_gaps(tmp_path: Path) -> None:
    clip = Clip()
    clip.move(1, "translation", np.arange(3) / 30, [[0, -1, 0], [0, np.nan, 0], [0, -1, 0]])
    clip.move(0, "translation", [0.0], [[0, 1, 0]])
    recording = read_recording(clip.save(tmp_path))
    assert recording.confidence.tolist() == [[1, 1], [1, 0], [1, 1]]


@pytest.mark.parametrize("way", ["STEP", "LINEAR"])
def test_a_rotation_that_is_none_is_a_gap(way: str, tmp_path: Path) -> None:
    clip = Clip()
    clip.move(0, "rotation", np.arange(3) / 30, [[0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 2]], way)
    recording = read_recording(clip.save(tmp_path))
    assert recording.confidence.tolist() == [[1, 1], [1, 0], [1, 1]]


@pytest.mark.parametrize(
    ("times", "values", "way", "says"),
    [
        ([0.0, 1.0], [[0, 1, 0]], None, "2 times and 1 values"),
        ([1.0, 0.0], [[0, 1, 0]] * 2, None, "do not rise"),
        ([0.0, np.nan], [[0, 1, 0]] * 2, None, "do not rise"),
        ([0.0, 1e30], [[0, 1, 0]] * 2, None, "no seconds"),
        ([0.0, 9e5], [[0, 1, 0]] * 2, None, "too many"),
        ([0.0, 1.0], [[0, 1, 0]] * 2, "CUBICSPLINE", "2 times and 2 values"),
        ([0.0, 1.0], [[0, 1, 0]] * 2, "SPLINE", "interpolation"),
        ([0.0, 1.0], [[0, 1, 0, 1]] * 2, None, "not of type VEC3"),
    ],
)
def test_damage_is_told_in_one_line(
    times: Any, values: Any, way: str | None, says: str, tmp_path: Path
) -> None:
    clip = Clip()
    clip.move(0, "translation", times, values, way)
    with pytest.raises(InputError, match=says) as refused:
        read_recording(clip.save(tmp_path))
    assert "walk.gltf" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_model_without_animation_is_a_character(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no animation"):
        read_recording(Clip(animations=[]).save(tmp_path))


def test_a_vrm_animation_has_the_bones_of_its_humanoid(shared: Path) -> None:
    path = shared / "vrma/three_vrm_test.vrma"
    recording = read_recording(path)
    parts = label_joints(recording.skeleton)
    assert {part.kind for part in parts if part} >= {Kind.HIPS, Kind.HEAD, Kind.HAND, Kind.TOES}
    assert recording.seconds == pytest.approx(3.0, abs=0.02)
    rest = recording.skeleton.rest_positions
    left, right = (recording.skeleton.index(f"{side}Hand") for side in ("left", "right"))
    assert rest[left, 0] > 0.5
    assert rest[right, 0] == pytest.approx(-rest[left, 0], abs=1e-3)
    assert recording.blends is not None
    assert {name for face in recording.blends if face for name in face} == {"happy"}
    assert max(face["happy"] for face in recording.blends if face) > 0.5


@pytest.mark.parametrize(
    ("name", "frames", "joints"),
    [("khronos_Fox.glb", 83, 24), ("raylib_robot_RobotExpressive.glb", 81, 43)],
)
def test_rigs_with_animations_are_recordings(
    name: str, frames: int, joints: int, shared: Path
) -> None:
    recording = read_recording(shared / "rig" / name)
    assert (len(recording), len(recording.skeleton.names)) == (frames, joints)
    assert np.isfinite(recording.positions).all()


def test_a_bird_that_is_level_at_rest_stays_level(shared: Path) -> None:
    skeleton = read_recording(shared / "rig/m2m_bird-animations.glb").skeleton
    hips, head, foot = skeleton.rest_positions[[*map(skeleton.index, ("hips", "head", "Foot_L"))]]
    spine, leg = head - hips, foot - hips
    assert spine[2] > 2.0 * abs(spine[1])
    assert leg[1] < -2.0 * abs(leg[2])
