"""A recording in which nobody is seen: with it a show goes on while a session plays."""

from __future__ import annotations

import numpy as np

from replay.builtin import builtin_recording
from replay.recording import Recording


def nobody_for(seconds: float, rate: float) -> Recording:
    """Return a recording of nobody.

    Args:
        seconds: [s] from the first frame to the last.
        rate: frames a second.
    """
    skeleton = builtin_recording("walk").skeleton
    frames, joints = round(seconds * rate) + 1, len(skeleton.names)
    return Recording(
        skeleton=skeleton,
        times=np.arange(frames) / rate,
        positions=np.full((frames, joints, 3), np.nan),
        rotations=None,
        confidence=np.zeros((frames, joints)),
        performers=np.zeros(frames, dtype=np.int64),
        arrivals=np.full(frames, np.nan),
    )
