"""An animal stands on all four feet while the arms hang, trots, and lifts a leg as an arm."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES
from devices.bodies.plan_by_names import plan_by_names
from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Performer, rest_state
from runtime.puppet.puppet import Puppet
from tests.runtime.capsule_bodies import DOG, capsule_body, planned
from tests.runtime.stick_figures import BODY, frame, pose

HANGING = {"ShoulderLeft": (0.0, 0.0, -0.75), "ShoulderRight": (0.0, 0.0, 0.75)}
STRIDE = {"HipLeft": (-0.5, 0.0, 0.0), "HipRight": (0.5, 0.0, 0.0)}

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def dog() -> Character:
    return planned(capsule_body(DOG))


class Played:
    """What a character shows of a performer who stands first.

    Attributes:
        lows: (frames, 2, 2) [m] of each limb, forelegs and hind legs, left and right.
        feet: (frames, 2, 2, 3) [m] where they end, seen from the hips.
        ways: (frames, 2, 2, 3) unit, from wrists and ankles to these.
        chest: (frames,) [m] the height of the end of the trunk over that of the hips.
    """

    def __init__(self, character: Character, *poses: Array, performer: Skeleton = BODY) -> None:
        plan, puppet = character.plan, Puppet(character)
        assert plan is not None
        joints = tuple(range(len(performer.names)))
        skin, surface = puppet.bound_skeleton, puppet.surface
        driver = BodyDriver(Pairing(performer, joints, puppet.character, skin, surface))
        follower, start = Performer(performer), None
        tree = skin.tree.rerooted(plan.hips)
        limbs = [[pair[side] for side in SIDES] for pair in (plan.arms, plan.legs)]
        owner = skin.skin.nodes[:, 0]
        own = [[np.isin(owner, tree.subtree(limb.chain[0])) for limb in pair] for pair in limbs]
        lows, feet, wrists, ways, chest = [], [], [], [], []
        for number, positions in enumerate(poses):
            seen = follower.follow(frame(positions, number / 30.0))
            if start is None:
                start = seen
                driver.prepare([start], rest_state(start, heading=0.0))
                puppet.drive_with(driver)
            puppet.follow(seen)
            motion = puppet.deform()
            assert motion.nodes is not None
            nodes = motion.nodes.positions
            lows.append([[motion.vertices[each, 1].min() for each in pair] for pair in own])
            feet.append([[nodes[limb.chain[-1]] - nodes[plan.hips] for limb in p] for p in limbs])
            wrists.append([[nodes[limb.lower[-1]] - nodes[plan.hips] for limb in p] for p in limbs])
            ends = np.array(feet[-1]) - wrists[-1]
            ways.append(ends / np.linalg.norm(ends, axis=2, keepdims=True))
            chest.append(nodes[plan.trunk[-1], 1] - nodes[plan.hips, 1])
        self.lows, self.feet = np.array(lows), np.array(feet)
        self.wrists = np.array(wrists)
        self.ways, self.chest = np.array(ways), np.array(chest)


def arms(forward: float, bend: float) -> Array:
    """Standing with arms that swing forward, elbows bent, by angles [rad]."""
    turns = {}
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        turns[f"Shoulder{side}"] = (0.0, 0.0, -0.75 * sign)
        turns[f"Elbow{side}"] = (-bend, 0.0, 0.0)
    swung = pose(turns)
    for side in ("Left", "Right"):
        chain = [BODY.index(f"{name}{side}") for name in ("Shoulder", "Elbow", "Wrist", "Hand")]
        ways = swung[chain] - swung[chain[0]]
        cosine, sine = np.cos(forward), np.sin(forward)
        y, z = ways[:, 1].copy(), ways[:, 2].copy()
        ways[:, 1], ways[:, 2] = cosine * y + sine * z, cosine * z - sine * y
        swung[chain] = swung[chain[0]] + ways
    return swung


@pytest.mark.parametrize(("forward", "bend"), [(0.0, 0.0), (0.2, 0.2), (-0.3, 0.0), (0.0, 0.35)])
def test_all_four_feet_stand_on_the_floor_while_the_arms_hang(dog, forward, bend) -> None:
    height = np.ptp(dog.vertices[:, 1])
    shown = Played(dog, pose(HANGING), *[arms(forward, bend)] * 3)
    assert np.abs(shown.lows[-1]).max() < 0.01 * height


def test_the_forelegs_step_with_the_other_foot(dog) -> None:
    shown = Played(dog, pose(HANGING), pose({**HANGING, **STRIDE}))
    ahead = shown.wrists[1, :, :, 2] - shown.wrists[0, :, :, 2]  # a foot in the air hangs
    (fore_left, fore_right), (hind_left, hind_right) = ahead
    assert hind_left > 0.1
    assert hind_right < -0.1
    assert fore_left == pytest.approx(hind_right, abs=0.05)
    assert fore_right == pytest.approx(hind_left, abs=0.05)


def test_a_lifted_arm_lifts_its_own_foreleg_alone(dog) -> None:
    height = np.ptp(dog.vertices[:, 1])
    shown = Played(dog, pose(HANGING), pose({**HANGING, "ShoulderLeft": (0.0, 0.0, 0.75)}))
    (left, right), hind = shown.lows[1]
    assert left > 0.2 * height
    assert right < 0.01 * height
    assert hind.max() < 0.01 * height


def test_arms_that_swing_with_bent_elbows_lift_no_foreleg(dog) -> None:
    shown = Played(dog, pose(HANGING), *[arms(0.5, 0.9)] * 2)
    assert np.abs(shown.lows[-1]).max() < 0.01 * np.ptp(dog.vertices[:, 1])


def test_a_forefoot_in_the_air_hangs(dog) -> None:
    lifted = {"HipRight": (-1.0, 0.0, 0.0), "KneeRight": (1.0, 0.0, 0.0)}
    shown = Played(dog, pose(HANGING), pose({**HANGING, **lifted}))
    (left, right), _ = shown.lows[1]
    assert left > 0.05 * np.ptp(dog.vertices[:, 1]) > 10.0 * abs(right)
    turned = shown.ways[1, 0] - shown.ways[0, 0]
    assert turned[0, 2] < -0.5
    assert np.abs(turned[1]).max() < 0.1


def test_an_arm_that_points_up_lifts_a_foreleg_to_the_front(dog) -> None:
    shown = Played(dog, pose(HANGING), pose({**HANGING, "ShoulderLeft": (0.0, 0.0, 1.5)}))
    before, after = shown.feet[:, 0, 0]
    reach = after - before
    assert reach[2] > 0.15  # ahead, and no higher than the back
    assert after[1] < 0.2


def test_who_bows_deeply_leaves_the_forelegs_room(dog) -> None:
    bow = {"SpineBase": (1.2, 0.0, 0.0), "HipLeft": (-1.2, 0.0, 0.0), "HipRight": (-1.2, 0.0, 0.0)}
    shown = Played(dog, pose(HANGING), *[pose({**HANGING, **bow})] * 2)
    height = np.ptp(dog.vertices[:, 1])
    assert -0.35 * height < shown.chest[-1] - shown.chest[0] < -0.15 * height
    assert np.abs(shown.lows[-1]).max() < 0.02 * height


def on_four() -> Skeleton:
    """A performer on four legs, half a metre high."""
    limbs = {"thigh": ("hips", 0.0), "upper_arm": ("chest", 0.6)}
    joints = [
        ("hips", "", (0.0, 0.5, 0.0)),
        ("spine", "hips", (0.0, 0.5, 0.3)),
        ("chest", "spine", (0.0, 0.5, 0.6)),
    ]
    for first, (hangs_on, z) in limbs.items():
        lower, end = ("shin", "foot") if first == "thigh" else ("forearm", "hand")
        for side, x in (("L", 0.1), ("R", -0.1)):
            joints.append((f"{first}.{side}", hangs_on, (x, 0.48, z)))
            joints.append((f"{lower}.{side}", f"{first}.{side}", (x, 0.24, z - 0.04)))
            joints.append((f"{end}.{side}", f"{lower}.{side}", (x, 0.0, z)))
    names = [name for name, _, _ in joints]
    parents = np.array([names.index(above) if above else -1 for _, above, _ in joints])
    return Skeleton(tuple(names), parents, np.array([place for *_, place in joints]))


def test_the_forelegs_of_a_performer_on_four_legs_lead_those_of_their_own_side(dog) -> None:
    performer = on_four()
    assert plan_by_names(performer) is not None
    rest = performer.rest_positions
    step = rest.copy()
    step[performer.names.index("hand.L")] += (0.0, 0.0, 0.15)
    step[performer.names.index("forearm.L")] += (0.0, 0.0, 0.06)
    shown = Played(dog, rest, step, performer=performer)
    assert np.abs(shown.lows).max() < 0.01 * np.ptp(dog.vertices[:, 1])
    ahead = shown.feet[1, 0, :, 2] - shown.feet[0, 0, :, 2]
    assert ahead[0] > 0.1
    assert abs(ahead[1]) < 0.01
