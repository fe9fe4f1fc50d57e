"""A puppet whose driver poses every node follows by its skin, relaxed by the solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from runtime.driving.targets import PosedNodes, SkinnedTargets, Targets
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import make_figure, node, pose, seen

FIGURE = make_figure()
REST = FIGURE.skeleton.rest_positions
ANYBODY = seen(pose())  # the drivers of these tests do not look at the performer
UNTURNED = np.tile([0.0, 0.0, 0.0, 1.0], (len(REST), 1))
FOREARM = (node("elbow.L"), node("wrist.L"))


class Poser:
    """Poses the nodes as it is told; what else a driver has is not asked for here."""

    def __init__(self, puppet: Puppet) -> None:
        self.nodes = PosedNodes(REST, UNTURNED)
        self._skeleton = puppet.bound_skeleton
        puppet.drive_with(self)

    def targets(self, pose: object) -> Targets:
        return Targets(self._skeleton.skinned(self.nodes), nodes=self.nodes)

    def reset(self) -> None:
        """Nothing is remembered."""

    def snapshot(self) -> PosedNodes:
        return self.nodes

    def restore(self, state: PosedNodes) -> None:
        self.nodes = state


def bent(angle: float) -> PosedNodes:
    """The left elbow, bent forward by an angle [rad]."""
    turn = Rotation.from_rotvec([0.0, -angle, 0.0])
    positions, rotations = REST.copy(), UNTURNED.copy()
    positions[FOREARM[1]] = REST[FOREARM[0]] + turn.apply(REST[FOREARM[1]] - REST[FOREARM[0]])
    rotations[list(FOREARM)] = turn.as_quat()
    return PosedNodes(positions, rotations)


@pytest.fixture
def puppet() -> Puppet:
    return Puppet(FIGURE)


def perform(puppet: Puppet, *poses: PosedNodes) -> list[np.ndarray]:
    """The vertices in each pose, frame after frame."""
    shown = []
    for nodes in poses:
        puppet.driver.nodes = nodes
        puppet.follow(ANYBODY)
        shown.append(puppet.deform().vertices.copy())
        puppet.settle()
    return shown


def test_unposed_nodes_are_the_rest_pose(puppet: Puppet) -> None:
    poser = Poser(puppet)
    still, _, back = perform(puppet, poser.nodes, bent(1.5), poser.nodes)
    np.testing.assert_allclose(still, FIGURE.vertices, atol=1e-6)
    np.testing.assert_array_equal(still, back)


def test_the_forearm_follows_the_elbow_and_the_trunk_stays(puppet: Puppet) -> None:
    Poser(puppet)
    nodes = bent(1.2)
    (shown,) = perform(puppet, nodes)
    x, y, _ = FIGURE.vertices.T
    trunk = x < 0.2
    np.testing.assert_allclose(shown[trunk], FIGURE.vertices[trunk], atol=0.005)
    hand = (x > 0.75) & (y > 1.0)
    turn = Rotation.from_quat(nodes.rotations[FOREARM[0]])
    expected = REST[FOREARM[0]] + turn.apply(FIGURE.vertices[hand] - REST[FOREARM[0]])
    np.testing.assert_allclose(shown[hand], expected, atol=0.02)


def test_weights_of_a_file_are_its_skin() -> None:
    weights = np.zeros((len(FIGURE.vertices), len(REST)))
    weights[:, node("pelvis")] = 1.0
    puppet = Puppet(replace(FIGURE, weights=csr_array(weights)))
    Poser(puppet)
    (shown,) = perform(puppet, bent(1.5))
    np.testing.assert_allclose(shown, FIGURE.vertices, atol=1e-6)


def test_the_same_bytes_after_a_snapshot(puppet: Puppet) -> None:
    Poser(puppet)
    perform(puppet, bent(0.3), bent(0.5))
    state = puppet.snapshot()
    first = perform(puppet, bent(0.9), bent(-0.4))
    puppet.rest()  # handles are held for a while
    puppet.deform()
    puppet.settle()
    puppet.restore(state)
    np.testing.assert_array_equal(first, perform(puppet, bent(0.9), bent(-0.4)))


def test_an_attempt_strikes_the_pose_that_a_show_strikes(puppet: Puppet) -> None:
    poser = Poser(puppet)
    poser.nodes = bent(1.0)
    tried = puppet.attempt(ANYBODY).vertices.copy()
    np.testing.assert_array_equal(perform(puppet, bent(-0.7), bent(1.0))[-1], tried)


def test_handles_hold_again_after_a_skin(puppet: Puppet) -> None:
    Poser(puppet)
    perform(puppet, bent(1.3))
    puppet.rest()
    for _ in range(4):
        rested = puppet.deform().vertices
        puppet.settle()
    np.testing.assert_allclose(rested, FIGURE.vertices, atol=1e-6)


def test_a_firmer_skin_is_met_more_closely(puppet: Puppet) -> None:
    surface, skinned = puppet.surface, puppet.bound_skeleton.skinned(bent(1.5)).positions
    gaps = [
        np.abs(surface.deform(SkinnedTargets(skinned, firmness), 1) - skinned).max()
        for firmness in (0.02, 0.2, 50.0)
    ]
    assert gaps[0] > 1.5 * gaps[1] > 1.5 * gaps[2] > 0.0


@pytest.mark.parametrize("elasticity", [Elasticity(cartoon=0.8), Elasticity(stiffness=0.7)])
def test_the_material_still_counts(puppet: Puppet, elasticity: Elasticity) -> None:
    Poser(puppet)
    (plain,) = perform(puppet, bent(1.5))
    puppet.surface.elasticity = elasticity
    (other,) = perform(puppet, bent(1.5))
    assert np.isfinite(other).all()
    assert 1e-4 < np.abs(other - plain).max() < 0.1
