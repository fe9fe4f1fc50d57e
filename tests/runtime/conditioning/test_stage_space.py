"""Smoothing, left and right, floor, size and calibration: into the stage's space."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from devices.skeleton import SkeletonFrame
from replay.builtin import builtin_recording
from replay.formats import read_recording
from runtime.conditioning.body_anatomy import body_anatomy
from runtime.conditioning.conditioner import Conditioner
from runtime.conditioning.mirror import mirrored, mirrored_rotations
from runtime.conditioning.switches import (
    SWITCHES,
    Conditioning,
    asked_for,
    for_live,
    for_recording,
)
from tests.runtime.conditioning.conditioned_frames import (
    HANGING,
    ONLY,
    STEP,
    conditioned,
    frame,
    frames_of,
    jitter,
    jumps,
    places,
    show,
)
from tests.runtime.stick_figures import BODY, T_POSE, pose
from tests.thorough import examples


@settings(max_examples=examples(60), deadline=None)
@given(
    arrays(
        np.float64,
        (5, len(BODY.names), 3),
        elements=st.floats(allow_nan=True, allow_infinity=True, width=64) | st.floats(-2.0, 2.0),
    ),
    arrays(np.float64, 5, elements=st.floats(-1e6, 1e6) | st.floats(0.0, 0.2)),
    st.lists(st.booleans(), min_size=len(SWITCHES), max_size=len(SWITCHES)),
)
def test_nothing_that_leaves_is_nan(
    positions: np.ndarray, times: np.ndarray, on: list[bool]
) -> None:
    conditioner = Conditioner(BODY, Conditioning(*on))
    for place, time in zip(positions, times, strict=True):
        out = conditioner.condition(SkeletonFrame(time, place, None, np.zeros(len(BODY.names))))
        assert np.isfinite(out.positions).all()


@pytest.mark.parametrize("switches", [for_live(), for_recording(), ONLY()])
def test_a_frame_of_another_skeleton_is_refused(switches: Conditioning) -> None:
    for count in (len(BODY.names) - 1, len(BODY.names) + 1):
        other = SkeletonFrame(0.0, np.zeros((count, 3)), None, np.ones(count))
        with pytest.raises(ValueError, match=rf"got \({count}, 3\)"):
            Conditioner(BODY, switches).condition(other)


@settings(max_examples=examples(40), deadline=None)
@given(arrays(np.float64, (len(BODY.names), 3), elements=st.floats(-5.0, 5.0)))
def test_the_mirror_twice_is_as_before(positions: np.ndarray) -> None:
    partner = body_anatomy(BODY).partner
    np.testing.assert_array_equal(mirrored(mirrored(positions, partner), partner), positions)
    assert (partner != np.arange(len(BODY.names))).sum() >= 16


def test_in_the_mirror_left_is_right_and_limbs_do_not_cross() -> None:
    raised = pose({"ShoulderLeft": (0.0, 0.0, 1.0)}, moved=(0.4, 0.0, 0.0))
    hidden = raised.copy()
    left, right = BODY.index("HandLeft"), BODY.index("HandRight")
    hidden[left] = np.nan
    out = conditioned([frame(hidden, 0.0)], Conditioning(*[n == "mirror" for n in SWITCHES]))[0]
    assert out.mirrored
    assert out.filled[right]
    assert not out.filled[left]
    np.testing.assert_allclose(out.positions[left], raised[right] * [-1, 1, 1])
    hips = [BODY.index(f"Hip{side}") for side in ("Left", "Right")]
    assert out.positions[hips[0], 0] > out.positions[hips[1], 0], "left is still at +X"


@pytest.mark.parametrize("switch", ["filter", "predict"])
def test_a_pose_that_is_held_is_not_moved(switch: str) -> None:
    still = [frame(pose(T_POSE), i * STEP) for i in range(30)]
    out = conditioned(still, Conditioning(*[n == switch for n in SWITCHES]))
    np.testing.assert_array_equal(out[-1].positions, pose(T_POSE))
    assert out[-1].predicted.all() == (switch == "predict")


def test_noise_is_reduced_on_a_real_recording(shared: Path) -> None:
    recording = read_recording(shared / "kinect/v2_laban/Ges03_drawlines.csv")
    switches = for_recording()
    switches.filter = True
    out = places(conditioned(frames_of(recording), switches, recording.skeleton))
    assert jitter(out) < 0.75 * jitter(recording.positions)
    assert np.linalg.norm(out - recording.positions, axis=2).mean() < 0.01


def test_switches_may_be_turned_while_it_runs_without_a_jump() -> None:
    frames = show(300)
    for name in ("swaps", "outliers", "filter", "predict", "identities", "order"):
        switches = for_recording()
        conditioner = Conditioner(builtin_recording("show").skeleton, switches)
        out = []
        for index, each in enumerate(frames):
            if index % 40 == 20:
                switches.switch(name)
            out.append(conditioner.condition(each).positions)
        raw = jumps(np.array([each.positions for each in frames]))
        assert jumps(np.array(out)) < 1.6 * raw, name


def test_a_tilted_and_lowered_floor_is_made_level() -> None:
    angle = 0.2
    turn = np.array(
        [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
    )
    switches = ONLY()
    switches.level = True
    conditioner = Conditioner(BODY, switches)
    feet = [BODY.index(f"Foot{side}") for side in ("Left", "Right")]
    for index in range(1200):
        # Stands for a second here and there within four metres, and goes there in no time.
        x, z = np.random.default_rng(index // 30).uniform(-2.0, 2.0, 2)
        true = pose(T_POSE, moved=(x, 0.0, z))
        out = conditioner.condition(frame(true @ turn.T - [0.0, 0.9, 0.0], index * STEP))
        if index > 900:
            heights = out.positions[feet, 1] - BODY.rest_positions[feet, 1]
            np.testing.assert_allclose(heights, 0.0, atol=0.06)
            up = out.positions[BODY.index("Head")] - out.positions[BODY.index("SpineBase")]
            assert up[1] / np.linalg.norm(up) > np.cos(0.05)
    tilted = np.full((3, 4), np.nan)
    tilted[:2] = Rotation.from_matrix(turn).as_quat()
    level = conditioner.levelling.level_rotations(tilted)
    assert np.abs(Rotation.from_quat(level[:2]).as_matrix()[:, 1, 1]).min() > np.cos(0.05)
    assert np.isnan(level[2]).all()


@given(st.integers(0, 1000))
def test_rotations_are_mirrored_as_positions_are(seed: int) -> None:
    turns = Rotation.random(2, random_state=seed)
    points = np.random.default_rng(seed).normal(size=(2, 3))
    other = np.array([1, 0])
    seen = Rotation.from_quat(mirrored_rotations(turns.as_quat(), other))
    wanted = mirrored(turns.apply(points), other)
    np.testing.assert_allclose(seen.apply(mirrored(points, other)), wanted, atol=1e-12)


def test_a_jump_does_not_raise_the_floor() -> None:
    switches = ONLY()
    switches.level = True
    conditioner = Conditioner(BODY, switches)
    for index in range(300):
        air = max(0.0, 0.6 * np.sin(index * 0.2)) if index > 90 else 0.0
        out = conditioner.condition(frame(pose(T_POSE, moved=(0.0, air, 0.0)), index * STEP))
        np.testing.assert_allclose(out.positions, pose(T_POSE, moved=(0.0, air, 0.0)), atol=0.03)


@pytest.mark.parametrize("size", [0.6, 1.0, 1.3])
def test_everybody_is_as_tall_as_the_rest_pose(size: float) -> None:
    switches = ONLY()
    switches.scale = True
    frames = [frame(pose(T_POSE) * size, i * STEP) for i in range(60)]
    out = conditioned(frames, switches)
    np.testing.assert_allclose(out[-1].positions, pose(T_POSE), atol=1e-6)
    assert out[-1].scale == pytest.approx(1.0 / size)


@pytest.mark.parametrize("shape", [T_POSE, {}])
def test_a_pose_held_for_a_second_calibrates_once(shape: dict[str, tuple[float, ...]]) -> None:
    switches = ONLY()
    switches.recalibrate = True
    conditioner = Conditioner(BODY, switches)

    def held(positions: np.ndarray, times: range) -> list[bool]:
        asked = []
        for index in times:
            conditioner.condition(frame(positions, index * STEP))
            asked.append(conditioner.calibrates)
        return asked

    assert sum(held(pose(shape), range(28))) == 0, "not yet a second"
    assert sum(held(pose(shape), range(28, 120))) == 1
    assert sum(held(pose(HANGING), range(120, 200))) == 0, "arms that hang ask for nothing"
    assert sum(held(pose(shape), range(200, 260))) == 1
    switches.recalibrate = False
    held(pose(HANGING), range(260, 300))
    assert sum(held(pose(shape), range(300, 400))) == 0


def test_a_pose_that_is_not_held_still_asks_for_nothing() -> None:
    switches = ONLY()
    switches.recalibrate = True
    conditioner = Conditioner(BODY, switches)
    for index in range(120):
        lean = 0.3 * np.sin(index * 0.5)
        conditioner.condition(frame(pose(T_POSE, moved=(lean, 0.0, 0.0)), index * STEP))
        assert not conditioner.calibrates


def test_an_unknown_switch_is_told_in_one_line() -> None:
    switches = Conditioning()
    assert switches.switch("mirror")
    assert not switches.switch("mirror", False)
    with pytest.raises(InputError, match=r"smoothness.*filter"):
        switches.switch("smoothness")
    assert asked_for(Conditioning(), {"filter": False, "mirror": None}).filter is False


def test_performers_without_end_are_forgotten() -> None:
    conditioner = Conditioner(BODY, for_live())
    for number in range(200):
        each = replace(frame(pose(T_POSE), 0.01 * number), performer=number)
        assert np.isfinite(conditioner.condition(each).positions).all()
    assert len(conditioner._memories) == 64
