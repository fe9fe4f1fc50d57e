"""The parts that can be chosen: names, groups that repeat, and what each vertex belongs to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from runtime.characters.character import Character
from runtime.characters.open_character import load_character
from runtime.driving.by_hand.parts import (
    Parts,
    chains_of_vertices,
    character_parts,
    performer_parts,
)
from runtime.puppet.puppet import Puppet
from solvers.skeleton.limbs import closest_bones
from tests.runtime.stick_figures import BODY, make_figure


def parts_of(character: Character) -> tuple[Parts, Puppet]:
    puppet = Puppet(character)
    return character_parts(character, puppet.bound_skeleton), puppet


@pytest.fixture(scope="module")
def squid() -> tuple[Parts, Puppet]:
    return parts_of(load_character("squid"))


def test_a_performer_has_the_parts_of_a_body() -> None:
    parts = performer_parts(BODY)
    assert {"left arm", "right arm", "left leg", "right leg", "head", "trunk"} <= set(parts.names)
    arm = parts.chains[parts.named("left arm")]
    assert [BODY.names[joint] for joint in arm][:3] == ["ShoulderLeft", "ElbowLeft", "WristLeft"]


def test_the_arms_of_a_squid_repeat_and_stand_in_a_ring(squid: tuple[Parts, Puppet]) -> None:
    parts, _ = squid
    (group,) = parts.groups
    assert sorted(parts.names[chain][:10] for chain in group) == [
        f"tentacle {number}" for number in range(1, 9)
    ]
    tips = parts_tips(parts, squid[1], group)
    steps = np.linalg.norm(np.diff(tips, axis=0, append=tips[:1]), axis=1)
    shuffled = np.linalg.norm(tips - tips[[3, 6, 1, 7, 0, 5, 2, 4]], axis=1)
    assert steps.sum() < shuffled.sum(), "each beside the one before"
    assert parts.alike(parts.named("mantle")) == (parts.named("mantle"),)


def parts_tips(parts: Parts, puppet: Puppet, group: tuple[int, ...]) -> np.ndarray:
    nodes = puppet.bound_skeleton.tree.positions
    return np.array([nodes[parts.chains[chain][-1]] for chain in group])


def test_left_and_right_of_cactus_and_bodies_repeat() -> None:
    parts, _ = parts_of(load_character("cactus"))
    named = {frozenset(parts.names[chain] for chain in group) for group in parts.groups}
    assert frozenset({"left", "right"}) in named
    parts, _ = parts_of(load_character("trex"))
    named = {frozenset(parts.names[chain] for chain in group) for group in parts.groups}
    assert named == {
        frozenset({"left arm", "right arm"}),
        frozenset({"left leg", "right leg"}),
    }


@pytest.mark.parametrize(
    ("file", "least"),
    [("mesh/octopus-low.mesh", 8), ("rig/m2m_rig-spider.glb", 8), ("mesh/cgal_man.off", 2)],
)
def test_arms_of_real_meshes_repeat(shared: Path, file: str, least: int) -> None:
    parts, _ = parts_of(load_character(str(shared / file)))
    assert max(map(len, parts.groups)) >= least, parts.groups


def test_words_mean_a_part_by_its_name_or_a_beginning_of_it(squid: tuple[Parts, Puppet]) -> None:
    parts, _ = squid
    third = parts.named("tentacle 3")
    assert parts.names[third].startswith("tentacle 3 of 8")
    assert parts.named("Tentacle-3") == parts.named(parts.names[third]) == third
    with pytest.raises(InputError, match="'tentacle' means several parts; there are: tentacle 1"):
        parts.named("tentacle")
    with pytest.raises(InputError, match="'wing' is no part; there are: mantle; tentacle"):
        parts.named("wing")


def test_the_nearest_part_is_the_one_with_the_same_bones(squid: tuple[Parts, Puppet]) -> None:
    parts, _ = squid
    chain = parts.chains[2]
    assert parts.nearest(chain[3:]) == 2
    assert parts.nearest((*chain[:2], *parts.chains[3][1:])) == 3
    assert parts.nearest((0, 999)) is None


@pytest.mark.parametrize("name", ["squid", "cactus", "trex", "mannequin"])
def test_vertices_belong_to_the_chain_that_runs_through_them(name: str) -> None:
    parts, puppet = parts_of(load_character(name))
    skeleton, vertices = puppet.bound_skeleton, puppet.character.vertices
    chains = chains_of_vertices(parts, skeleton)
    assert len(chains) == len(vertices)
    assert chains.min() >= 0
    tree = skeleton.tree
    away = tree.rerooted(parts.root).parents
    far, distance = closest_bones(vertices, away, tree.positions)
    clear = distance < np.quantile(distance, 0.3)  # thin limbs, where nothing is in doubt
    agree = chains[clear] == parts.of_node[far[clear]]
    assert agree.mean() > 0.9


def test_all_vertices_of_a_dense_surface_belong_to_a_chain(shared: Path) -> None:
    parts, puppet = parts_of(load_character(str(shared / "mesh/cgal_armadillo.off")))
    chains = chains_of_vertices(parts, puppet.bound_skeleton)
    assert len(chains) == len(puppet.character.vertices)
    assert len(np.unique(chains)) > 4


def test_names_are_told_apart() -> None:
    parts, _ = parts_of(make_figure())
    assert len(set(parts.names)) == len(parts.names)
