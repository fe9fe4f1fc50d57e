"""Measures of the visible tips and ends of limbs, on bodies whose difference is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.body_plan import BodyPlan, Limb
from devices.bodies.joint_names import Side
from runtime.benchmarks.resemblance.body_track import BodyTrack
from runtime.benchmarks.resemblance.limb_ends import LimbEnds
from runtime.benchmarks.resemblance.tips import compared_tips, tip_figures
from solvers.skeleton.tree import Tree
from tests.benchmarks.moved_bodies import performer, standing, wave

HEIGHTS = (1.8, 1.8)


def waving(across: float, up: float, depth: float = 0.0) -> BodyTrack:
    """The built-in body with its left hand moving so far [m] in phase, all else at rest."""
    body = standing(400)
    tip = body.plan.arms[Side.LEFT].chain[-1]
    positions = body.positions.copy()
    positions[:, tip] += wave(400, 1.0)[:, None] * (across, up, depth)
    return replace(body, positions=positions)


def test_a_body_is_seen_as_itself_whatever_its_size():
    source, rest = performer("wave"), standing(1)
    turn = Rotation.from_euler("y", 130.0, degrees=True)
    shape = source.positions.shape
    larger = replace(
        source, positions=2.5 * turn.apply(source.positions.reshape(-1, 3)).reshape(shape)
    )
    tip = tip_figures(source, larger, rest, (1.8, 4.5))["right arm"]
    assert tip.performer > 0.02
    assert tip.seen == pytest.approx(1.0)
    assert tip.up == pytest.approx(1.0)
    assert tip.aside == pytest.approx(1.0)


def test_a_stub_is_seen_less_and_a_tip_that_sinks_is_told():
    half = tip_figures(waving(0.3, 0.2), waving(0.15, -0.1), standing(1), HEIGHTS)["left arm"]
    assert half.seen == pytest.approx(0.5)
    assert half.up == pytest.approx(-1.0)
    assert half.aside == pytest.approx(1.0)


def test_what_swings_towards_the_audience_is_not_seen_and_in_profile_it_is():
    source, front = waving(0.3, 0.0, 0.3), waving(0.0, 0.0, 0.3)
    assert tip_figures(source, front, standing(1), HEIGHTS)["left arm"].seen < 1e-6
    rest = standing(1)
    turn = Rotation.from_euler("y", 90.0, degrees=True)
    profile = replace(rest, positions=turn.apply(rest.positions[0])[None])
    assert tip_figures(source, front, profile, HEIGHTS)["left arm"].seen == pytest.approx(1.0)


def test_a_tip_that_is_still_has_nothing_to_keep():
    still = compared_tips(np.zeros((9, 2)), np.ones((9, 2)))
    assert still.performer == 0.0
    assert np.isnan([still.seen, still.up, still.aside]).all()


def column() -> tuple[np.ndarray, np.ndarray]:
    """A closed leg, 1 m high and 0.2 m thick, in rings of eight from its foot up."""
    around = np.arange(8) / 8 * 2.0 * np.pi
    rings = [
        np.stack([0.1 * np.cos(around), np.full(8, height), 0.1 * np.sin(around)], axis=1)
        for height in np.linspace(0.0, 1.0, 21)
    ]
    vertices = np.concatenate([*rings, [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    faces = [[168, k, (k + 1) % 8] for k in range(8)]
    faces += [[169, 160 + (k + 1) % 8, 160 + k] for k in range(8)]
    for low in range(0, 160, 8):
        for k in range(8):
            a, b = low + k, low + (k + 1) % 8
            faces += [[a, a + 8, b], [b, a + 8, b + 8]]
    return vertices, np.array(faces)


def ends(parents: tuple[int, ...] = (-1, 0, 1)) -> tuple[LimbEnds, np.ndarray]:
    vertices, faces = column()
    nodes = np.array([[0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.0]])
    plan = BodyPlan(trunk=(0,), legs={Side.LEFT: Limb((0, 1), (1, 2))})
    return LimbEnds(vertices, faces, Tree(np.array(parents), nodes), plan), vertices


def test_an_end_that_turns_keeps_its_volume():
    kept, vertices = ends()
    turn = Rotation.from_rotvec([0.4, 1.0, -0.3])
    for _ in range(3):
        kept.add(turn.apply(vertices) + np.array([1.0, 2.0, 3.0]))
    assert kept.kept == {"left leg": pytest.approx(1.0)}


def test_a_skeleton_that_is_rooted_in_a_foot_has_the_same_ends():
    kept, vertices = ends(parents=(1, 2, -1))
    kept.add(vertices * np.where(vertices[:, 1:2] < 0.3, (1.0, 0.25, 1.0), 1.0))
    assert kept.kept["left leg"] == pytest.approx(0.25)


def test_a_foot_that_is_pressed_flat_is_crushed_and_a_pressed_thigh_is_not():
    kept, vertices = ends()
    foot = vertices * np.where(vertices[:, 1:2] < 0.3, (1.0, 0.25, 1.0), 1.0)
    kept.add(foot)
    assert kept.kept["left leg"] == pytest.approx(0.25)
    kept, vertices = ends()
    kept.add(vertices * np.where(vertices[:, 1:2] > 0.4, (0.3, 1.0, 0.3), 1.0))
    assert kept.kept["left leg"] == pytest.approx(1.0)
    kept.add(foot)  # one frame of many counts little, until it is the worst twentieth
    for _ in range(50):
        kept.add(vertices)
    assert kept.kept["left leg"] == pytest.approx(1.0)
