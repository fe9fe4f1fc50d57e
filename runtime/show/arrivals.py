"""The frames that came since the last tick: put in order, and given to the performers' slots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from devices.skeleton import SkeletonFrame
from devices.stream import SkeletonStream
from runtime.conditioning.reception import Reception, ReceptionState
from runtime.conditioning.switches import Conditioning, filled_only
from runtime.show.performer_slots import PerformerSlots, PerformerSlotsState


@dataclass(frozen=True, slots=True, eq=False)
class Arrived:
    """The frames that a tick performs.

    Attributes:
        newest: the frame whose time is the show's; None if none came.
        of_slots: for each slot whose performer was seen the newest frame.
        dropped: frames that came and are not performed.
    """

    newest: SkeletonFrame | None
    of_slots: Mapping[int, SkeletonFrame]
    dropped: int


@dataclass(frozen=True, slots=True, eq=False)
class ArrivalsState:
    """The state of `Arrivals` between two frames: the states of its parts, and the count."""

    reception: ReceptionState
    performer_slots: PerformerSlotsState
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

    def snapshot(self) -> ArrivalsState:
        """Return what is remembered between frames."""
        slots = self._performer_slots.snapshot()
        return ArrivalsState(self._reception.snapshot(), slots, self.count)

    def restore(self, state: ArrivalsState) -> None:
        """Go back to a snapshot."""
        self._reception.restore(state.reception)
        self._performer_slots.restore(state.performer_slots)
        self.count = state.count

    def poll(self) -> Arrived:
        """Return what came since the last call."""
        came = self._stream.poll()
        frames = self._reception.receive(came)
        of_slots = {}
        for frame in frames:
            slot = self._performer_slots.slot(frame)
            if slot is not None:
                of_slots[slot] = frame
        newest = of_slots.get(0, next(iter(of_slots.values()), frames[-1] if frames else None))
        self.count += len(came)
        performed = max(len(of_slots), min(len(frames), 1))
        return Arrived(newest, of_slots, len(came) - performed)
