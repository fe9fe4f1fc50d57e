"""Real BVH files: bones of one length, people upright, an elephant on four feet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.bodies.joint_labels import first_of, label_joints
from devices.bodies.joint_names import Kind, Side
from replay.formats import read_recording
from replay.recording import Recording
from tests.replay.bvh.sound_recording import assert_sound


def bvh_files(shared: Path) -> list[Path]:
    return sorted((shared / "bvh").glob("*.bvh"))


def test_every_shared_recording_keeps_its_bones_and_frames(shared: Path) -> None:
    for path in bvh_files(shared):
        recording = read_recording(path)
        assert_sound(recording)
        _, lines = path.read_text(encoding="utf-8", errors="replace").split("Frame Time")
        assert len(recording) == sum(bool(line.strip()) for line in lines.splitlines()[1:]), path
        if "bandai" in path.name or "elephant" in path.name:
            continue  # these move joints in their parents' frames
        skeleton = recording.skeleton
        for joint, parent in enumerate(skeleton.parents):
            bones = recording.positions[:, joint] - recording.positions[:, parent]
            lengths = np.linalg.norm(bones, axis=1)
            assert np.ptp(lengths) < 1e-6 or parent == -1, (path.name, skeleton.names[joint])


def test_every_shared_person_stands_upright_facing_the_front(shared: Path) -> None:
    for path in bvh_files(shared):
        recording = read_recording(path)
        skeleton, parts = recording.skeleton, label_joints(recording.skeleton)
        if "elephant" in path.name or "full_precision" in path.name:
            continue
        assert_stands(recording)
        head = first_of(parts, skeleton, Kind.HEAD)
        hands = [first_of(parts, skeleton, Kind.HAND, side) for side in (Side.LEFT, Side.RIGHT)]
        for pose in (recording.positions[0], skeleton.rest_positions):
            assert pose[hands[0], 0] > pose[hands[1], 0], path.name
        if "dash" not in path.name:  # starts crouched
            assert 1.2 < recording.positions[0, head, 1] < 1.9, path.name
        assert recording.positions[..., 1].min() == pytest.approx(0, abs=1e-9)


def assert_stands(recording: Recording) -> None:
    """Head above hips above feet, at the start; shoulders and hips with the left on +X."""
    skeleton, parts = recording.skeleton, label_joints(recording.skeleton)
    start = recording.positions[0]

    def at(kind: Kind, side: Side = Side.CENTRE) -> np.ndarray:
        joint = first_of(parts, skeleton, kind, side)
        assert joint is not None, kind
        return start[joint]

    feet = [at(Kind.FOOT, side) for side in (Side.LEFT, Side.RIGHT)]
    assert at(Kind.HEAD)[1] > at(Kind.HIPS)[1] > max(foot[1] for foot in feet)
    for kind in (Kind.UPPER_ARM, Kind.UPPER_LEG):
        across = at(kind, Side.LEFT) - at(kind, Side.RIGHT)
        assert across[0] > 0.6 * np.linalg.norm(across), kind


def test_the_elephant_keeps_its_size_and_stands_on_four_feet(shared: Path) -> None:
    recording = read_recording(shared / "bvh" / "truebones_elephant_idle1.bvh")
    at = recording.skeleton.index
    start = recording.positions[0]
    assert 2.0 < np.ptp(start[:, 2]) < 4.0
    assert start[at("Bip01_Head"), 2] > start[at("Bip01_Pelvis"), 2] + 1.0
    for foot in ("Bip01_L_Foot", "Bip01_R_Foot", "Bip01_L_Hand", "Bip01_R_Hand"):
        assert start[at(foot), 1] < 0.4
