"""Checks that hold for every recording, whatever file it came from."""

from __future__ import annotations

import numpy as np

from replay.recording import Recording


def assert_sound(recording: Recording) -> None:
    """What holds of every recording, whatever file it came from."""
    assert recording.times[0] == 0
    assert (np.diff(recording.times) >= 0).all()
    unseen = np.isnan(recording.positions).any(axis=2)
    np.testing.assert_array_equal(unseen, recording.confidence == 0)
    assert not np.isinf(recording.positions).any()
    assert np.isfinite(recording.skeleton.rest_positions).all()
    if recording.rotations is not None:
        length = np.linalg.norm(recording.rotations, axis=2)
        np.testing.assert_allclose(length[np.isfinite(length)], 1.0, atol=1e-9)
