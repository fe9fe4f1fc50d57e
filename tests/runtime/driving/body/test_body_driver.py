"""The driver that moves a body limb by limb does what the performer does, from any rest pose."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from devices.bodies.plan_by_names import plan_by_names
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from replay.builtin import builtin_recording
from replay.formats import read_recording
from runtime.characters.character import Character
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.body.joint_turns import JointTurns
from runtime.driving.drivers import best_driver
from runtime.driving.mapping import Mapping
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Performer, Pose, rest_state
from runtime.driving.polyline_driver import PolylineDriver
from runtime.driving.targets import PosedNodes
from runtime.puppet.puppet import Puppet
from runtime.show.open_stream import play
from runtime.show.show import Show
from solvers.retarget.heading import turned
from tests.runtime.stick_figures import ARMS, BODY, frame, make_figure, node, paired, pose

SEGMENTS = {
    ("ShoulderLeft", "ElbowLeft"): ("shoulder.L", "elbow.L"),
    ("ElbowLeft", "WristLeft"): ("elbow.L", "wrist.L"),
    ("ShoulderRight", "ElbowRight"): ("shoulder.R", "elbow.R"),
    ("ElbowRight", "WristRight"): ("elbow.R", "wrist.R"),
    ("HipLeft", "KneeLeft"): ("hip.L", "knee.L"),
    ("KneeLeft", "AnkleLeft"): ("knee.L", "ankle.L"),
    ("HipRight", "KneeRight"): ("hip.R", "knee.R"),
    ("KneeRight", "AnkleRight"): ("knee.R", "ankle.R"),
}
LEG = 0.68  # [m] of the figure


def body(turn: float = 0.0, droop: float = 0.0) -> Character:
    """The figure with a plan, turned about the vertical, its arms lowered at rest by `droop`."""
    figure = make_figure()
    rest = figure.skeleton.rest_positions.copy()
    for side, sign in (("L", -1.0), ("R", 1.0)):
        lowered = Rotation.from_rotvec([0.0, 0.0, sign * droop])
        arm = [node(f"{name}.{side}") for name in ("shoulder", "elbow", "wrist")]
        rest[arm] = rest[arm[0]] + lowered.apply(rest[arm] - rest[arm[0]])
    skeleton = Skeleton(
        figure.skeleton.names, figure.skeleton.parents, turned(rest, turn, np.zeros(3))
    )
    vertices = turned(figure.vertices, turn, np.zeros(3))
    figure = replace(figure, vertices=vertices, skeleton=skeleton)
    return replace(figure, plan=plan_by_names(skeleton))


CHARACTERS: dict[BodyDriver, Character] = {}


def winged() -> Character:
    """The figure with arms of 2.3 m, longer than its shoulders are high."""
    figure = body()
    rest, vertices = figure.skeleton.rest_positions.copy(), figure.vertices.copy()
    for side, sign in (("L", 1.0), ("R", -1.0)):
        arm = [node(f"{name}.{side}") for name in ("elbow", "wrist")]
        rest[arm, 0] = sign * (0.2 + 3.5 * (np.abs(rest[arm, 0]) - 0.2))
    far = np.abs(vertices[:, 0]) > 0.24
    out = np.sign(vertices[far, 0]) * (0.2 + 3.5 * (np.abs(vertices[far, 0]) - 0.2))
    vertices[far, 0] = out
    skeleton = replace(figure.skeleton, rest_positions=rest)
    return replace(figure, vertices=vertices, skeleton=skeleton)


def driver_of(character: Character) -> BodyDriver:
    driver = BodyDriver(paired(Puppet(character)))
    CHARACTERS[driver] = character
    return driver


def follow(driver: BodyDriver, *poses: ArrayLike, rate: float = 30.0) -> list[PosedNodes]:
    """The posed nodes on the stage for poses of a performer who first stands at rest."""
    performer = Performer(BODY)
    driver.prepare((), rest_state(performer.follow(frame(pose(), 0.0)), heading=0.0))
    puppet = Puppet(CHARACTERS[driver])
    puppet.drive_with(driver)
    nodes = []
    for number, positions in enumerate(poses):
        puppet.follow(performer.follow(frame(np.asarray(positions), number / rate)))
        motion = puppet.deform()
        assert motion.nodes is not None
        nodes.append(motion.nodes)
    return nodes


def errors(
    nodes: PosedNodes, positions: NDArray[np.float64], heading: float = 0.0
) -> NDArray[np.float64]:
    """The angles [deg] between the limbs of figure and performer, who is turned by `heading`."""
    seen = turned(positions, heading, np.zeros(3))
    found = []
    for (near, far), (start, end) in SEGMENTS.items():
        theirs = seen[BODY.index(far)] - seen[BODY.index(near)]
        ours = nodes.positions[node(end)] - nodes.positions[node(start)]
        cosine = theirs @ ours / np.linalg.norm(theirs) / np.linalg.norm(ours)
        found.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return np.array(found)


def bent(numbers: list[float]) -> NDArray[np.float64]:
    """A pose with every joint of the limbs turned."""
    turns = np.reshape(numbers, (8, 3))
    joints = [
        f"{name}{side}"
        for name in ("Shoulder", "Elbow", "Hip", "Knee")
        for side in ("Left", "Right")
    ]
    return pose(dict(zip(joints, turns, strict=True)))


ANY_BEND = st.lists(st.floats(-0.7, 0.7), min_size=24, max_size=24).map(bent)


@pytest.fixture(scope="module")
def upright() -> BodyDriver:
    return driver_of(body())


@pytest.fixture(scope="module")
def lowered() -> BodyDriver:
    return driver_of(body(droop=1.2))


@given(positions=ANY_BEND)
def test_limbs_point_where_the_performers_point_whatever_the_rest_pose(
    upright: BodyDriver, lowered: BodyDriver, positions: NDArray[np.float64]
) -> None:
    for driver in (upright, lowered):
        (nodes,) = follow(driver, positions)
        assert errors(nodes, positions).max() < 1e-4


def test_a_character_in_profile_does_the_same_in_profile() -> None:
    positions = bent(np.linspace(-0.6, 0.7, 24).tolist())
    quarter = np.pi / 2.0
    (nodes,) = follow(driver_of(body(turn=quarter)), positions)
    assert errors(nodes, positions, heading=quarter).max() < 1e-4


def test_the_hips_travel_in_lengths_of_the_legs(upright: BodyDriver) -> None:
    far = np.array([1.5, 0.0, -0.8])
    path = [pose(moved=share * far) for share in np.linspace(0.0, 1.0, 30)]
    nodes = follow(upright, *path)
    way = nodes[-1].positions[node("pelvis")] - nodes[0].positions[node("pelvis")]
    theirs = np.linalg.norm(
        np.diff(
            BODY.rest_positions[[BODY.index(j + "Left") for j in ("Hip", "Knee", "Ankle")]], axis=0
        ),
        axis=1,
    ).sum()
    np.testing.assert_allclose(way, LEG / theirs * far, atol=1e-6)


def test_the_body_turns_as_the_performer_turns(upright: BodyDriver) -> None:
    straight, turn = pose(), 0.9
    nodes = follow(upright, straight, pose(heading=turn))
    arm = [part.positions[node("wrist.L")] - part.positions[node("shoulder.L")] for part in nodes]
    np.testing.assert_allclose(turned(arm[0][None], turn, np.zeros(3))[0], arm[1], atol=1e-6)


def squatting(share: float) -> NDArray[np.float64]:
    """A squat on both feet, by `share` of a right angle of the knees."""
    angle = 0.25 * np.pi * share
    turns = {}
    for side in ("Left", "Right"):
        turns[f"Hip{side}"] = (-angle, 0.0, 0.0)
        turns[f"Knee{side}"] = (2.0 * angle, 0.0, 0.0)
        turns[f"Ankle{side}"] = (-angle, 0.0, 0.0)
    positions = pose(turns)
    rest = BODY.rest_positions[BODY.index("AnkleLeft"), 1]
    positions[:, 1] += rest - positions[BODY.index("AnkleLeft"), 1]
    return positions


def test_a_squat_is_as_deep_and_the_feet_stay_on_the_floor(upright: BodyDriver) -> None:
    poses = [squatting(share) for share in np.linspace(0.0, 1.0, 20)]
    nodes = follow(upright, *poses)
    ours = [part.positions[[node("hip.L"), node("ankle.L")], 1] for part in nodes]
    joints = [BODY.index("HipLeft"), BODY.index("AnkleLeft")]
    theirs = [positions[joints, 1] for positions in poses]
    depths = [(np.ptp(legs[0]) - np.ptp(legs[-1])) / np.ptp(legs[0]) for legs in (ours, theirs)]
    assert depths[0] == pytest.approx(depths[1], rel=0.02)
    assert depths[0] > 0.25
    assert nodes[-1].positions[node("ankle.L"), 1] < 0.12, "as far as the brick of a shin tilts"


def test_a_jump_leaves_the_floor_and_comes_back(upright: BodyDriver) -> None:
    heights = 0.4 * np.sin(np.linspace(0.0, np.pi, 20))
    nodes = follow(upright, *[pose(moved=(0.0, height, 0.0)) for height in heights])
    ankles = np.array([part.positions[node("ankle.L"), 1] for part in nodes])
    ratio = (ankles.max() - ankles[0]) / 0.4
    assert 0.6 < ratio < 1.2, "as high as the performer, in lengths of the legs"
    assert ankles[-1] == pytest.approx(ankles[0], abs=1e-3)


def test_who_squats_before_a_camera_that_keeps_the_hips_in_place_does_not_fly(
    upright: BodyDriver,
) -> None:
    poses = [squatting(share) for share in np.linspace(0.0, 1.0, 20)]
    for positions in poses:
        positions[:, 1] -= positions[0, 1] - BODY.rest_positions[0, 1]
    assert poses[-1][BODY.index("AnkleLeft"), 1] > 0.2
    nodes = follow(upright, *poses)
    ankles = np.array([part.positions[node("ankle.L"), 1] for part in nodes])
    assert ankles.max() < 0.12, "as far as the brick of a shin tilts"


def test_the_head_follows_the_rotation_of_the_stream(upright: BodyDriver) -> None:
    performer = Performer(BODY)
    driver = upright
    driver.prepare((), rest_state(performer.follow(frame(pose(), 0.0)), heading=0.0))
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (len(BODY.names), 1))
    yaw = Rotation.from_rotvec([0.0, 1.0, 0.0]).as_quat()
    rotations[BODY.index("Head")] = yaw
    still = frame(pose(), 0.1)
    whole = SkeletonFrame(0.1, still.positions, rotations, still.confidence)
    targets = driver.targets(performer.follow(whole))
    assert targets.nodes is not None
    np.testing.assert_allclose(targets.nodes.rotations[node("head")], yaw, atol=1e-6)
    assert abs(targets.placement.turn) < 1e-9


def test_going_on_from_a_snapshot_gives_the_same_bytes(upright: BodyDriver) -> None:
    performer = Performer(BODY)
    poses: list[Pose] = [
        performer.follow(frame(bent((0.6 * np.sin(np.arange(24) + at)).tolist()), at / 30.0))
        for at in range(20)
    ]
    upright.prepare((), rest_state(poses[0]))
    for each in poses[:10]:
        upright.targets(each)
    state = upright.snapshot()
    wanted = [upright.targets(each) for each in poses[10:]]
    upright.reset()
    upright.restore(state)
    for each, want in zip(poses[10:], wanted, strict=True):
        found = upright.targets(each)
        assert found.nodes is not None
        assert want.nodes is not None
        np.testing.assert_array_equal(found.nodes.positions, want.nodes.positions)
        assert found.placement == want.placement


def test_what_has_no_limbs_is_refused_and_matched_on_the_screen_instead() -> None:
    without = Puppet(replace(body(), plan=None))
    with pytest.raises(InputError, match="--drive relative"):
        BodyDriver(paired(without))
    assert isinstance(best_driver(paired(without)), PolylineDriver)


def test_a_mapping_by_hand_beats_the_anatomy() -> None:
    pairing: Pairing = paired(Puppet(body()))
    assert isinstance(best_driver(pairing), BodyDriver)
    by_hand = replace(pairing, by_hand=Mapping(ARMS))
    assert isinstance(best_driver(by_hand), PolylineDriver)


def test_bones_that_divide_an_upper_arm_are_not_missed(shared: Path) -> None:
    recording = read_recording(shared / "bvh/makehuman_tpose_1frame.bvh")
    performer = Performer(recording.skeleton)
    puppet = Puppet(body())
    driver = BodyDriver(
        Pairing(
            recording.skeleton,
            tuple(performer.joints),
            puppet.character,
            puppet.bound_skeleton,
            puppet.surface,
        )
    )
    names = {part.name for part in driver.parts}
    assert names >= {"left arm", "right arm", "left leg", "right leg"}


def test_only_the_chosen_part_of_the_performer_drives() -> None:
    whole = paired(Puppet(body()))
    arm = tuple(BODY.index(f"{name}Left") for name in ("Shoulder", "Elbow", "Wrist", "Hand"))
    driver = best_driver(replace(whole, joints=arm))
    assert [part.name for part in driver.parts] == ["left arm"]
    assert str(driver.parts[0]) == "left arm -> left arm, absolute, 100 %"


def test_who_lends_one_arm_turns_no_trunk() -> None:
    whole = paired(Puppet(body()))
    arm = tuple(BODY.index(f"{name}Left") for name in ("Shoulder", "Elbow", "Wrist", "Hand"))
    driver = BodyDriver(replace(whole, joints=arm))
    performer = Performer(BODY)
    driver.prepare((), rest_state(performer.follow(frame(pose(), 0.0)), heading=0.0))
    twisted = pose({"SpineMid": (0.3, 0.8, 0.0), "ShoulderLeft": (0.0, 0.0, 0.6)})
    targets = driver.targets(performer.follow(frame(twisted, 0.1)))
    assert targets.nodes is not None
    turned_by = Rotation.from_quat(targets.nodes.rotations).magnitude()
    assert turned_by[[node("pelvis"), node("chest"), node("head"), node("wrist.R")]].max() < 1e-9
    assert turned_by[node("shoulder.L")] > 0.3


def test_a_bad_first_frame_spoils_neither_the_way_nor_the_turns_of_a_clip() -> None:
    """All joints in one point at the origin, far from the stage; no rotation means anything."""
    clean = builtin_recording("walk")
    positions = clean.positions + np.array([3.0, 0.0, 1.0])
    spoilt = positions.copy()
    spoilt[0] = 0.0
    stood = []
    for places in (positions, spoilt):
        recording = replace(clean, positions=places)
        with Show(play(recording, every_frame=True), [body()]) as show:
            while not show.ended:
                show.tick()
                show.settle()
            assert show.motions[0].nodes is not None
            stood.append(show.motions[0].nodes.positions)
    np.testing.assert_allclose(stood[1], stood[0], atol=0.01)


def test_rotations_are_understood_where_the_first_pose_has_none() -> None:
    performer = Performer(BODY)
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (len(BODY.names), 1))
    blind, seen = frame(pose(), 0.0), frame(pose(), 0.1)
    clip = [
        performer.follow(SkeletonFrame(each.time, each.positions, own, each.confidence))
        for each, own in ((blind, rotations * np.nan), (seen, rotations))
    ]
    turns = JointTurns(BODY, [BODY.index("Head")], 0.0, 0.0)
    assert turns.learn(clip)
    assert turns.turns(clip[1], 0.0).any()


def test_wings_show_each_angle_of_the_arms_between_hanging_and_level_above_the_floor() -> None:
    driver = driver_of(winged())
    shoulder, wrist = node("shoulder.L"), node("wrist.L")
    below = np.radians([0.0, 30.0, 60.0, 90.0])
    shown = []
    for angle in below:
        way = pose()[BODY.index("WristLeft")] - pose()[BODY.index("ShoulderLeft")]
        hangs = np.arctan2(-way[1], way[0])  # of the performer at rest
        turn = {"ShoulderLeft": (0, 0, hangs - angle), "ShoulderRight": (0, 0, angle - hangs)}
        nodes = follow(driver, pose(), *[pose(turn)] * 3)[-1]
        reach = nodes.positions[wrist] - nodes.positions[shoulder]
        shown.append(np.arctan2(-reach[1], reach[0]))
        assert nodes.positions[:, 1].min() > -1e-3
    edge = shown[-1]
    assert np.radians(20.0) < edge < np.radians(40.0)
    np.testing.assert_allclose(shown, edge * below / below[-1], atol=np.radians(2.0))
