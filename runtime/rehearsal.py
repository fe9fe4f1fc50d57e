"""Before a recording is played: a look through it for the poses that suit the puppets best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.recording import Recording
from runtime.director import Director
from runtime.performer import Performer

Array = NDArray[np.float64]

POSES = 500  # looked at, evenly through the recording


def rehearse(recording: Recording, source: str, director: Director) -> Array | None:
    """Let the director choose matches and rest states from poses of the whole recording.

    Where hardly a joint is ever in view nothing is chosen; the director then matches as it would
    live.

    Args:
        recording: what will be played.
        source: the part of the performer that drives, as for `Performer`.
        director: who chooses.

    Returns:
        (A, 2, 3) [m] for each puppet the corners of all that it fills, for the camera; None when
        nothing was chosen.
    """
    lead = np.flatnonzero(recording.performers == recording.performers[0])
    chosen = np.unique(lead[np.linspace(0, len(lead) - 1, POSES).round().astype(int)])
    performer = Performer(recording.skeleton, source)
    poses = []
    for index in chosen.tolist():
        frame = recording.frame(index)
        pose = performer.follow(frame)
        if director.sees(frame):
            poses.append(pose)
    return director.rehearse(poses) if poses else None
