"""The two steps that see every frame of a stream: order in time, and steady performer numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from devices.skeleton import Skeleton, SkeletonFrame
from runtime.conditioning.identities import Identities, IdentitiesState
from runtime.conditioning.switches import Conditioning
from runtime.conditioning.timeline import Timeline, TimelineState

MOST_AT_ONCE = 128  # newest frames of one poll that are taken; a flood brings thousands


@dataclass(frozen=True, slots=True, eq=False)
class ReceptionState:
    """The states of both steps."""

    timeline: TimelineState
    identities: IdentitiesState


class Reception:
    """Admits frames that come in order, each under its performer's steady number.

    Args:
        skeleton: of all frames.
        switches: which steps are taken; read whenever frames come.

    Attributes:
        timeline: the show's clock, and the counts of dropped frames.
    """

    def __init__(self, skeleton: Skeleton, switches: Conditioning) -> None:
        self.timeline = Timeline()
        self._switches = switches
        self._identities = Identities(skeleton)

    def snapshot(self) -> ReceptionState:
        """Return the states of both steps."""
        return ReceptionState(self.timeline.snapshot(), self._identities.snapshot())

    def restore(self, state: ReceptionState) -> None:
        """Go back to a snapshot."""
        self.timeline.restore(state.timeline)
        self._identities.restore(state.identities)

    def receive(self, frames: Sequence[SkeletonFrame]) -> Sequence[SkeletonFrame]:
        """Return the admitted frames, oldest first; of a flood only the newest are seen."""
        frames = frames[-MOST_AT_ONCE:]
        if self._switches.order:
            admitted = (self.timeline.admit(frame) for frame in frames)
            frames = [frame for frame in admitted if frame is not None]
        return self._identities.steady(frames) if self._switches.identities else frames
