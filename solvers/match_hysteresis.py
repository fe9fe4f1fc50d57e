"""Keeps the shown match steady while a performer's noisy pose re-ranks the matches every frame."""

from __future__ import annotations

from collections.abc import Sequence

from solvers.matching import Match

_Key = tuple[object, ...]


class MatchHysteresis:
    """Shows one match until another has beaten it by a margin for long enough.

    Args:
        margin: by how much the other's merit must exceed that of the shown one.
        hold: for how long without a break [s].
    """

    def __init__(self, margin: float = 0.15, hold: float = 0.5) -> None:
        self.margin = margin
        self.hold = hold
        self.pinned = False
        self._shown: Match | None = None
        self._ranked: tuple[Match, ...] = ()
        self._since: dict[_Key, float] = {}

    @property
    def shown(self) -> Match | None:
        """The match to show; None before there was any."""
        return self._shown

    def update(self, ranked: Sequence[Match], time: float) -> Match | None:
        """Take a frame's matches, best first, at `time` [s]; the match to show, with its new score.

        A shown match that is no longer listed counts as no better than the last one listed. Time
        that steps back, as when a recording loops, starts the waiting anew.
        """
        self._ranked = tuple(ranked)
        if not self._ranked:
            self._since.clear()
            return self._shown
        if self._shown is None:
            self._shown = self._ranked[0]
            return self._shown
        position = self._position()
        if position is not None:
            self._shown = self._ranked[position]
            merit = self._shown.merit
        else:
            merit = min(self._shown.merit, self._ranked[-1].merit)
        self._wait(merit, time)
        ripe = [m for m in self._ranked if self._waited(m, time) >= self.hold]
        if ripe and not self.pinned:
            self._show(ripe[0])
        return self._shown

    def next(self) -> Match | None:
        """Step to the match after the shown one, round at the end, and stay there."""
        return self._step(1)

    def previous(self) -> Match | None:
        """Step to the match before the shown one, round at the start, and stay there."""
        return self._step(-1)

    def release(self) -> None:
        """After stepping by hand, let the pose choose again."""
        self.pinned = False
        self._since.clear()

    def _step(self, by: int) -> Match | None:
        if self._ranked:
            position = self._position()
            start = position if position is not None else (-1 if by > 0 else 0)
            self._show(self._ranked[(start + by) % len(self._ranked)])
            self.pinned = True
        return self._shown

    def _show(self, match: Match) -> None:
        self._shown = match
        self._since.clear()

    def _position(self) -> int | None:
        """Rank of the shown match in the last frame."""
        wanted = _key(self._shown) if self._shown is not None else None
        keys = [_key(match) for match in self._ranked]
        return keys.index(wanted) if wanted in keys else None

    def _waited(self, match: Match, time: float) -> float:
        since = self._since.get(_key(match))
        return time - since if since is not None else float("-inf")

    def _wait(self, merit: float, time: float) -> None:
        """Note since when each rival has been ahead of `merit` by the margin."""
        ahead = [_key(match) for match in self._ranked if match.merit > merit + self.margin]
        self._since = {key: min(self._since.get(key, time), time) for key in ahead}


def _key(match: Match) -> _Key:
    """What makes two frames' matches the same."""
    return match.root, match.pairs
