"""Which performer drives which characters when several are in view."""

from __future__ import annotations

from dataclasses import dataclass

from devices.skeleton import SkeletonFrame

PATIENCE = 0.5  # seconds that a lost performer's part is kept; sensors lose people for a moment


@dataclass(frozen=True, slots=True)
class _Part:
    """A part, its performer's number (None while it is free), and when they were last seen [s]."""

    performer: int | None = None
    seen: float = 0.0


@dataclass(frozen=True, slots=True)
class PerformerSlotsState:
    """Which performer has each part, and when they were last seen."""

    parts: tuple[_Part, ...]


class PerformerSlots:
    """Gives parts to performers in the order in which they come, the lead's first.

    A part stays with its performer, and is free for another when that one has been gone for a
    while.

    Args:
        parts: how many there are; one where only the lead drives.
    """

    def __init__(self, parts: int = 1) -> None:
        self._parts = [_Part() for _ in range(parts)]

    def snapshot(self) -> PerformerSlotsState:
        """Return which performer has each part."""
        return PerformerSlotsState(tuple(self._parts))

    def restore(self, state: PerformerSlotsState) -> None:
        """Go back to a snapshot."""
        self._parts = list(state.parts)

    def part(self, frame: SkeletonFrame) -> int | None:
        """The part that this frame's performer plays; None for a bystander."""
        played = [part.performer for part in self._parts]
        if frame.performer in played:
            number = played.index(frame.performer)
        else:
            free = (n for n, part in enumerate(self._parts) if _is_free(part, frame.time))
            vacant = next(free, None)
            if vacant is None:
                return None
            number = vacant
        self._parts[number] = _Part(frame.performer, frame.time)
        return number


def _is_free(part: _Part, time: float) -> bool:
    """Whether nobody plays a part, or who did has gone; a clock may have been set back."""
    return part.performer is None or abs(time - part.seen) > PATIENCE
