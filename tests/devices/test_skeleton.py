"""Skeletons and frames: what they refuse, and that nobody can change them."""

import numpy as np
import pytest

from devices.errors import InputError
from devices.kinect.joints import KINECT_AZURE, KINECT_V1, KINECT_V2
from devices.skeleton import Skeleton, SkeletonFrame


def chain(parents: list[int]) -> Skeleton:
    count = len(parents)
    return Skeleton(tuple(f"j{i}" for i in range(count)), parents, np.zeros((count, 3)))


def test_parents_come_before_their_children_whatever_the_order_given() -> None:
    skeleton = chain([2, 0, -1, 1])
    assert skeleton.order == (2, 0, 1, 3)
    assert skeleton.root == 2


@pytest.mark.parametrize(
    ("parents", "message"),
    [
        ([-1, -1], "exactly one root"),
        ([1, 0], "exactly one root"),
        ([-1, 2, 1], "form a tree"),
        ([-1, 7], "form a tree"),
        ([], "at least one joint"),
    ],
)
def test_parents_that_are_no_tree_are_refused(parents: list[int], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Skeleton(tuple(f"j{i}" for i in range(len(parents))), parents, np.zeros((len(parents), 3)))


def test_repeated_names_and_endless_rest_positions_are_refused() -> None:
    with pytest.raises(InputError, match="'a' occurs more than once"):
        Skeleton(("a", "a"), [-1, 0], np.zeros((2, 3)))
    with pytest.raises(InputError, match="not a finite number"):
        Skeleton(("a",), [-1], [[np.inf, 0.0, 0.0]])


def test_an_unknown_joint_is_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="known joints: j0, j1"):
        chain([-1, 0]).index("elbow")


def test_a_frame_cannot_be_written_to() -> None:
    frame = SkeletonFrame(0.0, np.zeros((2, 3)), None, np.ones(2))
    with pytest.raises(ValueError, match="read-only"):
        frame.positions[0, 0] = 1.0
    with pytest.raises(ValueError, match="Expected `confidence`"):
        SkeletonFrame(0.0, np.zeros((2, 3)), None, np.ones(3))


@pytest.mark.parametrize(
    ("skeleton", "count"), [(KINECT_V1, 20), (KINECT_V2, 25), (KINECT_AZURE, 32)]
)
def test_kinect_rest_poses_are_mirror_images_of_a_standing_body(
    skeleton: Skeleton, count: int
) -> None:
    rest = dict(zip(skeleton.names, skeleton.rest_positions, strict=True))
    assert len(rest) == count
    for name, place in rest.items():
        if name.endswith("Left"):
            other = name.removesuffix("Left") + "Right"
            np.testing.assert_allclose(rest[other], place * [-1, 1, 1])
            mirrored = skeleton.names[skeleton.parents[skeleton.index(other)]]
            own = skeleton.names[skeleton.parents[skeleton.index(name)]]
            assert mirrored == own.replace("Left", "Right")
            assert place[0] > 0
    assert rest["Head"][1] > rest["HipLeft"][1] > rest["FootLeft"][1] > 0
    assert rest["FootLeft"][2] > rest["AnkleLeft"][2]
