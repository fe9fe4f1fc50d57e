"""Keeps the shown match steady while a performer's noisy pose re-ranks the matches every frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from solvers.matching import Match


@dataclass(frozen=True, slots=True)
class MatchHysteresisState:
    """Which match is shown, and since when another one is better.

    Attributes:
        shown: the match that is shown, None before there was any.
        ranked: the last frame's matches, best first.
        since: [s] when another match began to be better by the margin, None while none is.
        pinned: whether a match was chosen by hand.
    """

    shown: Match | None
    ranked: tuple[Match, ...]
    since: float | None
    pinned: bool


class MatchHysteresis:
    """Shows the match of one rank until another of that rank has differed by a margin for a while.

    Args:
        rank: which match to follow, 0 the best.
        margin: by how much merits must differ to count.
        hold: for how long without a break [s].
    """

    def __init__(self, rank: int = 0, *, margin: float = 0.15, hold: float = 0.5) -> None:
        self.rank = rank
        self.margin = margin
        self.hold = hold
        self.pinned = False
        self._shown: Match | None = None
        self._ranked: tuple[Match, ...] = ()
        self._since: float | None = None

    @property
    def shown(self) -> Match | None:
        """The match to show; None before there was any."""
        return self._shown

    def snapshot(self) -> MatchHysteresisState:
        """Return what the next update depends on."""
        return MatchHysteresisState(self._shown, self._ranked, self._since, self.pinned)

    def restore(self, state: MatchHysteresisState) -> None:
        """Go back to a snapshot; rank, margin and hold stay as they are."""
        self._shown, self._ranked = state.shown, state.ranked
        self._since, self.pinned = state.since, state.pinned

    def update(self, ranked: Sequence[Match], time: float) -> Match | None:
        """Take a frame's matches, best first, at `time` [s]; the match to show, with its new score.

        Before there was any match, None. A shown match that is no longer listed counts as no
        better than the last one listed. Time that steps back, as when a recording loops, starts
        the waiting anew.
        """
        self._ranked = tuple(ranked)
        if not self._ranked:
            self._since = None
            return self._shown
        wanted = self._ranked[min(self.rank, len(self._ranked) - 1)]
        if self._shown is None:
            self._show(wanted)
            return wanted
        position = self._position(self._shown)
        if position is not None:
            self._shown = self._ranked[position]
            merit = self._shown.merit
        else:
            merit = min(self._shown.merit, self._ranked[-1].merit)
        if abs(wanted.merit - merit) <= self.margin or self.pinned:
            self._since = None
        elif self._since is None or time < self._since:
            self._since = time
        elif time - self._since >= self.hold:
            self._show(wanted)
        return self._shown

    def cycle(self, step: int) -> Match | None:
        """Step by so many ranks from the shown match, round at the ends, and stay with that one."""
        if self._ranked:
            position = self._position(self._shown)
            if position is None:
                position = -1 if step > 0 else 0
            self._show(self._ranked[(position + step) % len(self._ranked)])
            self.pinned = True
        return self._shown

    def release(self) -> None:
        """After stepping by hand, let the pose choose again."""
        self.pinned = False
        self._since = None

    def _show(self, match: Match) -> None:
        self._shown = match
        self._since = None

    def _position(self, shown: Match | None) -> int | None:
        """Rank of the shown match in the last frame."""
        if shown is None:
            return None
        wanted = shown.root, shown.pairs
        keys = ((match.root, match.pairs) for match in self._ranked)
        return next((rank for rank, key in enumerate(keys) if key == wanted), None)
