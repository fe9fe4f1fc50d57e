"""The built-in motions as recordings, for the demo and for use without a recorded file."""

from __future__ import annotations

import numpy as np

from devices.builtin.motions import motion_clip
from replay.recording import Recording


def builtin_recording(name: str = "show") -> Recording:
    """Return one loop of the motion called `name`, 60 frames per second, without gaps.

    Raises:
        InputError: no motion has that name; the message lists the known ones.
    """
    clip = motion_clip(name)
    frames, joints = clip.positions.shape[:2]
    return Recording(
        skeleton=clip.skeleton,
        times=clip.times,
        positions=clip.positions,
        rotations=clip.rotations,
        confidence=np.ones((frames, joints)),
        performers=np.zeros(frames, dtype=np.int64),
        arrivals=np.full(frames, np.nan),
        notes=(f"built-in motion: {name}",),
    )
