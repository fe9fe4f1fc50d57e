"""What goes fast stretches, what stops is squashed, and what is rigid stays as it is."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.driving.exaggeration import LONGEST_STEP, Exaggeration

STILL = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def swung(turn: float) -> np.ndarray:
    """The first tip turned about its start, the second where it was."""
    return np.array([[np.cos(turn), np.sin(turn), 0.0], STILL[1]])


def test_who_stands_still_is_not_stretched():
    exaggeration = Exaggeration(np.ones(2), 1.7)
    assert all(exaggeration.strain(k / 60.0, STILL, 0.0, 1.0).is_none for k in range(30))


def test_a_fast_limb_grows_and_is_squashed_when_it_stops():
    exaggeration = Exaggeration(np.ones(2), 1.7)
    turns = [0.15 * k for k in range(30)] + [0.15 * 29] * 60
    strains = [exaggeration.strain(k / 60.0, swung(t), 0.0, 1.0) for k, t in enumerate(turns)]
    lengths = np.array([strain.limbs[0] for strain in strains])
    assert lengths[:30].max() > 1.2
    assert 0.85 < lengths[30:].min() < 0.97
    assert lengths[-1] == pytest.approx(1.0, abs=0.01)
    assert all(strain.limbs[1] == 1.0 and strain.body == 1.0 for strain in strains)


def test_a_jump_stretches_the_body_and_the_landing_squashes_it():
    exaggeration = Exaggeration(np.ones(2), 1.7)
    flight = np.clip(np.sin(np.linspace(0.0, np.pi, 40)), 0.0, None) * 0.5
    lifts = [*np.zeros(5), *flight, *np.zeros(40)]
    bodies = [
        exaggeration.strain(k / 60.0, STILL, float(lift), 1.0).body for k, lift in enumerate(lifts)
    ]
    assert max(bodies) > 1.08
    assert min(bodies[45:]) < 0.99


@pytest.mark.parametrize("amount", [0.0, 0.5])
def test_the_amount_scales_what_is_shown(amount: float):
    full, part = (Exaggeration(np.ones(2), 1.7) for _ in range(2))
    for k in range(20):
        whole = full.strain(k / 60.0, swung(0.2 * k), 0.01 * k, 1.0)
        some = part.strain(k / 60.0, swung(0.2 * k), 0.01 * k, amount)
        np.testing.assert_allclose(some.limbs - 1.0, amount * (whole.limbs - 1.0), atol=1e-15)
        assert some.body - 1.0 == pytest.approx(amount * (whole.body - 1.0))
    assert (amount == 0.0) == some.is_none


def test_a_gap_in_time_is_not_taken_for_speed():
    exaggeration = Exaggeration(np.ones(2), 1.7)
    exaggeration.strain(0.0, STILL, 0.0, 1.0)
    assert exaggeration.strain(2.0 * LONGEST_STEP, swung(3.0), 1.0, 1.0).is_none
    assert exaggeration.strain(float("nan"), swung(0.0), 0.0, 1.0).is_none
