"""A body's frames through all steps: what faults become, and that clean ones stay as they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from replay.builtin import builtin_recording
from replay.formats import read_recording
from runtime.conditioning.body_anatomy import body_anatomy
from runtime.conditioning.exact_joints import ExactJoints
from runtime.conditioning.switches import (
    for_live,
    for_recording,
)
from tests.runtime.conditioning.conditioned_frames import (
    STEP,
    clean,
    conditioned,
    frame,
    frames_of,
    jitter,
    jumps,
    limb,
    places,
    show,
    spoilt,
)
from tests.runtime.stick_figures import BODY, T_POSE, pose


def test_what_is_clean_passes_a_recordings_conditioning_to_the_last_bit() -> None:
    recording = builtin_recording("show")
    frames = frames_of(recording, 600)
    for each, out in zip(
        frames, conditioned(frames, for_recording(), recording.skeleton), strict=True
    ):
        np.testing.assert_array_equal(out.positions, each.positions)
        assert not (out.filled | out.corrected | out.predicted).any()
        assert (out.mirrored, out.scale) == (False, 1.0)


def test_what_is_clean_is_hardly_changed_by_a_live_streams_conditioning() -> None:
    frames = show()
    out = places(conditioned(frames, for_live(), builtin_recording("show").skeleton))
    raw = np.array([each.positions for each in frames])
    assert np.linalg.norm(out - raw, axis=2).mean() < 0.015
    still = np.linalg.norm(np.diff(raw, axis=0), axis=2)[:20].max()
    assert np.abs(out - raw)[:20].max() < 0.02 + still


@pytest.mark.parametrize(
    "name",
    [
        "bvh/cmu1_jumping_jacks_animdraw.bvh",
        "bvh/cmu_01_01_forward_jumps.bvh",
        "bvh/mixamo_joe_walk_in_circle.bvh",
        "bvh/fair1_dab.bvh",
        "bvh/pymo_8walk_meredith.bvh",
        "leap/leapjs_playback/wave.json.lz",
    ],
)
def test_clean_motion_capture_passes_to_the_last_bit(shared: Path, name: str) -> None:
    recording = read_recording(shared / name)
    for each, out in zip(
        frames_of(recording),
        conditioned(frames_of(recording), for_recording(), recording.skeleton),
        strict=True,
    ):
        np.testing.assert_array_equal(out.positions, each.positions)


@pytest.mark.parametrize(
    "name",
    [
        "rig/raylib_robot_RobotExpressive.glb",  # a hand turns by three metres in a frame
        "rig/m2m_spider-animations.glb",
        "bvh/cmu_daz_salsa_10.bvh",  # loops: the whole body jumps
    ],
)
def test_exact_joints_are_believed_however_fast(shared: Path, name: str) -> None:
    recording = read_recording(shared / name)
    frames = [recording.frame(index) for index in range(len(recording))]
    out = conditioned(frames, for_recording(), recording.skeleton)
    np.testing.assert_array_equal(places(out), recording.positions)
    measured = [replace(each, rotations=None) for each in frames]
    out = conditioned(measured, for_recording(), recording.skeleton)
    assert np.abs(places(out) - recording.positions).max() > 0.5, "a sensor's are not"


def test_joints_whose_rotations_do_not_carry_them_are_measured() -> None:
    """Noise of half a millimetre is enough, and frames that come twice prove nothing."""
    rng = np.random.default_rng(1)
    recording = builtin_recording("walk")
    exact, noisy = ExactJoints(recording.skeleton), ExactJoints(recording.skeleton)
    for index in range(20):
        own = recording.frame(index)
        assert exact.watch(own.positions, own.rotations) == (index > 0)
        off = own.positions + rng.normal(scale=5e-4, size=own.positions.shape)
        assert not noisy.watch(off, own.rotations)
        assert not noisy.watch(off, own.rotations)
        assert not noisy.watch(off, None)


def test_a_glitchy_kinect_is_calmed(shared: Path) -> None:
    """Its hidden legs jump by a metre and a half."""
    recording = read_recording(shared / "kinect/v2_laban/joints.csv")
    out = conditioned(frames_of(recording), for_recording(), recording.skeleton)
    assert jumps(recording.positions) > 1.5
    assert jumps(places(out)) < 0.6
    assert jitter(places(out)) < 0.6 * jitter(recording.positions)
    touched = np.mean([each.corrected.any() for each in out])
    assert 0.0 < touched < 0.2, "and most frames are as they were"


def test_two_people_under_one_number_are_told_apart(shared: Path) -> None:
    """In a part of this one, every other capture is of somebody else."""
    recording = read_recording(shared / "kinect/v1_utkinect/joints_s03_e01.txt")
    frames = [recording.frame(index) for index in range(480, 530)]
    out = conditioned(frames, for_recording(), recording.skeleton)
    assert jumps(recording.positions[480:530]) > 1.4
    assert jumps(places(out)) < 0.6


@pytest.mark.parametrize("which", ["whole", "arms", "legs"])
@pytest.mark.parametrize("count", [1, 8])
def test_exchanged_limbs_are_put_right(shared: Path, which: str, count: int) -> None:
    recording = clean(shared)
    body = body_anatomy(recording.skeleton)
    arms, legs = np.isin(body.group, (0, 1, 2)), np.isin(body.group, (3, 4, 5))
    chosen = {"whole": arms | legs, "arms": arms, "legs": legs}[which]
    assert chosen.sum() > 4

    def exchange(positions: np.ndarray) -> np.ndarray:
        return np.where(chosen[:, None], positions[body.partner], positions)

    at = slice(40, 40 + count)
    frames = spoilt(recording, at, exchange)
    out = conditioned(frames, for_recording(), recording.skeleton)
    error = np.linalg.norm(places(out) - recording.positions, axis=2)
    raw = np.linalg.norm(np.array([f.positions for f in frames]) - recording.positions, axis=2)
    assert raw.max() > 0.5
    assert error.max() < 0.2
    assert error[at].mean() < 0.1 * raw[at].mean()
    ends = chosen & (raw[at].min(axis=0) > 0.25)
    assert np.array([each.corrected for each in out[at]])[:, ends].all(), "and it is told"
    assert not any(each.corrected.any() for each in out[:40])


def test_a_device_that_insists_is_believed_in_the_end(shared: Path) -> None:
    recording = clean(shared)
    partner = body_anatomy(recording.skeleton).partner
    frames = spoilt(recording, slice(20, 125), lambda positions: positions[partner])
    out = conditioned(frames, for_recording(), recording.skeleton)
    # It had said otherwise for 20 frames: 0.67 s.
    np.testing.assert_array_equal(out[-1].positions, frames[-1].positions)
    assert out[25].corrected.any()


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("words", [("LFingers",), ("RightElbow",), ("Head",), ("LeftAnkle",)])
def test_outliers_are_not_believed(shared: Path, count: int, words: tuple[str, ...]) -> None:
    recording = clean(shared)
    joint = limb(recording, *words)[0]

    def push(positions: np.ndarray) -> np.ndarray:
        positions[joint] += [0.9, 0.7, -0.8]
        return positions

    at = slice(60, 60 + count)
    out = conditioned(spoilt(recording, at, push), for_recording(), recording.skeleton)
    error = np.linalg.norm(places(out) - recording.positions, axis=2)
    assert error.max() < 0.25
    assert all(each.filled[joint] and each.corrected[joint] for each in out[at])
    names, parents = recording.skeleton.names, recording.skeleton.parents
    toes = [k for k in range(len(names)) if "Toe" in names[k] and joint in (parents[k], k - 2)]
    other = ~np.isin(np.arange(len(names)), [joint, *toes])  # a foot goes along with its ankle
    assert error[:60].max() == 0.0
    assert error[:, other].max() < 1e-12


def test_a_joint_that_stays_where_it_jumped_is_believed_there() -> None:
    there = pose(T_POSE)
    moved = there.copy()
    head = BODY.index("Head")
    moved[head] += [0.0, 0.0, 0.7]
    frames = [frame(there, i * STEP) for i in range(20)]
    frames += [frame(moved, (20 + i) * STEP) for i in range(20)]
    out = conditioned(frames, for_recording())
    assert out[21].corrected[head]
    np.testing.assert_array_equal(out[-1].positions, moved)
    assert jumps(places(out)) < 0.35, "and goes there within a moment"


def test_a_bone_that_shrinks_is_not_believed() -> None:
    there = pose(T_POSE)
    shrunk = there.copy()
    knee, hip = BODY.index("KneeLeft"), BODY.index("HipLeft")
    beyond = [BODY.index("AnkleLeft"), BODY.index("FootLeft")]
    shrunk[[knee, *beyond]] = there[hip] - [0.0, 0.05, 0.0]
    # Slowly, so that nothing jumps.
    frames = [frame(there, i * STEP) for i in range(20)]
    frames += [
        frame(there + min(1.0, i / 8) * (shrunk - there), (20 + i) * STEP) for i in range(20)
    ]
    out = conditioned(frames, for_recording())
    assert out[29].corrected[[knee, *beyond]].all()
    assert np.linalg.norm(out[29].positions[knee] - there[knee]) < 0.2


@pytest.mark.parametrize("count", [1, 10, 300])
def test_a_lost_arm_is_held_then_rests_and_comes_back(count: int) -> None:
    up = pose({"ShoulderLeft": (0.0, 0.0, 1.5)})
    arm = [BODY.index(f"{part}Left") for part in ("Elbow", "Wrist", "Hand")]
    hidden = up.copy()
    hidden[arm] = np.nan
    frames = [frame(up, i * STEP) for i in range(20)]
    frames += [frame(hidden, (20 + i) * STEP) for i in range(count)]
    frames += [frame(up, (20 + count + i) * STEP) for i in range(10)]
    out = conditioned(frames, for_recording())
    lost = out[19 + count]
    assert lost.filled[arm].all()
    if count <= 10:
        np.testing.assert_allclose(lost.positions, up, atol=1e-9)
    else:
        assert np.linalg.norm(lost.positions - up, axis=1)[arm].max() > 0.3
    np.testing.assert_array_equal(out[-1].positions, up)
    assert jumps(places(out)) < 0.4
