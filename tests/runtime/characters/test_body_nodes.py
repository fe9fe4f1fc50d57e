"""Nodes for driving a bare mesh limb by limb: hips, shoulders, a spine, both sides alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.bodies.body_plan import SIDES
from devices.bodies.joint_names import Side
from devices.bodies.limb_segments import arm_segments
from replay.builtin import builtin_recording
from runtime.characters.body_nodes.body_nodes import body_nodes
from runtime.characters.body_nodes.crotch import crotch_height, thigh_line
from runtime.characters.body_nodes.limb_lines import divided, made_alike, outside_trunk
from runtime.characters.character import Body, Character
from runtime.characters.open_character import load_character
from runtime.characters.plan_by_shape import plan_by_shape
from runtime.show.open_stream import play
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show
from solvers.skeleton.limbs import surface_points
from solvers.skeleton.mirror_plane import MirrorPlane, mirror_planes
from tests.runtime.capsule_bodies import DOG, PERSON, CapsuleBody, capsule_body
from tests.thorough import third_of

MIDDLE = MirrorPlane(np.array([1.0, 0.0, 0.0]), 0.0, 0.0)


def box(low: tuple[float, float, float], high: tuple[float, float, float]):
    """The 8 corners of a box and its 12 triangles."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return np.array(low) + corners * (np.array(high) - np.array(low)), faces


def on_two_legs():
    """A trunk on two legs that leave a gap of 2 mm below 0.8 m."""
    parts = [
        box((-0.2, 0.8, -0.1), (0.2, 1.5, 0.1)),
        box((0.001, 0.0, -0.1), (0.2, 0.81, 0.1)),
        box((-0.2, 0.0, -0.1), (-0.001, 0.81, 0.1)),
    ]
    faces = np.concatenate([faces + 8 * part for part, (_, faces) in enumerate(parts)])
    return np.concatenate([vertices for vertices, _ in parts]), faces


def nodes_of(body: CapsuleBody) -> Body:
    points = surface_points(body.vertices, body.faces)
    planes = mirror_planes(points, 4)
    plan = plan_by_shape(body.vertices, body.faces, body.tree, planes)
    assert plan is not None
    return body_nodes(body.vertices, body.faces, points, body.tree, plan, planes[0])


def test_legs_end_where_the_mirror_plane_cuts_the_surface_no_more() -> None:
    vertices, faces = on_two_legs()
    assert crotch_height(vertices, faces, MIDDLE, 1.2) == pytest.approx(0.8)


def test_the_middle_of_a_thigh_is_the_middle_of_its_slices() -> None:
    points = surface_points(*on_two_legs())
    left, width = thigh_line(points, MIDDLE, 1.0, 0.8, 0.2)
    right, _ = thigh_line(points, MIDDLE, -1.0, 0.8, 0.2)
    assert width == pytest.approx(0.2, abs=0.01)
    np.testing.assert_allclose(left[:, 0], 0.1, atol=0.01)
    np.testing.assert_allclose(right, MIDDLE.mirrored(left), atol=0.01)
    assert left[0, 1] == pytest.approx(0.8 + 0.45 * 0.2, abs=0.01)
    assert left[-1, 1] == pytest.approx(0.2)
    assert not len(thigh_line(points[points[:, 0] > 0.0], MIDDLE, -1.0, 0.8, 0.2)[0])


def test_a_hanging_arm_begins_where_it_turns_down() -> None:
    line = np.array([[0.0, 1.4, 0], [0.1, 1.4, 0], [0.2, 1.38, 0], [0.22, 1.1, 0], [0.24, 0.8, 0]])
    assert np.linalg.norm(outside_trunk(line)[0] - line[2]) < 0.03
    level = np.array([[0.0, 1.4, 0], [0.3, 1.4, 0], [0.6, 1.4, 0]])
    np.testing.assert_array_equal(outside_trunk(level), level)


def test_limbs_that_are_nearly_alike_become_alike_and_posed_ones_stay() -> None:
    left = np.array([[0.1, 1.4, 0.0], [0.6, 1.4, 0.02]])
    one, other = made_alike(left, np.array([[-0.1, 1.4, 0.0], [-0.6, 1.4, -0.02]]), MIDDLE, 1.7)
    np.testing.assert_allclose(one, MIDDLE.mirrored(other), atol=1e-12)
    np.testing.assert_allclose(one[:, 2], 0.0, atol=1e-12)
    posed = np.array([[-0.1, 1.4, 0.0], [-0.2, 0.9, 0.0]])
    np.testing.assert_allclose(made_alike(left, posed, MIDDLE, 1.7)[1][-1], posed[-1])


