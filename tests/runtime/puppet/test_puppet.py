"""A puppet stands where its targets put it, on the floor, and the same each time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from runtime.driving.mapping import Drive, Mapping
from runtime.driving.performer import rest_state
from runtime.driving.root_motion import legs_of, root_motion
from runtime.puppet.puppet import Puppet
from solvers.retarget.heading import turned
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    HIPS,
    LEGS,
    driven,
    driven_by,
    make_figure,
    perform,
    pose,
    seen,
    waving,
)

FIGURE = make_figure()


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(FIGURE)


def ratio(drives: Sequence[Drive]) -> float:
    """How far the puppet rises for each metre of the performer, while both legs drive."""
    nodes = FIGURE.skeleton.rest_positions
    return root_motion(Mapping(tuple(drives)), legs_of(BODY), BODY.rest_positions, nodes).lift


def test_at_rest_it_stands_as_it_was_made(puppet: Puppet) -> None:
    puppet.rest()
    np.testing.assert_allclose(puppet.deform().vertices, FIGURE.vertices, atol=1e-9)
    start = driven(puppet, (*ARMS, *LEGS))
    puppet.follow(start)
    motion = puppet.deform()
    np.testing.assert_allclose(motion.vertices, FIGURE.vertices, atol=1e-9)
    np.testing.assert_allclose(motion.nodes.positions, FIGURE.skeleton.rest_positions, atol=1e-12)
    np.testing.assert_allclose(motion.nodes.rotations, np.tile([0, 0, 0, 1.0], (15, 1)), atol=1e-12)


def test_two_runs_are_the_same_to_the_last_bit() -> None:
    poses = waving(6)
    runs = []
    for _ in range(2):
        puppet = Puppet(FIGURE)
        driven(puppet, (*ARMS, *LEGS))
        runs.append(np.array([motion.vertices for motion in perform(puppet, poses)]))
    np.testing.assert_array_equal(*runs)
    assert np.abs(np.diff(runs[0], axis=0)).max() > 0.01, "it moved"


@pytest.mark.parametrize("heading", [0.7, -2.0, np.pi / 2])
def test_a_turn_and_a_jump_move_the_whole_rigidly(puppet: Puppet, heading: float) -> None:
    driven(puppet, (*ARMS, *LEGS))
    stands = rest_state(seen(pose())).height
    jumps = pose(heading=heading, moved=(0.4, 0.3, -0.2))
    motion = perform(puppet, [jumps])[0]
    about = puppet.bound_skeleton.tree.positions[puppet.bound_skeleton.root]
    lift = np.array([0.0, ratio(LEGS) * (jumps[HIPS, 1] - stands), 0.0])
    assert lift[1] == pytest.approx(0.3 * ratio(LEGS)), "by what the jump is above standing"
    whole = turned(FIGURE.vertices, heading, about) + lift
    np.testing.assert_allclose(motion.vertices, whole, atol=1e-9)
    nodes = turned(FIGURE.skeleton.rest_positions, heading, about) + lift
    np.testing.assert_allclose(motion.nodes.positions, nodes, atol=1e-9)
    turns = Rotation.from_quat(motion.nodes.rotations).as_rotvec()
    np.testing.assert_allclose(turns, np.tile([0, heading, 0], (15, 1)), atol=1e-9)
    lit = puppet.highlights[0]
    np.testing.assert_allclose(lit.points, nodes[list(ARMS[0].target)], atol=1e-9)
    assert lit.joints == ARMS[0].source[1:]


def test_who_crouches_comes_down_to_the_floor_and_not_through_it(puppet: Puppet) -> None:
    driven(puppet, LEGS)
    lowered = perform(puppet, [pose(moved=(0.0, -0.2, 0.0))])[0]
    np.testing.assert_allclose(lowered.vertices, FIGURE.vertices, atol=1e-9)
    bent = {
        f"{joint}{side}": (angle, 0.0, 0.0)
        for joint, angle in (("Hip", -1.2), ("Knee", 2.0))
        for side in ("Left", "Right")
    }
    crouch = perform(puppet, [pose(bent, moved=(0.0, -0.5, 0.0))] * 3)[-1]
    assert crouch.vertices[:, 1].min() == pytest.approx(0.0, abs=1e-9)
    assert crouch.vertices[:, 1].max() < FIGURE.vertices[:, 1].max() - 0.1


@pytest.mark.parametrize("drives", [LEGS[:1], LEGS])
def test_what_pushes_against_the_floor_lifts_the_whole(
    puppet: Puppet, drives: Sequence[Drive]
) -> None:
    """From a crouch to standing: the character's legs were straight and now reach below it."""
    crouch = {f"Hip{side}": (-0.7, 0.0, 0.0) for side in ("Left", "Right")}
    crouch |= {f"Knee{side}": (1.4, 0.0, 0.0) for side in ("Left", "Right")}
    puppet.rest()
    low = pose({name: (-a, b, c) for name, (a, b, c) in crouch.items()})
    driven_by(puppet, drives, rest_state(seen(low)))
    for motion in perform(puppet, [pose(crouch)] * 4):
        assert motion.vertices[:, 1].min() >= -1e-9
