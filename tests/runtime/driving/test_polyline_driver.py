"""Chains of a character turn as the chains of the performer that drive them, and no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.performer import Performer, rest_state
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    BRICK,
    FRONT_VIEW,
    LEGS,
    T_POSE,
    driven,
    frame,
    make_figure,
    node,
    perform,
    pose,
    seen,
    waving,
)

FIGURE = make_figure()
SIZE = float(np.ptp(FIGURE.vertices, axis=0).max())


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(FIGURE)


def test_an_arm_that_rises_raises_the_arm_it_drives(puppet: Puppet) -> None:
    driven(puppet, ARMS[:1])
    motion = perform(puppet, waving(13)[:7])[-1]
    rest = FIGURE.skeleton.rest_positions
    shoulder, elbow, wrist = node("shoulder.L"), node("elbow.L"), node("wrist.L")
    raised = motion.nodes.positions[elbow] - motion.nodes.positions[shoulder]
    assert np.arctan2(raised[1], raised[0]) > 1.0
    assert motion.nodes.positions[wrist, 1] > rest[wrist, 1] + 0.4
    hand = np.linalg.norm(FIGURE.vertices - rest[wrist], axis=1) < 2 * BRICK
    follows = Rotation.from_quat(motion.nodes.rotations[wrist]).apply(
        FIGURE.vertices[hand] - rest[wrist]
    )
    gap = motion.vertices[hand] - (follows + motion.nodes.positions[wrist])
    assert np.linalg.norm(gap, axis=1).max() < 0.05 * SIZE, "the surface goes where its bone goes"


def test_what_nothing_drives_stays_where_it_is(puppet: Puppet) -> None:
    driven(puppet, ARMS[:1])
    away = FIGURE.vertices[:, 0] < 0.0
    for motion in perform(puppet, waving(25)):
        drift = np.linalg.norm(motion.vertices - FIGURE.vertices, axis=1)[away]
        assert drift.max() < 0.01 * SIZE
    assert np.abs(motion.vertices - FIGURE.vertices).max() < 0.01 * SIZE, "and all comes back"


def test_bones_keep_their_length_and_the_root_its_place(puppet: Puppet) -> None:
    driven(puppet, (*ARMS, *LEGS))
    poses = [
        pose(
            {"ShoulderLeft": (a, 0.3 * a, a), "HipRight": (-a, 0, 0.2 * a), "KneeRight": (a, 0, 0)}
        )
        for a in np.linspace(0.0, 2.0, 9)
    ]
    parents, root = puppet.bound_skeleton.tree.parents, puppet.bound_skeleton.root
    bones = parents >= 0
    rest = puppet.bound_skeleton.tree.positions
    length = np.linalg.norm(rest[bones] - rest[parents[bones]], axis=1)
    for motion in perform(puppet, poses):
        nodes = motion.nodes.positions
        now = np.linalg.norm(nodes[bones] - nodes[parents[bones]], axis=1)
        np.testing.assert_allclose(now, length, atol=1e-12)
        np.testing.assert_allclose(nodes[root], rest[root], atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(motion.nodes.rotations, axis=1), 1.0, atol=1e-12)


def test_an_arm_alone_neither_turns_nor_lifts_the_whole(puppet: Puppet) -> None:
    driven(puppet, ARMS[:1])
    motion = perform(puppet, [pose(heading=0.9, moved=(0.0, 0.5, 0.0))])[0]
    np.testing.assert_allclose(motion.vertices, FIGURE.vertices, atol=1e-9)


def test_chains_may_lead_away_from_whatever_node_one_of_them_starts_at(puppet: Puppet) -> None:
    down = replace(ARMS[0], target=(node("head"), node("chest"), node("pelvis")))
    driven(puppet, (ARMS[1], down))
    motion = perform(puppet, waving(13)[:7])[-1]
    shift = np.linalg.norm(motion.nodes.positions - FIGURE.skeleton.rest_positions, axis=1)
    assert shift[node("head")] < 1e-12
    assert shift[node("pelvis")] > 0.4
    assert shift[node("ankle.R")] > 0.4, "what hangs on it rides along"


def test_impossible_chains_are_refused_and_change_nothing(puppet: Puppet) -> None:
    start = driven(puppet, ARMS)
    driver = puppet.driver
    twice = (*ARMS, replace(ARMS[0], target=(node("chest"), *ARMS[0].target)))
    apart = (
        Drive(ARMS[0].source, (node("wrist.L"), node("elbow.L"))),
        Drive(ARMS[1].source, (node("wrist.R"), node("elbow.R"))),
    )
    for drives in (twice, apart):
        driver.show(Mapping(drives), FRONT_VIEW)
        with pytest.raises(InputError) as refused:
            driver.prepare((), rest_state(start))
        text = str(refused.value)
        assert text.startswith("figure cannot be driven so: ")
        assert "away from one node" in text
        assert "\n" not in text
    moved = perform(puppet, waving(5)[:3])[-1].vertices.copy()
    driven(puppet, ARMS)
    np.testing.assert_array_equal(moved, perform(puppet, waving(5)[:3])[-1].vertices)
    assert np.abs(moved - FIGURE.vertices).max() > 0.2


def test_chains_may_lead_away_from_where_the_first_begins(puppet: Puppet) -> None:
    """From a foot up through the body: the foot stays, and the rest is moved."""
    up = Drive(LEGS[0].source, tuple(map(node, ("ankle.L", "knee.L", "hip.L", "pelvis"))))
    driven(puppet, [up])
    motion = perform(puppet, [pose({"HipLeft": (0.0, 0.0, 0.4)})] * 3)[-1]
    moved = motion.nodes.positions - FIGURE.skeleton.rest_positions
    lifted = np.array([0.0, moved[node("ankle.L"), 1], 0.0])  # the other foot meets the floor
    np.testing.assert_allclose(moved[node("ankle.L")], lifted, atol=1e-12)
    assert np.linalg.norm(moved[node("head")] - lifted) > 0.2
    ends = [node("knee.L"), node("ankle.L")]
    shin = np.abs(FIGURE.vertices - FIGURE.skeleton.rest_positions[ends].mean(axis=0)).max(axis=1)
    middle = motion.vertices[shin < 1.6 * BRICK].mean(axis=0)
    assert np.linalg.norm(middle - motion.nodes.positions[ends].mean(axis=0)) < 0.03
    away = np.linalg.norm(motion.vertices - FIGURE.vertices - lifted, axis=1)
    assert away[FIGURE.vertices[:, 1] > 1.3].min() > 0.2
    assert away[(FIGURE.vertices[:, 1] == 0.0) & (FIGURE.vertices[:, 0] > 0.0)].max() < 0.1


def test_resting_again_brings_it_back(puppet: Puppet) -> None:
    driven(puppet, (*ARMS, *LEGS))
    perform(puppet, [pose(T_POSE, heading=1.0, moved=(0.0, 0.4, 0.0))])
    puppet.driver.prepare((), None)
    puppet.rest()
    for _ in range(30):
        motion = puppet.deform()
    np.testing.assert_allclose(motion.vertices, FIGURE.vertices, atol=0.01 * SIZE)
    puppet.follow(seen(pose(T_POSE)))
    nodes = puppet.deform().nodes.positions
    np.testing.assert_allclose(nodes, puppet.bound_skeleton.tree.positions, atol=1e-12)


def test_a_cartoon_stretches_the_limbs_that_swing_and_rigid_ones_keep_their_length(
    puppet: Puppet,
) -> None:
    def reach(cartoon: float) -> np.ndarray:
        driven(puppet, ARMS)
        puppet.surface.elasticity = Elasticity(cartoon=cartoon)
        performer, lengths = Performer(BODY), []
        for number, positions in enumerate(waving(24)):
            puppet.follow(performer.follow(frame(positions, number / 60.0)))
            vertices = puppet.deform().vertices
            assert np.isfinite(vertices).all()
            bones = np.diff(puppet.highlights[0].points, axis=0)
            lengths.append((np.linalg.norm(bones, axis=1).sum(), np.ptp(vertices[:, 0])))
        puppet.surface.elasticity = Elasticity()
        return np.array(lengths)

    rigid, cartoon = reach(0.0), reach(1.0)
    np.testing.assert_allclose(rigid[:, 0], rigid[0, 0], rtol=1e-9)
    assert cartoon[:, 0].max() > 1.1 * rigid[0, 0]
    assert cartoon[:, 1].max() > rigid[:, 1].max() + 0.02, "the surface goes along"
