"""VMC out: our receiver and python-osc's see what was performed; left stays left."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from pythonosc.osc_bundle import OscBundle
from scipy.spatial.transform import Rotation

from devices.bodies.humanoid import humanoid_skeleton
from devices.builtin.motions import motion_clip
from devices.errors import InputError
from devices.kinect.joints import KINECT_AZURE, KINECT_V1, KINECT_V2
from devices.mediapipe.joints import (
    HAND_LANDMARKS,
    MIDDLES,
    POSE_LANDMARKS,
    landmark_skeleton,
)
from devices.osc.vmc_decoder import VmcDecoder
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.driving.performer import Performer
from runtime.output.live.humanoid_bones import HumanoidBones, humanoid_bones
from runtime.output.live.vmc_performer import LONGEST, VmcPerformer
from runtime.output.output import PerformedFrame
from solvers.skeleton.joint_poses import ForwardKinematics
from tests.waiting import PATIENCE

HUMAN = humanoid_skeleton()


@pytest.fixture
def marionette() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(PATIENCE)
        yield listening


def performed(index: int, performer: Performer) -> PerformedFrame:
    return PerformedFrame(
        index, 70.0 + index / 60, np.zeros((0, 3)), nodes=None, poses=(performer.pose,)
    )


def seen(positions: np.ndarray, index: int) -> SkeletonFrame:
    return SkeletonFrame(index / 60, positions, None, np.ones(len(positions)))


def datagrams(marionette: socket.socket) -> list[bytes]:
    """Those of one frame, whose last message is the time."""
    came = [marionette.recv(65535)]
    while b"/VMC/Ext/T\0" not in came[-1]:
        came.append(marionette.recv(65535))
    return came


def test_what_is_sent_is_what_is_received(marionette: socket.socket) -> None:
    act = motion_clip("show")
    performer = Performer(act.skeleton)
    bones = HumanoidBones(act.skeleton)
    joints = [HUMAN.index(name) for name in bones.names]
    decoder = VmcDecoder()
    wanted: list[np.ndarray] = []
    found: list[SkeletonFrame] = []
    with VmcPerformer(performer.skeleton, *marionette.getsockname()) as output:
        for index in range(0, 400, 7):
            performer.follow(seen(act.positions[index], index))
            assert performer.pose is not None
            wanted.append(performer.pose.seen[bones.joints])
            output.write(performed(index, performer))
            came = datagrams(marionette)
            assert max(len(one) for one in came) <= LONGEST
            found += [f for one in came for f in decoder.feed(one, 10.0 + index / 60)]
        assert output.lost == 0
    assert decoder.refused == 0
    assert len(found) == len(wanted)
    for frame, positions in zip(found, wanted, strict=True):
        assert frame.positions[joints] == pytest.approx(positions, abs=1e-5)
        assert frame.rotations is not None
        known = frame.rotations[~np.isnan(frame.rotations[:, 0])]
        assert np.linalg.det(Rotation.from_quat(known).as_matrix()) == pytest.approx(1.0)
    first = found[0].positions
    assert first[HUMAN.index("LeftHand"), 0] > 0.2 > -0.2 > first[HUMAN.index("RightHand"), 0]
    assert np.diff([f.time for f in found]) == pytest.approx(7 / 60, abs=1e-3)


def test_the_face_of_the_performer_goes_along_in_bundles_that_fit(
    marionette: socket.socket,
) -> None:
    act = motion_clip("show")
    performer, decoder = Performer(act.skeleton), VmcDecoder()
    face = {f"shape {k}": k / 64 for k in range(64)} | {"喜び": 0.5}
    frames: list[SkeletonFrame] = []
    with VmcPerformer(performer.skeleton, *marionette.getsockname()) as output:
        for index in range(3):
            performer.follow(replace(seen(act.positions[index], index), blends=face))
            output.write(performed(index, performer))
            came = datagrams(marionette)
            assert max(len(one) for one in came) <= LONGEST
            frames += [f for one in came for f in decoder.feed(one, 10.0 + index / 60)]
    assert [one.blends for one in frames] == [face] * 3
    assert decoder.refused == 0


def test_python_osc_reads_the_order_of_the_specification(marionette: socket.socket) -> None:
    act = motion_clip("show")
    performer = Performer(act.skeleton)
    with VmcPerformer(performer.skeleton, *marionette.getsockname()) as output:
        output.write(performed(0, performer))  # nobody to be seen yet: nothing is sent
        performer.follow(seen(act.positions[0], 0))
        output.write(performed(1, performer))
        messages = [m for one in datagrams(marionette) for m in OscBundle(one)]
    assert messages[0].address == "/VMC/Ext/Root/Pos"
    assert messages[0].params == ["root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    assert [m.address for m in messages[-2:]] == ["/VMC/Ext/OK", "/VMC/Ext/T"]
    assert messages[-2].params == [1, 3, 0]
    assert messages[-1].params == [0.0]
    names = [m.params[0] for m in messages[1:-2]]
    assert len(set(names)) == len(names) > 40
    assert set(names) <= set(HUMAN.names)
    by_name = {m.params[0]: m.params[1:] for m in messages[1:-2]}
    assert by_name["LeftUpperLeg"][0] < 0.0 < by_name["RightUpperLeg"][0]  # Unity's left is -X


def limbs(turns: dict[str, Rotation]) -> np.ndarray:
    """Where the joints of Unity's humanoid are with these local rotations."""
    rest, parents = HUMAN.rest_positions, HUMAN.parents
    offsets = rest - np.where(parents[:, None] >= 0, rest[parents], 0.0)
    local = np.array([turns.get(n, Rotation.identity()).as_quat() for n in HUMAN.names])
    positions, _ = ForwardKinematics(parents).world(offsets, local)
    return positions


