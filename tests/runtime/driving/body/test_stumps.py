"""Feet that show no toes: stumps, and the legs of toys that sit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.skeleton import Skeleton
from runtime.characters.character import Character
from tests.runtime.driving.body.test_body_driver import body, driver_of, follow
from tests.runtime.stick_figures import node, pose


def with_feet(*toes: tuple[float, float, float]) -> Character:
    """The figure with feet of such toes, from the left ankle, and mirrored on the right."""
    figure = body()
    names, parents = figure.skeleton.names, figure.skeleton.parents
    places = figure.skeleton.rest_positions
    for side, sign in (("L", 1.0), ("R", -1.0)):
        above = node(f"ankle.{side}")
        for number, (x, y, z) in enumerate(toes):
            places = np.vstack([places, places[node(f"ankle.{side}")] + (sign * x, y, z)])
            parents = np.append(parents, above)
            names, above = (*names, f"toe{number}.{side}"), len(names)
    skeleton = Skeleton(names, parents, places)
    plan = figure.plan
    assert plan is not None
    legs = {}
    for side, leg in plan.legs.items():
        letter = side.value[0].upper()
        ends = tuple(names.index(f"toe{number}.{letter}") for number in range(len(toes)))
        legs[side] = replace(leg, end=(node(f"ankle.{letter}"), *ends))
    return replace(figure, skeleton=skeleton, plan=replace(plan, legs=legs))


@pytest.mark.parametrize("toe", [(0.02, -0.04, -0.01), (0.0, -0.03, -0.08), (0.01, -0.04, 0.01)])
def test_a_stump_that_shows_no_toes_keeps_its_front_in_front(toe) -> None:
    driver = driver_of(with_feet(toe))
    nodes = follow(driver, pose())[-1]
    for ankle in ("ankle.L", "ankle.R"):
        turn = Rotation.from_quat(nodes.rotations[node(ankle)])
        assert np.degrees(turn.magnitude()) < 12.0


def test_a_foot_that_leads_aside_at_rest_turns_to_where_the_performer_s_points() -> None:
    nodes = follow(driver_of(with_feet((0.08, -0.03, 0.06))), pose())[-1]
    turn = Rotation.from_quat(nodes.rotations[node("ankle.L")])
    assert np.degrees(turn.magnitude()) > 40.0


def test_the_feet_of_a_toy_that_sits_go_on_straight_from_its_shins_when_it_stands() -> None:
    figure = with_feet((0.0, 0.0, 0.08))
    skeleton = figure.skeleton
    rest = skeleton.rest_positions.copy()
    for side, toe in (("L", -2), ("R", -1)):
        for number, name in enumerate(("knee", "ankle"), 1):
            rest[node(f"{name}.{side}")] = rest[node(f"hip.{side}")] + (0.0, 0.0, 0.3 * number)
        rest[toe] = rest[node(f"ankle.{side}")] + (0.0, 0.0, 0.08)
    sitting = replace(figure, skeleton=Skeleton(skeleton.names, skeleton.parents, rest))
    places = follow(driver_of(sitting), pose())[-1].positions
    for side, toe in (("L", -2), ("R", -1)):
        way = places[toe] - places[node(f"ankle.{side}")]
        assert way[1] < -0.95 * np.linalg.norm(way)
