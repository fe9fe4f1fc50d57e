"""How thick the parts of a body are around their bones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.bodies.joint_names import Side
from runtime.characters.open_character import load_character
from runtime.puppet.part_radii import part_radii
from runtime.puppet.puppet import Puppet
from tests.runtime.capsule_bodies import MOUSE, capsule_body, plan_of


def test_each_part_is_as_thick_as_it_was_made_and_legs_half_as_the_trunk() -> None:
    body = capsule_body(MOUSE)
    plan = plan_of(body)
    assert plan is not None
    tree = body.tree.rerooted(plan.hips)
    radii = part_radii(body.vertices, body.faces, tree, plan)
    made = {name: radius for name, (_, _, radius) in MOUSE.items()}
    for words, chain in plan.in_words().items():
        name = body.branch[chain[-1]]
        outer = radii[list(chain[len(chain) // 2 + 1 :])]
        half_way = np.sqrt(made["trunk"] * made[name])
        expected = half_way if name.startswith("leg") else made[name]
        np.testing.assert_allclose(outer, expected, rtol=0.25, err_msg=words)
    for pair in (plan.arms, plan.legs):
        assert len({float(radii[limb.chain[-1]]) for limb in pair.values()}) == 1
    ear = next(node for node, name in enumerate(body.branch) if name == "ear.L")
    assert radii[ear] == pytest.approx(made["ear.L"], rel=0.3)


def test_a_fat_belly_follows_the_trunk_and_not_limbs_that_begin_inside_it(shared: Path) -> None:
    character = load_character(shared / "mesh" / "teddy.obj").limb_by_limb
    rest, plan, tree = character.skeleton.rest_positions, character.plan, character.skeleton.tree
    skin = Puppet(character).bound_skeleton.skin
    arms = [node for arm in plan.arms.values() for node in tree.subtree(arm.upper[0])]
    shares = np.where(np.isin(skin.nodes, arms), skin.weights, 0.0).sum(axis=1)
    hips, shoulder = rest[plan.hips], rest[plan.arms[Side.LEFT].upper[0]]
    belly = (character.vertices[:, 1] > hips[1]) & (character.vertices[:, 1] < shoulder[1])
    belly &= np.abs(character.vertices[:, 0]) < shoulder[0]
    assert belly.sum() > 50
    assert shares[belly].mean() < 0.1
    legs = [node for leg in plan.legs.values() for node in leg.chain]  # of a toy that sits
    shares = np.where(np.isin(skin.nodes, legs), skin.weights, 0.0).sum(axis=1)
    above = character.vertices[:, 1] > hips[1] + 0.25 * (shoulder[1] - hips[1])
    above &= character.vertices[:, 1] < shoulder[1]
    assert shares[above].mean() < 0.04
