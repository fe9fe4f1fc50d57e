"""Jumps in a recording give the same bytes as playing to that moment, by snapshots of the show.

Conditioning, drivers and solvers remember the frames before, so the picture at a moment depends on
what was played before it, and a jump by `Playback.seek` differs from playing. A history restores
the nearest snapshot before the moment, and performs the frames between.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass

import numpy as np

from replay.player import Player, PlayerState
from runtime.show.loop import FrameLoop, FrameLoopState

EVERY = 30  # frames between two snapshots, until they take more than `MOST_BYTES`
MOST_BYTES = 256 << 20


@dataclass(frozen=True, slots=True, eq=False)
class _Moment:
    """The show after `frames` frames of the recording, and the bytes that its state takes."""

    frames: int
    player: PlayerState
    loop: FrameLoopState
    bytes: int


class ShowHistory:
    """Takes snapshots of a show as it plays a recording, and goes to any of its frames.

    The start is where the show is now; the recording must not have been played yet. Playing must
    give each frame once: by `EveryFrame`, and with surfaces that settle after each frame.

    The snapshots hold for one setting of everything that a puppeteer can change. After a change,
    `forget` them: the next jump then gives what playing with the new settings gives. Frames after a
    change, a seek or a second pass of a loop are not what playing from the start gives, so no
    snapshots are taken of them until the next jump.

    Args:
        loop: the frame loop of the show.
        player: what the loop performs.
        every: frames between two snapshots.
        most_bytes: of all snapshots together. Beyond it, every second one is dropped and those that
            follow are twice as far apart.

    Raises:
        ValueError: the player gives frames by a clock, or has given some already.
    """

    def __init__(
        self, loop: FrameLoop, player: Player, *, every: int = EVERY, most_bytes: int = MOST_BYTES
    ) -> None:
        if not player.every_frame:
            raise ValueError("expected a player that gives every frame, got one with a clock")
        if player.snapshot().next > 0:
            raise ValueError("expected a player before its first frame, got one that has begun")
        self._loop, self._player = loop, player
        self._times = player.recording.times
        self._every, self._most_bytes = every, most_bytes
        self._moments = [self._moment()]
        self._expected: int | None = 1  # frames after the next note; None away from the way here

    @property
    def bytes(self) -> int:
        """Bytes of all snapshots, including arrays that several of them share."""
        return sum(moment.bytes for moment in self._moments)

    @property
    def frames(self) -> list[int]:
        """After how many frames of the recording the snapshots were taken."""
        return [moment.frames for moment in self._moments]

    def note(self) -> None:
        """Take a snapshot if one is due; call it after each frame that the show has performed."""
        frames = self._player.snapshot().next
        if frames != self._expected:
            self._expected = None
            return
        self._expected = frames + 1
        if frames >= self._moments[-1].frames + self._every:
            self._moments.append(self._moment())
            if self.bytes > self._most_bytes:
                self._thin_out()

    def forget(self) -> None:
        """Drop all snapshots except the first: something was changed that they depend on."""
        del self._moments[1:]
        self._expected = None

    def go_to(self, seconds: float) -> None:
        """Bring the show to where playing from the start brings it at `seconds`.

        The frames on the way are performed, and neither shown nor published. Playback is paused or
        not as before.

        Args:
            seconds: recorded time. The last frame at or before it is performed; before the first
                frame it is the first.
        """
        wanted = max(int(np.searchsorted(self._times, seconds, side="right")), 1)
        start = max((m for m in self._moments if m.frames <= wanted), key=lambda m: m.frames)
        self._loop.restore(start.loop)
        self._player.restore(start.player)
        self._expected = start.frames + 1
        paused = self._player.paused
        self._player.resume()
        for _ in range(wanted - start.frames):
            self._loop.advance()
            self.note()
        if paused:
            self._player.pause()

    def _moment(self) -> _Moment:
        player, loop = self._player.snapshot(), self._loop.snapshot()
        return _Moment(player.next, player, loop, state_bytes(loop))

    def _thin_out(self) -> None:
        self._moments = self._moments[::2]
        self._every *= 2


def state_bytes(state: object) -> int:
    """Return the bytes of all arrays of a state."""
    return sum(array.nbytes for array in _arrays(state))


def _arrays(value: object) -> Iterator[np.ndarray]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for each in value:
            yield from _arrays(each)
    elif is_dataclass(value) and not isinstance(value, type):
        for each in fields(value):
            yield from _arrays(getattr(value, each.name))
