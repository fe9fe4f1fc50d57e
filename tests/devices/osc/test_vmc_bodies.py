"""Bodies from VMC: left and right, bone lengths, roots and optional bones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.humanoid import FINGERS, SEGMENTS
from devices.bodies.humanoid_kernels import INFERRED
from devices.osc.vmc_decoder import VmcDecoder
from devices.skeleton import SkeletonFrame
from tests.devices.osc.vmc_frames import CORE, REST, STEP, fed, joint, waving
from tests.devices.vmc_sender import HUMAN, at, bones, bundle, expected, local_offsets, root, slime


def test_left_stays_left_and_bones_keep_their_length() -> None:
    decoder = VmcDecoder()
    chance = np.random.default_rng(0)
    parents = HUMAN.parents
    child = np.flatnonzero(parents >= 0)
    lengths = np.linalg.norm(REST[child] - REST[parents[child]], axis=1)
    for k in range(20):
        turns = {name: Rotation.random(rng=chance) for name in HUMAN.names}
        frames = decoder.feed(slime(k * STEP, turns), 10.0 + k * STEP)
        for frame in frames[-1:]:
            positions = frame.positions
            found = np.linalg.norm(positions[child] - positions[parents[child]], axis=1)
            assert found == pytest.approx(lengths, abs=1e-6)
            assert frame.rotations is not None
            matrices = Rotation.from_quat(frame.rotations).as_matrix()
            assert np.linalg.det(matrices) == pytest.approx(1.0)
    still = fed(VmcDecoder(), [(k * STEP, slime(k * STEP)) for k in range(3)])[-1]
    assert still.positions[joint("LeftHand"), 0] > 0.5
    assert still.positions[joint("RightHand"), 0] < -0.5
    assert still.positions[:, 1].min() > 0.0


def test_the_root_carries_the_body() -> None:
    turn = Rotation.from_euler("y", 0.7)
    decoder = VmcDecoder()
    data = [bundle([at(k * STEP), root((1.0, 0.2, -3.0), turn), *bones()]) for k in range(3)]
    frame = fed(decoder, [(k * STEP, one) for k, one in enumerate(data)])[-1]
    moved = turn.apply(REST.copy()) + np.array([1.0, 0.2, -3.0])
    assert frame.positions == pytest.approx(moved, abs=1e-6)


def test_a_sender_of_zeros_gets_the_built_in_body() -> None:
    turns = waving(3)
    decoder = VmcDecoder()
    zeros = np.zeros_like(REST)
    data = [(k * STEP, bundle([at(k * STEP), *bones(turns, offsets=zeros)])) for k in range(3)]
    assert fed(decoder, data)[-1].positions == pytest.approx(expected(turns), abs=1e-6)


def test_hips_move_although_other_offsets_are_zero() -> None:
    offsets = np.zeros_like(REST)
    offsets[joint("Hips")] = (0.3, 1.1, 0.2)
    decoder = VmcDecoder()
    data = [(k * STEP, bundle([at(k * STEP), *bones(offsets=offsets)])) for k in range(3)]
    frame = fed(decoder, data)[-1]
    assert frame.positions == pytest.approx(REST - REST[joint("Hips")] + offsets[0], abs=1e-6)


def test_a_bone_of_no_plausible_length_gets_the_default_at_the_bodys_scale() -> None:
    offsets = 0.5 * local_offsets()
    offsets[joint("LeftLowerArm")] = (40.0, 0.0, 0.0)
    offsets[joint("RightHand")] = 0.0
    offsets[joint("Head")] *= 1e-3
    data = [(k * STEP, bundle([at(k * STEP), *bones(offsets=offsets)])) for k in range(3)]
    frame = fed(VmcDecoder(), data)[-1]
    assert frame.positions == pytest.approx(0.5 * REST, abs=1e-6)


def test_a_model_without_optional_bones_is_whole() -> None:
    lacking = {"UpperChest", "LeftShoulder", "RightShoulder", "LeftEye", "LeftToes"}
    offsets = local_offsets()
    for bone, above in (("Neck", "UpperChest"), ("LeftUpperArm", "LeftShoulder")):
        offsets[joint(bone)] += offsets[joint(above)]
    offsets[joint("LeftUpperArm")] += offsets[joint("UpperChest")]
    offsets[joint("RightUpperArm")] = offsets[joint("LeftUpperArm")] * (-1.0, 1.0, 1.0)
    only = [name for name in CORE if name not in lacking]
    turns = {"Spine": Rotation.from_euler("x", 0.8), "LeftUpperArm": Rotation.from_euler("z", 1.0)}
    data = [
        (k * STEP, bundle([at(k * STEP), *bones(turns, offsets=offsets, only=only)]))
        for k in range(3)
    ]
    frame = fed(VmcDecoder(), data)[-1]
    whole = expected(turns)
    sent = [joint(name) for name in only]
    assert frame.positions[sent] == pytest.approx(whole[sent], abs=1e-6)
    assert (frame.confidence[sent] == 1.0).all()
    # What is rigid with a bone that came is inferred: on the way from chest to neck, on the head.
    for name in ("UpperChest", "LeftEye", "LeftToes", "LeftMiddleProximal"):
        assert frame.confidence[joint(name)] == INFERRED
        assert frame.positions[joint(name)] == pytest.approx(whole[joint(name)], abs=0.02)
    unknown = [joint(f"Left{finger}{end}") for finger in FINGERS for end in SEGMENTS[1:]]
    assert np.isnan(frame.positions[unknown]).all()
    assert (frame.confidence[unknown] == 0.0).all()
    assert ((frame.confidence == 0.0) == np.isnan(frame.positions[:, 0])).all()


def test_a_vrm1_model_is_calibrated_by_its_t_pose() -> None:
    """Bones whose own axes lie anyhow at rest, and a sender that gives rotations alone."""
    chance = np.random.default_rng(5)
    own = {name: Rotation.random(rng=chance) for name in HUMAN.names}

    def as_sent(turns: dict[str, Rotation]) -> dict[str, Rotation]:
        sent = {}
        for number, name in enumerate(HUMAN.names):
            above = int(HUMAN.parents[number])
            upper = own[HUMAN.names[above]] if above >= 0 else Rotation.identity()
            sent[name] = upper.inv() * turns.get(name, Rotation.identity()) * own[name]
        return sent

    for offsets in (np.zeros_like(REST), local_offsets()):
        in_bones = np.array(
            [
                own[HUMAN.names[above]].inv().apply(offset) if above >= 0 else offset
                for above, offset in zip(HUMAN.parents, offsets, strict=True)
            ]
        )
        decoder = VmcDecoder(tpose=1.0)
        frames: list[SkeletonFrame] = []
        for k in range(20):
            turns = as_sent({} if k < 15 else waving(4))
            data = bundle([at(k / 10), *bones(turns, offsets=in_bones)])
            frames += decoder.feed(data, 5.0 + k / 10)
        assert frames[14].positions == pytest.approx(REST, abs=1e-5)
        assert frames[-1].positions == pytest.approx(expected(waving(4)), abs=1e-5)
        assert frames[14].rotations is not None
        assert np.abs(frames[14].rotations[:, 3]) == pytest.approx(1.0, abs=1e-6)
