"""The skeleton of MediaPipe's landmarks: names, parents and rest positions."""

from __future__ import annotations

import numpy as np

from devices.mediapipe.joints import (
    HAND_BONES,
    HAND_LANDMARKS,
    PARENTS,
    POSE_LANDMARKS,
    landmark_skeleton,
    landmarks_to_world,
)


def test_the_landmarks_are_mediapipes() -> None:
    assert len(POSE_LANDMARKS) == 33
    assert len(HAND_LANDMARKS) == 21
    assert [POSE_LANDMARKS.index(n) for n in ("nose", "left_wrist", "right_foot_index")] == [
        0,
        15,
        32,
    ]
    assert HAND_LANDMARKS.index("ring_finger_tip") == 16


def test_every_finger_begins_at_the_wrist() -> None:
    begins = [name for name, parent in HAND_BONES.items() if parent == "wrist"]
    assert [HAND_LANDMARKS.index(name) for name in begins] == [1, 5, 9, 13, 17]
    assert HAND_BONES["pinky_tip"] == "pinky_dip"


def test_down_in_the_image_is_down_and_near_is_near() -> None:
    np.testing.assert_array_equal(landmarks_to_world([1.0, 1.0, 1.0]), [1.0, -1.0, -1.0])


def test_the_whole_body_is_one_tree_that_stands_facing_the_camera() -> None:
    body = landmark_skeleton(PARENTS)
    assert body.names[body.root] == "mid_hip"
    rest = dict(zip(body.names, body.rest_positions, strict=True))
    assert rest["nose"][1] > rest["mid_shoulder"][1] > 0 > rest["left_knee"][1]
    assert rest["left_wrist"][0] > 0.3
    assert rest["nose"][2] > 0
    for name, place in rest.items():
        if name.startswith("left_"):
            mirrored = rest["right_" + name.removeprefix("left_")]
            np.testing.assert_allclose(place * [-1, 1, 1], mirrored, atol=1e-12)


def test_joints_that_are_not_there_are_passed_over() -> None:
    body = landmark_skeleton(["mid_hip", "left_shoulder", "left_wrist"])
    assert body.names == ("mid_hip", "left_shoulder", "left_wrist")
    assert body.parents.tolist() == [-1, 0, 1]


def test_parts_that_nothing_joins_get_a_root_between_them() -> None:
    hands = landmark_skeleton(["left_wrist", "left_thumb_cmc", "right_wrist"])
    assert hands.names[hands.root] == "middle"
    assert hands.parents[hands.index("right_wrist")] == hands.root
    assert hands.rest_positions[hands.index("left_wrist"), 0] > 0.3
