"""Rods and beads of highlighted chains."""

import numpy as np
import pytest

from runtime.render.tubes import PAIR_COLOURS, chain_tubes

LONG = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 1.0, 0.0]])
SHORT = np.array([[3.0, 0.0, 0.0], [3.0, 2.0, 0.0]])
RODS = [(LONG[0], LONG[1], 0), (LONG[1], LONG[2], 0), (SHORT[0], SHORT[1], 1)]


def test_every_chain_glows_below_its_rods_and_its_beads_lie_on_top() -> None:
    capsules = chain_tubes([LONG, SHORT], PAIR_COLOURS[:2], 0.1)
    assert capsules.shape == (3 + 3 + 5, 13)
    glow, rods, beads = np.split(capsules, [3, 6])
    for layer, radius in ((glow, 0.1), (rods, 0.062)):
        for capsule, (start, end, chain) in zip(layer, RODS, strict=True):
            np.testing.assert_allclose(capsule[0:4], [*start, radius], rtol=1e-6)
            np.testing.assert_allclose(capsule[4:8], [*end, radius], rtol=1e-6)
            np.testing.assert_allclose(capsule[8:11], PAIR_COLOURS[chain], rtol=1e-6)
    assert (glow[:, 12] > 0.0).all()
    assert not rods[:, 12].any()
    np.testing.assert_allclose(beads[:, :3], np.vstack([LONG, SHORT]))
    np.testing.assert_array_equal(beads[:, :4], beads[:, 4:8])
    assert (beads[:, 3] > rods[0, 3]).all()


def test_a_chain_of_one_node_is_a_bead() -> None:
    assert len(chain_tubes([SHORT[:1], SHORT], PAIR_COLOURS[:2], 0.1)) == 1 + 1 + 3


def test_no_chains_are_no_capsules() -> None:
    assert chain_tubes([], [], 0.1).shape == (0, 13)


def test_every_chain_needs_a_colour() -> None:
    with pytest.raises(
        ValueError, match=r"Expected `colours` to have shape \(2, 3\), got \(1, 3\)"
    ):
        chain_tubes([LONG, SHORT], PAIR_COLOURS[:1], 0.1)
