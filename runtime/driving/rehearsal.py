"""Looks through a recording before it is played, for the poses that suit the puppets best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.recording import Recording
from runtime.conditioning.switches import Conditioning
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.reach import Reach

POSES = 500  # evenly through the recording
LED_THERE = 8  # frames that are followed up to each of them


def rehearse(
    recording: Recording,
    source: str,
    match_session: MatchSession,
    conditioning: Conditioning | None = None,
    part: int = 0,
) -> list[Reach] | None:
    """Let a match session choose matches and rest states from poses of the whole recording.

    Where too few joints are in view in every pose, nothing is chosen; the session then matches as
    it does live.

    Args:
        recording: what will be played.
        source: the part of the performer that drives, as for `Performer`.
        match_session: chooses.
        conditioning: what is done to the frames first, as for `Performer`, so that no glitch of
            the sensor is taken for a pose.
        part: which performer, in the order in which they appear, from 0.

    Returns:
        For each puppet the room that it takes, for the camera; None when nothing was chosen.
    """
    who, first = np.unique(recording.performers, return_index=True)
    if part >= len(who):
        return None
    own = np.flatnonzero(recording.performers == who[np.argsort(first)[part]])
    chosen = np.unique(np.linspace(0, len(own) - 1, POSES).round().astype(int))
    followed = np.arange(len(own)) if match_session.needs_clip else _leading_to(chosen)
    performer = Performer(recording.skeleton, source, conditioning)
    poses, clip = [], []
    for index in followed.tolist():
        frame = recording.frame(int(own[index]))
        clip.append(performer.follow(frame))
        if index in chosen and match_session.sees(frame):
            poses.append(clip[-1])
    return match_session.rehearse(poses, clip) if poses else None


def _leading_to(chosen: NDArray[np.int64]) -> NDArray[np.int64]:
    """The chosen frames and those before each, by which a glitch is told from a pose."""
    led = (chosen[:, None] - np.arange(LED_THERE)).ravel()
    return np.unique(led[led >= 0])
