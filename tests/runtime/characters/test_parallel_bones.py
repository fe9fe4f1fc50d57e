"""Bundles of bones that start at one joint get a node where they part."""

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from devices.skeleton import Skeleton
from runtime.characters.builtin import builtin_character
from runtime.characters.character import Character
from runtime.characters.parallel_bones import split_parallel_bones


def with_skeleton(positions: list[tuple[float, float, float]], parents: list[int]) -> Character:
    character = builtin_character("paper")
    names = tuple(f"joint{number}" for number in range(len(parents)))
    weights = np.zeros((len(character.vertices), len(parents)))
    weights[:, 0] = 1.0
    return replace(
        character,
        skeleton=Skeleton(names, np.array(parents), np.array(positions)),
        weights=csr_array(weights),
    )


def test_fingers_that_hang_on_the_elbow_get_a_wrist() -> None:
    hand = with_skeleton(
        [(0, 0, 0), (1, 0, 0), (2, 0.1, 0), (2, 0, 0), (2, -0.1, 0), (1, 1, 0)],
        [-1, 0, 1, 1, 1, 1],
    )
    after = split_parallel_bones(hand)
    assert after.skeleton.names[6] == "joint1 parts"
    assert after.skeleton.parents.tolist() == [-1, 0, 6, 6, 6, 1, 1]
    np.testing.assert_allclose(after.skeleton.rest_positions[6], [1.85, 0.0, 0.0], atol=0.01)
    assert after.weights is not None
    assert after.weights.shape == (len(hand.vertices), 7)
    assert after.weights.sum() == len(hand.vertices)


def test_limbs_that_part_at_once_stay_as_they_are() -> None:
    fork = with_skeleton([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.7, 0.7, 0)], [-1, 0, 0, 0])
    assert split_parallel_bones(fork) is fork


def test_built_in_characters_have_no_bundles() -> None:
    squid = builtin_character("squid")
    assert split_parallel_bones(squid) is squid
