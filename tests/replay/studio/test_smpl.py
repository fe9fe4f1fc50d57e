"""SMPL motion as joints: the T-pose, turned limbs, up axes, rates, hostile archives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.errors import InputError
from replay.formats import read_recording
from replay.recording import Recording
from replay.studio.smpl import NEUTRAL, ORDER

Z_UP = np.array([np.pi / 2, 0.0, 0.0])  # AMASS's root: +Y of the body to +Z of the room


def saved(folder: Path, poses: np.ndarray, **more: Any) -> Path:
    path = folder / "walk.npz"
    np.savez(path, poses=poses, trans=more.pop("trans", np.zeros((len(poses), 3))), **more)
    return path


def still(frames: int = 3, width: int = 156) -> np.ndarray:
    poses = np.zeros((frames, width))
    poses[:, :3] = Z_UP
    return poses


def at(recording: Recording, name: str, frame: int = 0) -> np.ndarray:
    return recording.positions[frame, recording.skeleton.index(name)]


@pytest.mark.parametrize("width", [66, 72, 156, 165])
def test_the_zero_pose_is_the_neutral_skeleton(width: int, tmp_path: Path) -> None:
    way = np.array([[0.0, 0, 0.9], [0, -0.5, 0.9], [0, -1.0, 0.9]])  # AMASS faces -Y then
    path = saved(tmp_path, still(3, width), trans=way, mocap_framerate=120.0, gender="female")
    recording = read_recording(path)
    rest = NEUTRAL.rest_positions
    expected = rest - [0, rest[:, 1].min(), 0]
    np.testing.assert_allclose(recording.positions[0], expected, atol=1e-9)
    np.testing.assert_allclose(
        at(recording, "Pelvis", 2) - at(recording, "Pelvis"), [0, 0, 1.0], atol=1e-9
    )
    np.testing.assert_allclose(recording.times, [0, 1 / 120, 2 / 120])
    assert recording.rotations is not None
    np.testing.assert_allclose(np.abs(recording.rotations[..., 3]), 1.0, atol=1e-9)


def test_a_bent_elbow_moves_the_wrist_forward(tmp_path: Path) -> None:
    poses = still()
    elbow = 3 * ORDER.index("L_Elbow")
    poses[1, elbow : elbow + 3] = [0, -np.pi / 2, 0]
    recording = read_recording(saved(tmp_path, poses, mocap_frame_rate=60))
    forearm = at(recording, "L_Wrist", 1) - at(recording, "L_Elbow", 1)
    np.testing.assert_allclose(forearm, [0, 0, 0.25], atol=1e-9)
    np.testing.assert_allclose(at(recording, "L_Elbow", 1), at(recording, "L_Elbow", 0), atol=1e-9)


def test_a_body_with_y_up_and_no_rate(tmp_path: Path) -> None:
    recording = read_recording(saved(tmp_path, np.zeros((2, 72))))
    assert at(recording, "Head")[1] == pytest.approx(1.5)
    assert recording.times.tolist() == [0, 1 / 30]
    assert any("--fps-input" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("poses", "more"),
    [
        (np.zeros((3, 10)), {}),
        (np.zeros((0, 72)), {}),
        (np.full((2, 72), np.nan), {}),
        (np.full((2, 72), 1e300), {}),
        (np.zeros((2, 72)), {"trans": np.zeros((3, 3))}),
        (np.array([{"a": 1}], dtype=object), {}),
    ],
)
def test_other_arrays_are_refused_in_one_line(
    poses: np.ndarray, more: dict[str, Any], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="not those of an SMPL body"):
        read_recording(saved(tmp_path, poses, **more))
