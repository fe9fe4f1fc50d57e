"""The skeleton of two hands: names, parents and rest positions."""

from __future__ import annotations

import numpy as np
import pytest

from devices.leap.joints import (
    FINGERS,
    HAND_PARENTS,
    LEAP_TO_WORLD,
    chest,
    hand_skeleton,
    leap_to_world,
)


def test_the_way_into_the_world_is_a_turn_and_millimetres() -> None:
    turn = 1000.0 * LEAP_TO_WORLD
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_left_is_on_the_right_of_the_picture_forward_and_up_are_up() -> None:
    users_left, up, forward = leap_to_world([[-1000, 0, 0], [0, 1000, 0], [0, 0, -1000]])
    np.testing.assert_allclose(users_left, [1, 0, 0], atol=1e-12)
    assert up[1] == pytest.approx(np.sqrt(0.5))
    assert forward[1] == pytest.approx(np.sqrt(0.5))
    assert up[2] < 0 < forward[2]


def test_the_palm_of_a_level_hand_looks_at_the_camera() -> None:
    assert leap_to_world([0, -1, 0])[2] > 0


def test_one_hand_is_a_tree_from_the_elbow_to_five_tips() -> None:
    hand = hand_skeleton(HAND_PARENTS)
    assert hand.names[hand.root] == "elbow"
    leaves = set(range(len(hand.names))) - set(hand.parents.tolist())
    assert {hand.names[leaf] for leaf in leaves} == {f"{finger}_tip" for finger in FINGERS}
    assert "thumb_mcp" not in hand.names


def test_joints_that_are_not_there_are_passed_over() -> None:
    hand = hand_skeleton(["index_tip", "middle_pip"])
    assert hand.names == ("palm", "index_tip", "middle_pip")
    assert hand.parents.tolist() == [-1, 0, 0]


def test_two_hands_join_at_the_chest_left_at_plus_x() -> None:
    both = hand_skeleton(HAND_PARENTS, ("left", "right"))
    assert both.names[both.root] == "hands"
    np.testing.assert_array_equal(both.rest_positions[both.root], chest())
    left, right = (
        both.rest_positions[[name.startswith(side) for name in both.names]]
        for side in ("left", "right")
    )
    np.testing.assert_allclose(left * [-1, 1, 1], right, atol=1e-12)
    assert left[:, 0].mean() > 0.1


def test_the_thumb_of_a_resting_right_hand_points_to_the_performers_left() -> None:
    right = hand_skeleton(HAND_PARENTS)
    left = hand_skeleton(HAND_PARENTS, left=True)
    thumb = right.index("thumb_tip")
    assert right.rest_positions[thumb, 0] > 0.05
    assert left.rest_positions[thumb, 0] < -0.05


def test_bones_rest_at_the_length_that_was_measured() -> None:
    hand = hand_skeleton(HAND_PARENTS, lengths={"index_dip": 0.0315})
    bone = (
        hand.rest_positions[hand.index("index_dip")] - hand.rest_positions[hand.index("index_pip")]
    )
    assert np.linalg.norm(bone) == pytest.approx(0.0315)
