"""The inset: the performer stays inside it, and drives and fills are told apart."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from devices.skeleton import Skeleton
from runtime.render.inset import SkeletonInset, body_bones
from tests.runtime.stick_figures import BODY, pose

PARENTS = [-1, 0, 1, 1]
REST = np.array([[0, 1, 0], [0, 1.5, 0], [0.5, 1.5, 0], [-0.5, 1.5, 0]], dtype=float)


def ends(inset: SkeletonInset) -> np.ndarray:
    """Where capsules end in the inset's coordinates (2 K, 2)."""
    return np.vstack([inset.capsules[:, 0:2], inset.capsules[:, 4:6]])


@given(
    steps=st.lists(
        st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.2, 4.0)), min_size=1, max_size=12
    )
)
def test_the_performer_never_leaves_the_mirror(steps: list[tuple[float, float, float]]) -> None:
    inset = SkeletonInset(PARENTS)
    for right, up, size in steps:
        inset.update(REST * size + (right, up, 0.0))
        assert np.linalg.norm(ends(inset), axis=1).max() <= 1.42  # corners of the fitted square
        assert np.abs(ends(inset)).max() <= 1.0 + 1e-5


def test_the_frame_stands_still_while_the_performer_moves_inside_it() -> None:
    inset = SkeletonInset(PARENTS)
    wide = REST * 3.0
    inset.update(wide)
    inset.update(np.add(REST, (0, 2.5, 0)))
    before = ends(inset)
    inset.update(np.add(REST, (0.05, 2.5, 0)))
    shift = (ends(inset) - before)[:, 0]
    assert (shift > 0.0).all()  # the performer moves in the picture, the picture does not follow


def test_no_pose_changes_how_large_the_performer_is() -> None:
    """Who raises both arms, or lets them hang, has bones as long as before in the picture."""
    inset, lengths = SkeletonInset(BODY.parents), []
    for angle in np.linspace(-0.2, 3.0, 30):
        moment = pose({"ShoulderLeft": (0.0, 0.0, angle), "ShoulderRight": (0.0, 0.0, -angle)})
        inset.update(moment)
        drawn = np.vstack([inset.capsules[:, 0:2], inset.capsules[:, 4:6]])
        assert np.linalg.norm(drawn, axis=1).max() < 1.12, "inside the ring"
        bones = np.linalg.norm(inset.capsules[:, 4:6] - inset.capsules[:, 0:2], axis=1)
        lengths.append(np.sort(bones)[-4:])
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], (30, 4)), rtol=1e-5)


def test_a_root_on_the_floor_and_helpers_have_no_bones() -> None:
    names = ("Root", "Hips", "Spine", "LeftUpLeg", "LeftUpLegTwist", "LeftLeg", "IK_foot_L")
    places = np.array(
        [[0, 0, 0], [0, 1, 0], [0, 1.5, 0], [0.1, 1, 0], [0.1, 0.8, 0], [0.1, 0.5, 0], [2, 0, 0]]
    )
    parents, shown = body_bones(Skeleton(names, np.array([-1, 0, 1, 1, 3, 4, 0]), places))
    assert [name for name, is_shown in zip(names, shown, strict=True) if not is_shown] == [
        "Root",
        "LeftUpLegTwist",
        "IK_foot_L",
    ]
    inset = SkeletonInset(parents, shown)
    inset.update(places)
    assert parents[5] == 3, "the shin hangs on the thigh"
    assert len(inset.capsules) == 3 + 4, "bones and beads"
    assert np.abs(inset.capsules[:, 0:2]).max() <= 1.0


def test_a_skeleton_without_names_is_drawn_whole() -> None:
    lone = Skeleton(("root",), np.array([-1]), np.zeros((1, 3)))
    assert body_bones(lone)[1].all()


def test_unseen_joints_are_left_out_and_filled_ones_are_faint() -> None:
    inset = SkeletonInset(PARENTS)
    torn = REST.copy()
    torn[3] = np.nan
    inset.update(torn, dimmed=np.array([False, False, True, False]))
    assert np.isfinite(inset.capsules).all()
    assert len(inset.capsules) == 2 + 3  # two bones, three beads
    opacity = inset.capsules[:, 11]
    assert np.count_nonzero(opacity < 0.5) == 2  # the filled joint and its bone


def test_nobody_seen_draws_nothing() -> None:
    inset = SkeletonInset(PARENTS)
    inset.update(np.full((4, 3), np.nan))
    assert len(inset.capsules) == 0


def test_driven_joints_carry_their_pair_colour() -> None:
    inset = SkeletonInset(PARENTS)
    colours = np.full((4, 3), np.nan)
    colours[2] = 1.0, 0.0, 0.25
    inset.update(REST, colours=colours)
    painted = np.isclose(inset.capsules[:, 8:11], colours[2]).all(axis=1)
    assert np.count_nonzero(painted) == 3  # glow, bone, bead


def test_a_performer_seen_from_the_side_is_turned() -> None:
    inset = SkeletonInset(PARENTS)
    side = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]], dtype=float)
    inset.update(REST, view_rotation=side)
    assert np.ptp(ends(inset)[:, 0]) < 1e-6
