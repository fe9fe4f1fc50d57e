"""A skeleton is bound to the surface around it: the trunk, and the vertices of each bone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import (
    make_figure,
    node,
)

FIGURE = make_figure()


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(FIGURE)


def test_the_part_of_a_chain_in_the_trunk_is_cut_off(puppet: Puppet) -> None:
    inside = np.flatnonzero(puppet.bound_skeleton.binding.inside)
    arm = tuple(map(node, ("chest", "shoulder.L", "elbow.L", "wrist.L")))
    assert node("shoulder.L") in inside
    assert puppet.bound_skeleton.limb(arm) == arm[1:]
    assert puppet.bound_skeleton.limb(arm[:2]) == arm[:2], "two nodes are left at least"
    leg = tuple(map(node, ("knee.L", "ankle.L")))
    assert puppet.bound_skeleton.limb(leg) == leg


def test_a_rigs_weights_decide_what_a_bone_takes_along() -> None:
    """Weights that give the left half of everything to one arm."""
    weights = np.zeros((len(FIGURE.vertices), 15))
    left = FIGURE.vertices[:, 0] > 0.25
    weights[left, node("shoulder.L")] = 1.0
    weights[~left, node("pelvis")] = 1.0
    puppet = Puppet(replace(FIGURE, weights=csr_array(weights)))
    held = np.isin(puppet.bound_skeleton.binding.handles, np.flatnonzero(left))
    ends = puppet.bound_skeleton.binding.node[puppet.bound_skeleton.binding.anchor[held]]
    assert set(ends.tolist()) == {node("elbow.L")} | set(ends[ends == node("wrist.L")].tolist())
    np.testing.assert_allclose(puppet.deform().vertices, FIGURE.vertices, atol=1e-9)
