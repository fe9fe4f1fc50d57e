"""The first steps, which look at every frame of a stream: its order, and who is who."""

from __future__ import annotations

from collections.abc import Sequence

from devices.skeleton import Skeleton, SkeletonFrame
from runtime.conditioning.identities import Identities
from runtime.conditioning.switches import Conditioning
from runtime.conditioning.timeline import Timeline

MOST_AT_ONCE = 128  # frames of one poll that are looked at, the newest; a flood brings thousands


class Reception:
    """Lets frames in that come in order, each under its performer's own number.

    Args:
        skeleton: of all frames.
        switches: what is done; looked at whenever frames come.

    Attributes:
        timeline: the show's clock, and what it has dropped.
    """

    def __init__(self, skeleton: Skeleton, switches: Conditioning) -> None:
        self.timeline = Timeline()
        self._switches = switches
        self._identities = Identities(skeleton)

    def receive(self, frames: Sequence[SkeletonFrame]) -> Sequence[SkeletonFrame]:
        """Those of the frames, and of the newest only, that are let in; oldest first."""
        frames = frames[-MOST_AT_ONCE:]
        if self._switches.order:
            admitted = (self.timeline.admit(frame) for frame in frames)
            frames = [frame for frame in admitted if frame is not None]
        return self._identities.steady(frames) if self._switches.identities else frames
