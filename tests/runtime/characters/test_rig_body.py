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


# Real files
