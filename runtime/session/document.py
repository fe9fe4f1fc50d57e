"""The document of a session as immutable values: actors, takes, the clips that play them, marks.

Three kinds of time stand in it. The session's own time counts from the start of the timeline; the
time of a take counts from its first frame; the speed of a clip leads from one to the other. The
fields say which one they are in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

from devices.errors import InputError
from runtime.session.performance import Performance
from runtime.session.setup import Setup

SHORTEST = 1e-3  # [s] of a clip
LONGEST = 1e6  # [s] of a session
SPEEDS = (1.0 / 16.0, 16.0)
MOST_PASSES = 10_000.0
EASE = 0.25  # [s] in which a new clip comes in and goes out
MOST_NAME = 120  # letters


@dataclass(frozen=True, slots=True)
class Actor:
    """A character of the session.

    Attributes:
        id: of the actor.
        name: for people.
        character: a built-in character, or the file in the session.
        drive: the `--drive` that its takes were made with, which decides on its nodes.
        nodes: how many nodes it has.
        setup: how it was driven last; None where that is not known.
    """

    id: int
    name: str
    character: str
    drive: str
    nodes: int
    setup: Setup | None = None


@dataclass(frozen=True, slots=True)
class Take:
    """What one performance made of one actor.

    Attributes:
        id: of the take.
        name: for people.
        actor: whose.
        performance: what the actor did.
        recording: file of the performer's frames in the session; empty where there is none.
        parts: what drove what, a line each: "left arm -> left wing, absolute, 100 %".
        sound: file in the session of the sound that is heard with it, from its first frame on;
            empty where there is none.
    """

    id: int
    name: str
    actor: int
    performance: Performance
    recording: str = ""
    parts: tuple[str, ...] = ()
    sound: str = ""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Take) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[object, ...]:
        key = self.performance.key
        return self.id, self.name, self.actor, key, self.recording, self.parts, self.sound


@dataclass(frozen=True, slots=True)
class Clip:
    """A take at a place of the timeline.

    Attributes:
        id: of the clip.
        take: what it plays.
        start: [s] of the session's time.
        first, last: [s] of the take's time: what is played of it.
        speed: seconds of the take for each second of the session.
        passes: how often it is played, one after the other; parts of a pass count too.
        muted: whether it is left out.
        solo: whether only it, and other solo clips, are played.
        additive: whether it turns nodes further, or takes them to its own turns.
        weight: how much of it counts, in [0, 1].
        ease_in, ease_out: [s] of the session's time in which it comes and goes.
        nodes: the nodes that it moves; None for all of its take.
        placed: whether the take's way over the stage counts.
    """

    id: int
    take: int
    start: float
    first: float
    last: float
    speed: float = 1.0
    passes: float = 1.0
    muted: bool = False
    solo: bool = False
    additive: bool = False
    weight: float = 1.0
    ease_in: float = EASE
    ease_out: float = EASE
    nodes: tuple[int, ...] | None = None
    placed: bool = True

    def __post_init__(self) -> None:
        _check(0.0 <= self.start <= LONGEST, "a clip starts", self.start, f"0 to {LONGEST:g} s")
        _check(
            0.0 <= self.first <= self.last - SHORTEST and self.last <= LONGEST,
            "a clip plays",
            (self.first, self.last),
            f"a range of its take of {SHORTEST:g} s at least",
        )
        _check(SPEEDS[0] <= self.speed <= SPEEDS[1], "a clip's speed is", self.speed, "1/16 to 16")
        _check(0.0 < self.passes <= MOST_PASSES, "a clip plays", self.passes, "above 0 times")
        _check(0.0 <= self.weight <= 1.0, "a clip's weight is", self.weight, "0 to 1")
        for ease in (self.ease_in, self.ease_out):
            _check(0.0 <= ease <= LONGEST, "a clip eases for", ease, "0 s or more")

    @property
    def length(self) -> float:
        """[s] of the session's time."""
        return (self.last - self.first) / self.speed * self.passes

    @property
    def end(self) -> float:
        """[s] of the session's time."""
        return self.start + self.length

    def take_time(self, time: float) -> float:
        """Return the take's time [s] at the session's `time` [s], within the clip."""
        span = self.last - self.first
        passed = min(max(time - self.start, 0.0), self.length) * self.speed
        whole = min(math.floor(passed / span), math.ceil(self.passes) - 1)
        return self.first + min(max(passed - whole * span, 0.0), span)

    def presence(self, time: float) -> float:
        """Return how much of the clip counts at the session's `time` [s]: 0 outside of it."""
        if not self.start <= time <= self.end:
            return 0.0
        come = 1.0 if self.ease_in == 0.0 else min((time - self.start) / self.ease_in, 1.0)
        gone = 1.0 if self.ease_out == 0.0 else min((self.end - time) / self.ease_out, 1.0)
        return self.weight * _smooth(come) * _smooth(gone)


@dataclass(frozen=True, slots=True)
class Mark:
    """A named moment of the session's time [s]."""

    time: float
    name: str


Part = TypeVar("Part", Actor, Take, Clip)


@dataclass(frozen=True, slots=True)
class Session:
    """All of a session; edits make new ones (`runtime.session.edits`).

    Attributes:
        actors: the characters, from left to right.
        takes: in the order in which they were made.
        clips: the layers, from the lowest to the highest.
        marks: in the order of time.
        punch: [s] the range of the session's time that is recorded; None for all.
    """

    actors: tuple[Actor, ...] = ()
    takes: tuple[Take, ...] = ()
    clips: tuple[Clip, ...] = ()
    marks: tuple[Mark, ...] = ()
    punch: tuple[float, float] | None = None

    @property
    def duration(self) -> float:
        """[s] until the last clip ends; 0 without clips."""
        return max((clip.end for clip in self.clips), default=0.0)

    def actor(self, number: int) -> Actor:
        """Return the actor with this id."""
        return _find(self.actors, number, "actor")

    def take(self, number: int) -> Take:
        """Return the take with this id."""
        return _find(self.takes, number, "take")

    def clip(self, number: int) -> Clip:
        """Return the clip with this id."""
        return _find(self.clips, number, "clip")

    def played(self, actor: int) -> list[tuple[Clip, Take]]:
        """Return the clips of an actor that are neither muted nor beside a solo, lowest first."""
        solo = any(clip.solo and not clip.muted for clip in self.clips)
        every = ((clip, self.take(clip.take)) for clip in self.clips)
        return [
            (clip, take)
            for clip, take in every
            if take.actor == actor and not clip.muted and (clip.solo or not solo)
        ]


def next_id(parts: tuple[Part, ...]) -> int:
    """Return an id that no part has yet, greater than all of them."""
    return max((part.id for part in parts), default=0) + 1


def _find(parts: tuple[Part, ...], number: int, kind: str) -> Part:
    for part in parts:
        if part.id == number:
            return part
    there = ", ".join(str(part.id) for part in parts[:12]) or "none"
    raise InputError(f"the session has no {kind} {number}; there are: {there}")


def _check(right: bool, what: str, got: object, expected: str) -> None:
    if not right:
        raise InputError(f"{what} {got}: expected {expected}")


def _smooth(share: float) -> float:
    """The share, without a jolt at either end."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)
