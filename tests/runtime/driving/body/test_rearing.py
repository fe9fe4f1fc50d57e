"""Four-legged bodies rear when both arms go up, and no other body does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.plan_by_names import plan_by_names
from devices.skeleton import Skeleton
from runtime.driving.body.body_parts import TwoBodies
from runtime.driving.body.rearing import MOST, Rearing
from solvers.retarget.trunk_turns import UPRIGHT
from tests.runtime.stick_figures import BODY

LEFT = np.array([1.0, 0.0, 0.0])
REST = BODY.rest_positions
ARMS = {
    side: [BODY.index(f"{name}{side}") for name in ("Shoulder", "Elbow", "Wrist")]
    for side in ("Left", "Right")
}


def limb(name: str, hangs_on: str, places: list[tuple[float, float, float]]):
    """Joints of a left limb and of its mirror image at the right."""
    words = {"leg": ("thigh", "shin", "foot"), "arm": ("upper_arm", "forearm", "hand")}[name]
    for side, sign in (("L", 1.0), ("R", -1.0)):
        above = hangs_on
        for word, (x, y, z) in zip(words, places, strict=True):
            yield f"{word}.{side}", above, (sign * x, y, z)
            above = f"{word}.{side}"


def rearing_of(shoulders: tuple[float, float, float], hand: float) -> Rearing:
    """A body with its hips at 0.6 m, and hands that are `hand` above the floor."""
    x, y, z = shoulders
    joints = [
        ("hips", "", (0.0, 0.6, 0.0)),
        ("spine", "hips", (0.0, (0.6 + y) / 2, z / 2)),
        ("chest", "spine", (0.0, y, z)),
        *limb("leg", "hips", [(0.1, 0.55, 0.0), (0.1, 0.3, 0.0), (0.1, 0.0, 0.0)]),
        *limb("arm", "chest", [(x, y, z), (x, (y + hand) / 2, z), (x, hand, z)]),
    ]
    names = [name for name, _, _ in joints]
    parents = np.array([names.index(above) if above else -1 for _, above, _ in joints])
    skeleton = Skeleton(tuple(names), parents, np.array([place for *_, place in joints]))
    source, plan = plan_by_names(BODY), plan_by_names(skeleton)
    assert source is not None
    assert plan is not None
    every = frozenset(range(len(BODY.names)))
    return Rearing(TwoBodies(BODY, source, every, REST, skeleton, plan, skeleton.tree, 0.0))


DOG = ((0.1, 0.6, 0.8), 0.0)
PERSON = ((0.2, 1.2, 0.0), 0.5)


def with_arms(left: float, right: float) -> np.ndarray:
    """The performer with straight arms at angles [degrees] above the horizon."""
    joints = REST.copy()
    for side, sign, angle in (("Left", 1.0, left), ("Right", -1.0, right)):
        arm = ARMS[side]
        length = np.linalg.norm(np.diff(REST[arm], axis=0), axis=1)
        way = np.array([sign * np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
        joints[arm[1]] = joints[arm[0]] + length[0] * way
        joints[arm[2]] = joints[arm[1]] + length[1] * way
    return joints


@pytest.mark.parametrize(
    ("left", "right", "share"),
    [(90, 90, 1.0), (-90, -90, 0.0), (-40, 80, 0.0), (90, np.degrees(np.arcsin(0.05)), 0.5)],
)
def test_the_lower_arm_says_how_far_an_animal_rears(left, right, share: float) -> None:
    assert rearing_of(*DOG).angle(with_arms(left, right)) == pytest.approx(share * MOST)


def test_a_body_that_stands_upright_does_not_rear() -> None:
    raised = with_arms(90, 90)
    assert rearing_of(*PERSON).angle(raised) == 0.0
    assert rearing_of(*PERSON).reared(UPRIGHT, raised, LEFT) is UPRIGHT


def test_the_chest_rises_whole_and_pelvis_and_head_half_about_the_left() -> None:
    turned = Rotation.from_euler("y", 0.4)
    trunk = np.tile(turned.as_quat(), (3, 1))
    out = rearing_of(*DOG).reared(trunk, with_arms(90, 90), turned.apply(LEFT))
    front = Rotation.from_quat(out).apply([0.0, 0.0, 1.0])
    angles = np.array([0.5, 1.0, 0.5]) * MOST
    np.testing.assert_allclose(front[:, 1], np.sin(angles), atol=1e-12)
    level = turned.apply([0.0, 0.0, 1.0])[[0, 2]]
    np.testing.assert_allclose(front[:, [0, 2]], np.outer(np.cos(angles), level), atol=1e-12)


@pytest.mark.parametrize(
    ("body", "lean", "left"),
    [(DOG, 5.0, 1.25), (DOG, -5.0, -1.25), (DOG, 60.0, 48.0), (PERSON, 5.0, 5.0)],
)
def test_an_animal_hardly_leans_with_who_walks_but_bows_with_who_bows(body, lean, left) -> None:
    half = 0.5 * np.radians(lean)
    trunk = np.tile([np.sin(half), 0.0, 0.0, np.cos(half)], (3, 1))
    turned = rearing_of(*body).reared(trunk, with_arms(-90, -90), LEFT)
    angles = np.degrees(2.0 * np.arctan2(turned[:, 0], turned[:, 3]))
    np.testing.assert_allclose(angles, [left, left, lean])
