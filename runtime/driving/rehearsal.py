"""Before a recording is played: a look through it for the poses that suit the puppets best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.recording import Recording
from runtime.conditioning.switches import Conditioning
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer

Array = NDArray[np.float64]

POSES = 500  # looked at, evenly through the recording
LED_THERE = 8  # frames that are followed up to each of them


def rehearse(
    recording: Recording,
    source: str,
    match_session: MatchSession,
    conditioning: Conditioning | None = None,
    part: int = 0,
) -> Array | None:
    """Let the director choose matches and rest states from poses of the whole recording.

    Where hardly a joint is ever in view nothing is chosen; the director then matches as it would
    live.

    Args:
        recording: what will be played.
        source: the part of the performer that drives, as for `Performer`.
        director: who chooses.
        conditioning: what is done to the frames first, as for `Performer`, so that no glitch of
            the sensor is taken for a pose.
        part: which performer, by the order in which they come; 0 is the lead.

    Returns:
        (A, 2, 3) [m] for each puppet the corners of all that it fills, for the camera; None when
        nothing was chosen.
    """
    who, first = np.unique(recording.performers, return_index=True)
    if part >= len(who):
        return None
    lead = np.flatnonzero(recording.performers == who[np.argsort(first)[part]])
    chosen = np.unique(np.linspace(0, len(lead) - 1, POSES).round().astype(int))
    performer = Performer(recording.skeleton, source, conditioning)
    poses = []
    for index in _with_what_leads_there(chosen).tolist():
        frame = recording.frame(int(lead[index]))
        pose = performer.follow(frame)
        if index in chosen and match_session.sees(frame):
            poses.append(pose)
    return match_session.rehearse(poses) if poses else None


def _with_what_leads_there(chosen: NDArray[np.int64]) -> NDArray[np.int64]:
    """Frames and those before them, by which a glitch is told from a pose."""
    led = (chosen[:, None] - np.arange(LED_THERE)).ravel()
    return np.unique(led[led >= 0])
