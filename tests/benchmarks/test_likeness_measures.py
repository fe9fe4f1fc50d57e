"""The measures of likeness, on bodies whose difference from the performer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from runtime.benchmarks.resemblance.body_track import unit
from runtime.benchmarks.resemblance.ground import ground_figures, hover, slide, travel
from runtime.benchmarks.resemblance.limbs import compared, limb_figures, sides
from runtime.benchmarks.resemblance.steadiness import jitter, steps_of_joints
from runtime.benchmarks.resemblance.turns import (
    beside,
    finger_curl_kept,
    hand_roll_kept,
    head_yaw_kept,
    kept,
)
from tests.benchmarks.moved_bodies import (
    BODY,
    FORWARD,
    moved,
    performer,
    standing,
    turned,
    wave,
    with_other_half,
)

UP = np.array([0.0, 1.0, 0.0])


def turned_whole(body, degrees: float, scale: float = 1.0):
    """The body of another size, elsewhere, facing another way."""
    turn = Rotation.from_rotvec(np.radians(degrees) * UP)
    shape = body.positions.shape
    positions = scale * turn.apply(body.positions.reshape(-1, 3)).reshape(shape)
    rotations = (turn * Rotation.from_quat(body.rotations.reshape(-1, 4))).as_quat()
    return replace(
        body,
        positions=positions + np.array([3.0, 0.0, 1.0]),
        rotations=rotations.reshape(body.rotations.shape),
    )


def test_a_body_resembles_itself_wherever_it_stands_and_however_large_it_is():
    source = performer()
    figures = limb_figures(source, turned_whole(source, 130.0, 2.5))
    assert {"left upper arm", "right forearm", "left hand", "right shin", "head"} <= set(figures)
    for limb in figures.values():
        assert limb.error < 1e-4
        assert limb.kept == pytest.approx(1.0) or limb.range < 2.0
        assert limb.gain == pytest.approx(1.0) or limb.range < 2.0
    assert sides(source, turned_whole(source, 130.0, 2.5)) == {"arms": "right", "legs": "right"}


def test_a_limb_that_is_turned_by_twenty_degrees_is_twenty_degrees_off():
    source = performer()
    figures = limb_figures(source, turned(source, "ElbowLeft", np.radians(20.0) * FORWARD))
    assert figures["right forearm"].error < 1e-4
    assert figures["left upper arm"].error < 1e-4
    assert 15.0 < figures["left forearm"].error < 20.001  # it turns about the front
    still = standing()
    axis = np.cross(still.span(still.plan.arms["left"].lower)[0], UP)
    figures = limb_figures(still, turned(still, "ElbowLeft", np.radians(20.0) * unit(axis)))
    assert figures["left forearm"].error == pytest.approx(20.0)


def test_range_and_gain_tell_how_much_of_a_swing_is_kept():
    swing = np.radians(wave(400, 40.0))
    source, half, back = (
        np.stack([np.sin(share * swing), -np.cos(share * swing), 0.0 * swing], axis=1)
        for share in (1.0, 0.5, -1.0)
    )
    assert compared(source, half).kept == pytest.approx(0.5, abs=0.01)
    assert compared(source, half).gain == pytest.approx(0.5, abs=0.05)
    assert compared(source, back).kept == pytest.approx(1.0)
    assert compared(source, back).gain < -0.8


def test_limbs_on_the_wrong_side_are_told():
    source = performer("wave")  # with the right hand only
    assert sides(source, with_other_half(source, is_mirrored=False))["arms"] == "swapped"
    assert sides(source, with_other_half(source, is_mirrored=True))["arms"] == "mirrored"
    assert sides(standing(), standing())["arms"] == "alike"  # in a mirror too


def test_a_character_without_elbows_is_compared_by_whole_arms():
    source = performer("arms")
    arms = {
        side: replace(limb, upper=limb.upper + limb.lower[1:], lower=(), end=())
        for side, limb in source.plan.arms.items()
    }
    figures = limb_figures(source, replace(source, plan=replace(source.plan, arms=arms)))
    assert figures["left arm"].error < 1e-4
    assert "left forearm" not in figures


def test_joints_that_were_not_seen_count_for_nothing():
    source = performer("walk")
    positions = source.positions.copy()
    positions[::2, BODY.index("ElbowLeft")] = np.nan
    positions[:, BODY.index("KneeRight")] = np.nan
    figures = limb_figures(replace(source, positions=positions), source)
    assert figures["left forearm"].error < 1e-4
    assert "right shin" not in figures


def test_travel_is_counted_in_the_legs_of_each():
    source = standing(61)
    way = np.linspace(0.0, 3.0, 61)[:, None] * [0.6, 0.0, 0.8]
    walked = moved(source, way)
    assert travel(walked) == pytest.approx(3.0 / walked.leg)
    large = turned_whole(walked, 0.0, 2.0)
    assert travel(large) == pytest.approx(travel(walked))


def test_planted_feet_that_slide_are_found():
    source = standing(61, rate=30.0)
    slow = np.linspace(0.0, 1.0, 61)[:, None] * [0.2, 0.0, 0.0]  # 0.1 m/s
    assert slide(source, source) == 0.0
    assert slide(source, moved(source, slow)) == pytest.approx(0.1 / source.leg)
    fast = moved(source, 10.0 * slow)  # feet that move so fast are not planted
    assert np.isnan(slide(fast, fast))


def test_a_character_above_the_floor_hovers_while_the_performer_stands():
    positions = standing(40).positions.copy()
    positions[30:, :, 1] += 0.4  # jumps
    lowest = np.zeros(40)
    lowest[:15] = 0.05
    lowest[30:] = 0.5
    assert hover(positions, lowest, 1.0) == pytest.approx(0.5)
    assert hover(positions, 0.005 * np.ones(40), 1.0) == 0.0


def test_a_squat_is_as_deep_as_the_hips_go():
    source = standing(200)
    down = np.zeros((200, 3))
    down[:, 1] = wave(200, 0.15)
    hips = ("SpineBase", "HipLeft", "HipRight")
    # Legs are measured by their median length, so hips that bob leave it as it is.
    deep, half = moved(source, down, *hips), moved(source, 0.5 * down, *hips)
    figures = ground_figures(deep, half, deep.positions, np.zeros(200), 1.7)
    assert figures.squat == pytest.approx(0.5, abs=0.01)
    assert figures.performer_squat == pytest.approx(0.3 / source.leg, rel=0.01)


def test_half_of_a_yaw_a_roll_and_a_curl_is_a_half():
    still = standing(300)
    turn = np.radians(wave(300, 30.0))[:, None]

    def shaking(share: float):
        return turned(still, "Neck", share * turn * UP)

    # The performer's head is the joint that turns it, told by its rotation.
    assert head_yaw_kept(shaking(1.0), shaking(0.5)) == pytest.approx(0.5, abs=0.01)
    assert head_yaw_kept(shaking(1.0), still) == pytest.approx(0.0, abs=0.01)
    assert np.isnan(head_yaw_kept(still, shaking(1.0)))

    along = still.span(still.plan.arms["left"].end)[0]

    def rolling(share: float):
        return turned(still, "WristLeft", share * turn * along)

    assert hand_roll_kept(rolling(1.0), rolling(0.5)) == pytest.approx(0.5, abs=0.01)
    assert hand_roll_kept(rolling(1.0), rolling(-1.0)) == pytest.approx(-1.0, abs=0.01)

    bent = 2.0 * np.radians(20.0) + turn
    axis = np.cross(along, FORWARD)

    def curling(share: float):
        return turned(still, "LeftIndexIntermediate", share * bent * axis)

    assert finger_curl_kept(curling(1.0), curling(0.5)) == pytest.approx(0.5, abs=0.02)


def test_a_yaw_by_the_ears_is_that_of_the_head():
    still = standing(200)
    turn = np.radians(wave(200, 25.0))[:, None]
    source = turned(still, "SpineShoulder", turn * UP)  # carries shoulders, which are its ears
    ears = BODY.index("ShoulderLeft"), BODY.index("ShoulderRight")
    character = turned(still, "Neck", turn * UP)
    assert head_yaw_kept(source, character, ears) == pytest.approx(1.0, abs=0.01)


def test_what_never_turns_has_nothing_to_keep():
    assert np.isnan(kept([np.zeros(10)], [wave(10, 50.0)]))
    assert kept([wave(50, 20.0), np.zeros(50)], [wave(50, 10.0), wave(50, 90.0)]) == 0.5


def test_jitter_is_the_acceleration_while_the_performer_is_still():
    still = standing(60, rate=30.0)
    shake = np.zeros((60, 3))
    shake[::2, 0] = 0.01
    shaking, quiet = jitter(still, moved(still, shake))
    assert quiet == 0.0
    assert shaking == pytest.approx(0.02 * 30.0**2 / still.leg)
    walking = moved(still, np.linspace(0.0, 2.0, 60)[:, None] * FORWARD)
    assert np.isnan(jitter(walking, still)).all()


def test_a_joint_that_jumps_is_counted_in_heights():
    positions = standing(10).positions.copy()
    positions[5:, BODY.index("WristLeft"), 2] += 0.5
    height = np.ptp(BODY.rest_positions[:, 1])
    assert_allclose(steps_of_joints(positions), 0.5 / height * (np.arange(9) == 4), atol=1e-12)


def test_a_hand_that_seems_to_go_round_once_more_rolls_as_the_other() -> None:
    theirs = np.array([0.0, 40.0, np.nan, 90.0, 170.0, 100.0])
    ours = theirs + 30.0
    ours[4:] -= 360.0  # it was swung past the direction opposite to the mean
    np.testing.assert_allclose(beside(ours, theirs), theirs + 30.0)
