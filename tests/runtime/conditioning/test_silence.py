"""A performer who sends no more counts as unseen, until everything is at rest."""

from __future__ import annotations

import math

import numpy as np

from runtime.conditioning.silence import AT_REST, SILENT, Silence
from tests.runtime.stick_figures import T_POSE, frame, pose


def test_nobody_is_made_up_before_the_first_frame() -> None:
    assert Silence(2).unseen({}, 5.0) == {}
    assert math.isnan(Silence(1).newest_time)


def test_a_hitch_is_no_silence_and_a_silence_ends_at_rest() -> None:
    silence = Silence(1)
    assert silence.unseen({0: frame(pose(T_POSE), 10.0)}, 10.0) == {}
    assert silence.unseen({}, 10.0 + 0.9 * SILENT) == {}
    (nobody,) = silence.unseen({}, 10.0 + 1.1 * SILENT).values()
    assert np.isnan(nobody.positions).all()
    assert not nobody.confidence.any()
    assert nobody.time == 10.0 + 1.1 * SILENT
    assert silence.unseen({}, 10.0 + AT_REST + 2.0 * SILENT) == {}


def test_slots_fall_silent_each_on_its_own() -> None:
    silence = Silence(2)
    silence.unseen({0: frame(pose(T_POSE), 1.0), 1: frame(pose(T_POSE), 1.0)}, 1.0)
    silent = silence.unseen({1: frame(pose(T_POSE), 2.0)}, 2.0)
    assert set(silent) == {0}
    assert silence.newest_time == 2.0


def test_a_snapshot_puts_back_who_was_seen() -> None:
    silence = Silence(1)
    silence.unseen({0: frame(pose(T_POSE), 1.0)}, 1.0)
    state = silence.snapshot()
    silence.unseen({0: frame(pose(T_POSE), 5.0)}, 5.0)
    silence.restore(state)
    assert silence.newest_time == 1.0
    assert set(silence.unseen({}, 1.0 + 2.0 * SILENT)) == {0}