def chance_pose(seed: int) -> dict[str, Rotation]:
    """Every bone turned; those that have no breadth not about their own length, up or down."""
    chance = np.random.default_rng(seed)
    turns = {}
    for name in HUMAN.names:
        x, y, z = chance.uniform(-0.5, 0.5, 3)
        if name in ("Spine", "Chest", "Neck") or name.endswith("Leg"):
            y = 0.0
        elif name.endswith(("Arm", "Shoulder")):
            x = 0.0
        if "Eye" not in name and name != "Jaw":
            turns[name] = Rotation.from_rotvec((x, y, z))
    return turns


@pytest.mark.parametrize("seed", range(5))
def test_a_model_that_takes_rotations_alone_strikes_the_same_pose(seed: int) -> None:
    pose = limbs(chance_pose(seed))
    bones = HumanoidBones(HUMAN)
    assert set(bones.names) == set(HUMAN.names) - {"LeftEye", "RightEye", "Jaw"}
    _, turns = bones.local(pose)
    by_name = {
        name: Rotation.from_quat(turn) for name, turn in zip(bones.names, turns, strict=True)
    }
    struck = limbs({"Hips": Rotation.identity(), **by_name})
    struck += pose[0] - struck[0]
    body = [j for j, name in enumerate(HUMAN.names) if name in bones.names]
    off = np.linalg.norm(struck[body] - pose[body], axis=1)
    assert off.max() < 0.01  # [m]; the built-in trunk's joints lie 1 cm behind each other
    assert np.median(off) < 0.003


def test_at_rest_nothing_is_turned() -> None:
    for skeleton in (HUMAN, KINECT_V2):
        bones = HumanoidBones(skeleton)
        _, turns = bones.local(skeleton.rest_positions)
        standing = [
            place
            for place, name in enumerate(bones.names)
            if name in ("Hips", "Spine", "Chest", "UpperChest", "Neck")
        ]
        assert np.abs(turns[standing, 3]) == pytest.approx(1.0, abs=1e-3)
    _, turns = HumanoidBones(HUMAN).local(HUMAN.rest_positions)
    assert np.abs(turns[:, 3]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    "skeleton", [KINECT_V1, KINECT_V2, KINECT_AZURE, landmark_skeleton([*POSE_LANDMARKS, *MIDDLES])]
)
def test_bodies_of_other_sensors_have_humanoid_bones(skeleton: Skeleton) -> None:
    found = humanoid_bones(skeleton)
    needed = {"Hips", "Head"} | {
        f"{side}{bone}"
        for side in ("Left", "Right")
        for bone in ("UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot")
    }
    assert needed <= found.keys()
    assert len(set(found.values())) == len(found)
    for name, joint in found.items():
        x = skeleton.rest_positions[joint, 0]
        assert (x > 0) == name.startswith("Left") or not name.startswith(("Left", "Right"))
    # Poses without sense, all joints in one place, are no reason to fail.
    offsets, turns = HumanoidBones(skeleton).local(np.zeros((len(skeleton.names), 3)))
    assert np.isfinite(offsets).all()
    assert np.linalg.norm(turns, axis=1) == pytest.approx(1.0)


def test_hands_alone_are_refused_in_one_line() -> None:
    hands = landmark_skeleton(
        [f"{side}_{name}" for side in ("left", "right") for name in HAND_LANDMARKS]
    )
    with pytest.raises(InputError, match="a whole body") as refused:
        VmcPerformer(hands, "127.0.0.1", 1)
    assert "\n" not in str(refused.value)


def test_nobody_listening_stops_no_show(marionette: socket.socket) -> None:
    act = motion_clip("wave")
    performer = Performer(act.skeleton)
    performer.follow(seen(act.positions[0], 0))
    host, port = marionette.getsockname()
    marionette.close()
    with VmcPerformer(performer.skeleton, host, port) as output:
        for index in range(20):
            output.write(performed(index, performer))
    output.close()
    with pytest.raises(InputError, match="no host is called"):
        VmcPerformer(performer.skeleton, "no.such.host.invalid")
