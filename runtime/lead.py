"""Which performer drives the characters when several are in view."""

from __future__ import annotations

from devices.skeleton import SkeletonFrame

PATIENCE = 0.5  # seconds that a lost lead is waited for; sensors give a new id on every return


class Lead:
    """Follows the first performer seen, and moves on when that one has been gone for a while."""

    def __init__(self) -> None:
        self._performer: int | None = None
        self._seen = 0.0

    def leads(self, frame: SkeletonFrame) -> bool:
        """Whether this frame is the lead's."""
        gone = abs(frame.time - self._seen) > PATIENCE  # a clock may have been set back
        if self._performer is None or (frame.performer != self._performer and gone):
            self._performer = frame.performer
        if frame.performer != self._performer:
            return False
        self._seen = frame.time
        return True