def test_both_limbs_are_divided_at_the_same_places() -> None:
    bent = np.array([[0.1, 1.4, 0.0], [0.4, 1.4, 0.0], [0.4, 1.1, 0.0], [0.4, 1.0, 0.1]])
    straight = np.array([[-0.1, 1.4, 0.0], [-0.8, 1.4, 0.0]])
    one, other = divided(*made_alike(bent, straight, MIDDLE, 1.0), MIDDLE, arm_segments)
    lengths = [
        [np.linalg.norm(np.diff(piece, axis=0), axis=1).sum() for piece in pieces]
        for pieces in (one, other)
    ]
    np.testing.assert_allclose(np.divide(*lengths), np.sum(lengths[0]) / 0.7, rtol=0.08)


def test_a_body_gets_a_spine_and_two_sides_that_are_mirror_images() -> None:
    body = nodes_of(capsule_body(PERSON))
    rest, plan = body.skeleton.rest_positions, body.plan
    assert len(plan.trunk) == 5
    np.testing.assert_allclose(rest[list(plan.trunk), 0], 0.0, atol=0.005)
    for limbs, end in ((plan.arms, (0.6, 0.95, 0.05)), (plan.legs, (0.11, 0.02, 0.16))):
        left, right = (rest[list(limbs[side].chain)] for side in SIDES)
        np.testing.assert_allclose(left, right * (-1, 1, 1), atol=0.01)
        np.testing.assert_allclose(left[-1], end, atol=0.01)
        assert len(limbs[Side.LEFT].segments) == 3
    knee = rest[plan.legs[Side.LEFT].upper[-1]]
    np.testing.assert_allclose(knee, (0.11, 0.45, 0.03), atol=0.06)


def test_legs_like_columns_go_down_through_their_middle(shared: Path) -> None:
    character = load_character(shared / "mesh" / "elephant.obj").limb_by_limb
    rest = character.skeleton.rest_positions
    for leg in character.plan.legs.values():
        line = rest[list(leg.chain)]
        np.testing.assert_allclose(
            line[:, [0, 2]], line[:1, [0, 2]].repeat(len(line), 0), atol=0.03
        )
        assert line[-1, 1] < 0.01


def test_what_belongs_to_no_part_stays_where_it_hung() -> None:
    figure = capsule_body(DOG)
    body = nodes_of(figure)
    ears = [node for node, name in enumerate(figure.branch) if name.startswith("ear")]
    for ear in ears:
        gaps = np.linalg.norm(body.skeleton.rest_positions - figure.tree.positions[ear], axis=1)
        place = int(np.argmin(gaps))
        assert gaps[place] == 0.0
        assert set(body.plan.head) & set(body.skeleton.tree.chain(place, body.plan.hips))
    assert body.plan.arm_word == "foreleg"
    assert body.plan.tail


def in_a_show(character: Character, **match: object) -> Character:
    settings = ShowSettings(match=MatchSettings(**match))
    with Show(play(builtin_recording(), every_frame=True), [character], settings) as show:
        return show.puppets[0].character


def test_a_skeleton_is_matched_and_the_nodes_of_a_body_are_driven(shared: Path) -> None:
    character = load_character(shared / "mesh" / "decimated-knight.off")
    assert character.body is not None
    assert in_a_show(character, driver="relative").skeleton is character.skeleton
    assert in_a_show(character, flip=True).skeleton is character.skeleton
    assert in_a_show(character).skeleton is character.body.skeleton


def test_thighs_without_a_gap_that_voxels_see_have_their_hips_above_the_crotch(
    shared: Path,
) -> None:
    character = load_character(shared / "rig" / "m2m_model-human.glb").limb_by_limb
    rest, plan = character.skeleton.rest_positions, character.plan
    height = np.ptp(character.vertices[:, 1])
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        hip, knee, ankle = (
            rest[node] / height
            for node in (plan.legs[side].upper[0], *(c[-1] for c in plan.legs[side].segments[:2]))
        )
        assert 0.47 < hip[1] < 0.54
        assert 0.2 < knee[1] < 0.3
        assert sign * ankle[0] > 0.03
        assert np.linalg.norm(hip - knee) == pytest.approx(np.linalg.norm(knee - ankle), rel=0.6)


@pytest.mark.parametrize("name", third_of(["elephant.obj", "cgal_armadillo.off", "cgal_dino.off"]))
def test_a_short_trunk_can_bend(shared: Path, name: str) -> None:
    character = load_character(shared / "mesh" / name)
    assert len(character.plan.trunk) == 1
    assert len(character.limb_by_limb.plan.trunk) == 5
