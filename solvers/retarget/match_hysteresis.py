"""Keeps the shown match steady although a noisy pose re-ranks the matches in every frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from solvers.matching import Match

BEST = 4  # matches that are offered side by side


@dataclass(frozen=True, slots=True)
class MatchHysteresisState:
    """The memory of a `MatchHysteresis` at one moment.

    Attributes:
        shown: the shown match, None before the first.
        ranked: the last frame's matches, best first.
        since: [s] the time since which another match differs by the margin, None without one.
        pinned: whether the match was chosen by hand.
        best: see `MatchHysteresis.best`.
    """

    shown: Match | None
    ranked: tuple[Match, ...]
    since: float | None
    pinned: bool
    best: tuple[Match, ...] = ()


class MatchHysteresis:
    """Shows the match of one rank; changes it after another was better by a margin for some time.

    Args:
        rank: the rank of the match to show, 0 for the best.
        margin: the least difference of merits that counts.
        hold: [s] for how long the difference must last without a break.
    """

    def __init__(self, rank: int = 0, *, margin: float = 0.15, hold: float = 0.5) -> None:
        self.rank = rank
        self.margin = margin
        self.hold = hold
        self.pinned = False
        self._shown: Match | None = None
        self._ranked: tuple[Match, ...] = ()
        self._best: tuple[Match, ...] = ()
        self._since: float | None = None

    @property
    def shown(self) -> Match | None:
        """The match to show; None before the first."""
        return self._shown

    @property
    def place(self) -> tuple[int, int]:
        """The rank of the shown match, 1 for the best, 0 if it is unranked; and how many rank."""
        position = self._position(self._shown)
        return (0 if position is None else position + 1), len(self._ranked)

    @property
    def best(self) -> tuple[Match, ...]:
        """Up to four of the best matches of the last frames, in an order that noise leaves alone.

        They change when, at any of their places, another match is better by the margin.
        """
        return self._best

    def snapshot(self) -> MatchHysteresisState:
        """Return the memory that the next update depends on."""
        return MatchHysteresisState(self._shown, self._ranked, self._since, self.pinned, self._best)

    def restore(self, state: MatchHysteresisState) -> None:
        """Go back to a snapshot; rank, margin and hold stay as they are."""
        self._shown, self._ranked = state.shown, state.ranked
        self._since, self.pinned, self._best = state.since, state.pinned, state.best

    def update(self, ranked: Sequence[Match], time: float) -> Match | None:
        """Take a frame's matches, best first, at `time` [s]; return the match to show.

        The match has its new score. The answer is None before the first match. A shown match that
        is not in the list counts as no better than the last one in it. If time steps back, as when
        a recording loops, the waiting time starts again.
        """
        self._ranked = tuple(ranked)
        self._keep_best()
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
        """Step by so many ranks from the shown match, round at the ends, and pin the new match."""
        if self._ranked:
            position = self._position(self._shown)
            if position is None:
                position = -1 if step > 0 else 0
            self._show(self._ranked[(position + step) % len(self._ranked)])
            self.pinned = True
        return self._shown

    def choose(self, rank: int) -> None:
        """Show and pin one of the best matches, 0 for the first of them, if there are so many."""
        if 0 <= rank < len(self._best):
            self._show(self._best[rank])
            self.pinned = True

    def release(self) -> None:
        """Undo the pin: the pose chooses the match again."""
        self.pinned = False
        self._since = None

    def _keep_best(self) -> None:
        """Give the best matches their new scores, or take others that are better by the margin."""
        wanted = self._ranked[:BEST]
        places = [self._position(each) for each in self._best]
        kept = tuple(self._ranked[place] for place in places if place is not None)
        steady = len(kept) == len(wanted) and all(
            new.merit - old.merit <= self.margin for new, old in zip(wanted, kept, strict=True)
        )
        self._best = kept if steady else wanted

    def _show(self, match: Match) -> None:
        self._shown = match
        self._since = None

    def _position(self, shown: Match | None) -> int | None:
        """The rank of the shown match in the last frame."""
        if shown is None:
            return None
        wanted = shown.root, shown.pairs
        keys = ((match.root, match.pairs) for match in self._ranked)
        return next((rank for rank, key in enumerate(keys) if key == wanted), None)
