"""The frames that arrived since the last tick: sorted, and given to the performers' slots."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from devices.skeleton import SkeletonFrame
from devices.stream import SkeletonStream
from runtime.conditioning.reception import Reception, ReceptionState
from runtime.conditioning.silence import Silence, SilenceState, nobody
from runtime.conditioning.switches import Conditioning, filled_only
from runtime.show.performer_slots import PerformerSlots, PerformerSlotsState


@dataclass(frozen=True, slots=True, eq=False)
class Arrived:
    """The frames that a tick performs.

    Attributes:
        newest: the frame whose time is the show's; None if none came.
        of_slots: for each slot whose performer was seen the newest frame; for one whose performer
            has gone silent a frame in which nothing is seen.
        came: frames that came.
        dropped: frames that came and are not performed.
    """

    newest: SkeletonFrame | None
    of_slots: Mapping[int, SkeletonFrame]
    came: int
    dropped: int


@dataclass(frozen=True, slots=True, eq=False)
class ArrivalsState:
    """The state of `Arrivals` between two frames: the states of its parts, and the count."""

    reception: ReceptionState
    performer_slots: PerformerSlotsState
    silence: SilenceState
    count: int


class Arrivals:
    """Polls a stream and keeps the newest frame of each performer.

    Args:
        stream: where the frames come from.
        slots: how many performers drive.
        conditioning: how the stream is put in order; as it comes if None.

    Attributes:
        count: frames that came so far.
    """

    def __init__(
        self, stream: SkeletonStream, slots: int, conditioning: Conditioning | None
    ) -> None:
        self.count = 0
        self._stream = stream
        self._reception = Reception(stream.skeleton, conditioning or filled_only())
        self._performer_slots = PerformerSlots(slots)
        self._silence = Silence(slots)

    def snapshot(self) -> ArrivalsState:
        """Return what is remembered between frames."""
        return ArrivalsState(
            self._reception.snapshot(),
            self._performer_slots.snapshot(),
            self._silence.snapshot(),
            self.count,
        )

    def restore(self, state: ArrivalsState) -> None:
        """Go back to a snapshot."""
        self._reception.restore(state.reception)
        self._performer_slots.restore(state.performer_slots)
        self._silence.restore(state.silence)
        self.count = state.count

    def poll(self, silence: float = 0.0, *, goes_on_at: float = math.nan) -> Arrived:
        """Return what came since the last call.

        Args:
            silence: [s] since the newest frame came; 0 where frames may pause, as in a recording.
            goes_on_at: [s] the host's time, if the show goes on where no frame comes: the first
                slot then gets one of nobody. NaN if it waits.
        """
        came = self._stream.poll()
        frames = self._reception.receive(came)
        of_slots: dict[int, SkeletonFrame] = {}
        for frame in frames:
            slot = self._performer_slots.slot(frame)
            if slot is not None:
                of_slots[slot] = frame
        newest = of_slots.get(0, next(iter(of_slots.values()), frames[-1] if frames else None))
        self.count += len(came)
        dropped = len(came) - max(len(of_slots), min(len(frames), 1))
        now = self._silence.newest_time + silence if newest is None else newest.time
        unseen = self._silence.unseen(of_slots, now)
        if newest is None and unseen:
            newest = next(iter(unseen.values()))
        if newest is None and not math.isnan(goes_on_at):
            newest = nobody(self._stream.skeleton, goes_on_at if math.isnan(now) else now)
            unseen = {0: newest}
        return Arrived(newest, {**of_slots, **unseen}, len(came), dropped)
