"""The body that is made for a rig without a mesh."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from runtime.characters.rig_body import body_around


def edges_of(faces: NDArray[np.int64]) -> Counter[tuple[int, int]]:
    return Counter(map(tuple, faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))


def figure() -> Skeleton:
    names = ("hip", "chest", "head", "arm_l", "hand_l", "arm_r", "hand_r", "foot_l", "foot_r")
    positions = np.array(
        [[0, 1, 0], [0, 1.4, 0], [0, 1.7, 0], [0.2, 1.4, 0], [0.7, 1.4, 0.1],
         [-0.2, 1.4, 0], [-0.7, 1.4, 0.1], [0.2, 0, 0], [-0.2, 0, 0]]
    )  # fmt: skip
    return Skeleton(names, np.array([-1, 0, 1, 1, 3, 1, 5, 0, 0]), positions)


def test_the_body_of_a_rig_is_one_closed_surface_round_its_bones() -> None:
    pytest.importorskip("manifold3d")
    skeleton = figure()
    vertices, faces, weights = body_around(skeleton)
    assert 3_000 <= len(vertices) <= 8_000
    edges = edges_of(faces)
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert len(vertices) - len(edges) // 2 + len(faces) == 2  # one piece without handles
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    assert np.einsum("mi,mi->", a, np.cross(b, c)) > 0.0  # faces outward
    assert weights.shape == (len(vertices), 9)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    hand = vertices[:, 0] > 0.4
    assert set(weights[hand].indices.tolist()) == {skeleton.index("arm_l")}


def test_the_body_of_a_rig_goes_with_its_unit() -> None:
    pytest.importorskip("manifold3d")
    small = figure()
    large = Skeleton(small.names, small.parents, 100.0 * small.rest_positions + [5.0, 0.0, -9.0])
    one, hundred = body_around(small)[0], body_around(large)[0]
    np.testing.assert_allclose(100.0 * one + [5.0, 0.0, -9.0], hundred, atol=1e-6)


def person(*, upright: bool) -> Skeleton:
    """A person without a bone for the head; or the same on all fours."""
    joints = [("Hips", "", (0.0, 1.0, 0.0)), ("Spine", "Hips", (0.0, 1.4, 0.0))]
    joints.append(("Head", "Spine", (0.0, 1.6, 0.0)))
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        joints += [
            (f"{side}Arm", "Spine", (0.2 * x, 1.4, 0.0)),
            (f"{side}ForeArm", f"{side}Arm", (0.45 * x, 1.4, 0.0)),
            (f"{side}Hand", f"{side}ForeArm", (0.7 * x, 1.4, 0.0)),
            (f"{side}UpLeg", "Hips", (0.1 * x, 1.0, 0.0)),
            (f"{side}Leg", f"{side}UpLeg", (0.1 * x, 0.5, 0.0)),
            (f"{side}Foot", f"{side}Leg", (0.1 * x, 0.0, 0.0)),
        ]
    names = [name for name, _, _ in joints]
    parents = np.array([names.index(above) if above else -1 for _, above, _ in joints])
    places = np.array([place for *_, place in joints])
    return Skeleton(tuple(names), parents, places if upright else places[:, [0, 2, 1]])


def test_a_body_that_stands_upright_has_a_head_with_a_nose() -> None:
    pytest.importorskip("manifold3d")
    vertices, _, weights = body_around(person(upright=True))
    head = vertices[vertices[:, 1] > 1.62]
    assert 1.75 < head[:, 1].max() < 1.85
    assert 0.12 < np.ptp(head[:, 0]) < 0.22
    assert head[:, 2].max() > -head[:, 2].min() + 0.02  # towards where it looks
    owner = np.asarray(weights.argmax(axis=1)).ravel()[vertices[:, 1] > 1.7]
    assert set(owner.tolist()) == {person(upright=True).names.index("Head")}


def test_no_head_is_added_to_a_body_that_lies() -> None:
    pytest.importorskip("manifold3d")
    vertices = body_around(person(upright=False))[0]
    assert vertices[:, 2].max() < 1.7


def test_a_body_that_is_one_chain_is_slender() -> None:
    pytest.importorskip("manifold3d")
    places = np.zeros((21, 3))
    places[:, 2] = np.linspace(0.0, 2.0, 21)
    snake = Skeleton(tuple(f"bone{n}" for n in range(21)), np.arange(-1, 20), places)
    vertices = body_around(snake)[0]
    assert np.ptp(vertices[:, 1]) < 2.0 / 12.0


# Real files
