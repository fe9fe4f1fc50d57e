"""Slots for performers: which of several performers in view drives which characters."""

from __future__ import annotations

from dataclasses import dataclass

from devices.skeleton import SkeletonFrame

PATIENCE = 0.5  # [s] that a slot waits for its performer; sensors lose people for a moment


@dataclass(frozen=True, slots=True)
class _Slot:
    """Number of a slot's performer (None while it is free), and when they were last seen [s]."""

    performer: int | None = None
    seen: float = 0.0


@dataclass(frozen=True, slots=True)
class PerformerSlotsState:
    """Which performer has each slot, and when they were last seen."""

    slots: tuple[_Slot, ...]


class PerformerSlots:
    """Gives slots to performers in the order in which they appear.

    A performer keeps a slot, and the slot becomes free when the performer has been out of view for
    `PATIENCE`.

    Args:
        count: number of slots; each drives the characters of one performer.
    """

    def __init__(self, count: int = 1) -> None:
        self._slots = [_Slot() for _ in range(count)]

    def snapshot(self) -> PerformerSlotsState:
        """Return which performer has each slot."""
        return PerformerSlotsState(tuple(self._slots))

    def restore(self, state: PerformerSlotsState) -> None:
        """Go back to a snapshot."""
        self._slots = list(state.slots)

    def slot(self, frame: SkeletonFrame) -> int | None:
        """Return the slot of this frame's performer; None if all slots are taken by others."""
        performers = [slot.performer for slot in self._slots]
        if frame.performer in performers:
            number = performers.index(frame.performer)
        else:
            free = (n for n, slot in enumerate(self._slots) if _is_free(slot, frame.time))
            first = next(free, None)
            if first is None:
                return None
            number = first
        self._slots[number] = _Slot(frame.performer, frame.time)
        return number


def _is_free(slot: _Slot, time: float) -> bool:
    """Whether a slot has no performer, or its performer is gone; a clock may be set back."""
    return slot.performer is None or abs(time - slot.seen) > PATIENCE
