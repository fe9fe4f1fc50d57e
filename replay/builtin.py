"""The built-in performance as a recording, for the demo and for whoever has none at hand."""

from __future__ import annotations

import numpy as np

from devices.builtin.motions import motion_clip
from replay.recording import Recording


def builtin_recording(name: str = "show") -> Recording:
    """One loop of the act called `name`, 60 frames a second, nothing missing.

    Raises:
        InputError: there is none of that name; the message lists those there are.
    """
    act = motion_clip(name)
    frames, joints = act.positions.shape[:2]
    return Recording(
        skeleton=act.skeleton,
        times=act.times,
        positions=act.positions,
        rotations=act.rotations,
        confidence=np.ones((frames, joints)),
        performers=np.zeros(frames, dtype=np.int64),
        arrivals=np.full(frames, np.nan),
        notes=(f"built-in performance: {name}",),
    )
