"""Edits of a session: free functions that return a new session and leave the old one as it was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from devices.errors import InputError
from runtime.session.document import (
    MOST_NAME,
    SHORTEST,
    Actor,
    Clip,
    Mark,
    Session,
    Take,
    next_id,
)
from runtime.session.setup import Setup


def with_actor(session: Session, actor: Actor) -> Session:
    """Add an actor."""
    return replace(session, actors=(*session.actors, actor))


def set_up(session: Session, number: int, setup: Setup) -> Session:
    """Give an actor another setup."""
    actors = (
        replace(actor, setup=setup) if actor.id == number else actor for actor in session.actors
    )
    return replace(session, actors=tuple(actors))


def with_take(session: Session, take: Take, start: float, *, speed: float = 1.0) -> Session:
    """Add a take, and a clip on top of all layers that plays the whole of it from `start` [s] on.

    The take gets a new id. A take of one frame lasts as briefly as a clip can.
    """
    take = replace(take, id=next_id(session.takes))
    length = max(take.performance.duration, SHORTEST)
    clip = Clip(next_id(session.clips), take.id, start, 0.0, length, speed=speed)
    eased = min(clip.ease_in, 0.25 * clip.length)
    clip = replace(clip, ease_in=eased, ease_out=eased)
    return replace(session, takes=(*session.takes, take), clips=(*session.clips, clip))


def moved(session: Session, number: int, start: float) -> Session:
    """Let a clip start at `start` [s] of the session's time; before 0 it starts at 0."""
    return _changed(session, number, start=max(start, 0.0))


def trimmed(session: Session, number: int, start: float, end: float) -> Session:
    """Cut a clip so that it plays from `start` to `end` [s] of the session's time.

    What is left stays where it is. Beyond the clip's own frames it cannot be drawn out; a clip of
    several passes keeps its start, and plays as many of them as fit.

    Raises:
        InputError: nothing would be left.
    """
    clip = session.clip(number)
    if end <= start:
        raise InputError(
            f"cannot trim clip {number} from {start:g} to {end:g} s: the end comes first"
        )
    if clip.passes != 1.0:
        span = (clip.last - clip.first) / clip.speed
        return _changed(session, number, passes=max(end - clip.start, SHORTEST) / span)
    most = session.take(clip.take).performance.duration
    first = max(clip.first + (start - clip.start) * clip.speed, 0.0)
    last = min(clip.last + (end - clip.end) * clip.speed, max(most, clip.last))
    if last - first < SHORTEST:
        raise InputError(
            f"cannot trim clip {number} from {start:g} to {end:g} s: nothing of it is there; it "
            f"lasts from {clip.start:g} to {clip.end:g} s"
        )
    begins = max(clip.start + (first - clip.first) / clip.speed, 0.0)
    return _changed(session, number, start=begins, first=first, last=last)


def split(session: Session, number: int, at: float) -> Session:
    """Cut a clip in two at `at` [s] of the session's time; together they play what it played.

    Raises:
        InputError: the moment is not inside the clip, or the clip is played several times.
    """
    clip = session.clip(number)
    if not clip.start + SHORTEST <= at <= clip.end - SHORTEST:
        raise InputError(
            f"cannot cut clip {number} at {at:g} s: it lasts from {clip.start:g} to {clip.end:g} s"
        )
    if clip.passes != 1.0:
        raise InputError(f"cannot cut clip {number}, which is played {clip.passes:g} times")
    middle = clip.take_time(at)
    left = replace(clip, last=middle, ease_out=0.0)
    right = replace(clip, id=next_id(session.clips), start=at, first=middle, ease_in=0.0)
    clips = [each for one in session.clips for each in ((left, right) if one is clip else (one,))]
    return replace(session, clips=tuple(clips))


def paced(session: Session, number: int, speed: float) -> Session:
    """Let a clip play its take `speed` times as fast, from the same start."""
    return _changed(session, number, speed=speed)


def looped(session: Session, number: int, passes: float) -> Session:
    """Let a clip play its take this many times, which may be a fraction."""
    return _changed(session, number, passes=passes)


def muted(session: Session, number: int, on: bool) -> Session:
    """Mute a clip, or not."""
    return _changed(session, number, muted=on)


def soloed(session: Session, number: int, on: bool) -> Session:
    """Play a clip and other solo clips only, or not."""
    return _changed(session, number, solo=on)


def weighted(session: Session, number: int, weight: float) -> Session:
    """Set the weight of a clip, in [0, 1]."""
    return _changed(session, number, weight=weight)


def made_additive(session: Session, number: int, on: bool) -> Session:
    """Let a clip turn nodes further than the layers below, or override them."""
    return _changed(session, number, additive=on)


def eased(session: Session, number: int, ease_in: float, ease_out: float) -> Session:
    """Blend a clip in and out within these numbers of seconds of the session's time.

    Raises:
        InputError: both together are longer than the clip.
    """
    length = session.clip(number).length
    if ease_in + ease_out > length:
        raise InputError(
            f"clip {number} cannot come and go within {ease_in:g} and {ease_out:g} s: "
            f"it lasts {length:.2f} s"
        )
    return _changed(session, number, ease_in=ease_in, ease_out=ease_out)


def limited(session: Session, number: int, nodes: tuple[int, ...] | None) -> Session:
    """Let a clip move only some nodes of its take, or all (None).

    Raises:
        InputError: there is no such node, or its take moves none of them.
    """
    if nodes is not None:
        actor = session.actor(session.take(session.clip(number).take).actor)
        if none := [node for node in nodes if not 0 <= node < actor.nodes]:
            raise InputError(
                f"{actor.name} has no node {_few(none)}: its nodes are 0 to {actor.nodes - 1}"
            )
        moved = session.take(session.clip(number).take).performance.nodes.tolist()
        if not set(nodes) & set(moved):
            raise InputError(
                f"clip {number} would move nothing: its take moves the nodes {_few(moved)}"
            )
    return _changed(session, number, nodes=nodes, placed=nodes is None)


def copied(session: Session, number: int, start: float) -> Session:
    """Add a copy of a clip on top of all layers, from `start` [s] of the session's time on."""
    copy = replace(session.clip(number), id=next_id(session.clips), start=max(start, 0.0))
    return replace(session, clips=(*session.clips, copy))


def raised(session: Session, number: int, layers: int) -> Session:
    """Move a clip up by this number of layers; down if negative."""
    clip = session.clip(number)
    others = [one for one in session.clips if one is not clip]
    place = min(max(session.clips.index(clip) + layers, 0), len(others))
    return replace(session, clips=(*others[:place], clip, *others[place:]))


def replaced(session: Session, clip: Clip) -> Session:
    """Put a clip in the place of the one with its id."""
    session.clip(clip.id)
    clips = tuple(clip if one.id == clip.id else one for one in session.clips)
    return replace(session, clips=clips)


def without_clip(session: Session, number: int) -> Session:
    """Remove a clip; its take stays."""
    clip = session.clip(number)
    return replace(session, clips=tuple(one for one in session.clips if one is not clip))


def renamed(session: Session, number: int, name: str) -> Session:
    """Give a take another name.

    Raises:
        InputError: the name is empty.
    """
    take, words = session.take(number), " ".join(name.split())[:MOST_NAME]
    if not words:
        raise InputError(f"take {number} needs a name, got an empty one")
    named = replace(take, name=words)
    return replace(session, takes=tuple(named if one is take else one for one in session.takes))


def marked(session: Session, time: float, name: str) -> Session:
    """Add a mark at `time` [s] of the session's time.

    Raises:
        InputError: the name is empty.
    """
    words = " ".join(name.split())[:MOST_NAME]
    if not words:
        raise InputError(f"the mark at {time:g} s needs a name, got an empty one")
    marks = [*session.marks, Mark(max(time, 0.0), words)]
    return replace(session, marks=tuple(sorted(marks, key=lambda mark: mark.time)))


def unmarked(session: Session, time: float) -> Session:
    """Remove the mark that is nearest to `time` [s].

    Raises:
        InputError: there is no mark.
    """
    if not session.marks:
        raise InputError("there is no mark to take away")
    nearest = min(session.marks, key=lambda mark: abs(mark.time - time))
    return replace(session, marks=tuple(one for one in session.marks if one is not nearest))


def punched(session: Session, start: float | None, end: float | None) -> Session:
    """Record only from `start` to `end` [s] of the session's time; everything where None.

    Raises:
        InputError: the range is empty.
    """
    if start is None or end is None:
        return replace(session, punch=None)
    if not 0.0 <= start <= end - SHORTEST:
        raise InputError(f"cannot record from {start:g} to {end:g} s: the range is empty")
    return replace(session, punch=(start, end))


Edit = Callable[..., Session]

EDITS: dict[str, Edit] = {
    "move": moved,
    "trim": trimmed,
    "split": split,
    "speed": paced,
    "loop": looped,
    "mute": muted,
    "solo": soloed,
    "weight": weighted,
    "additive": made_additive,
    "ease": eased,
    "limit": limited,
    "copy": copied,
    "raise": raised,
    "remove": without_clip,
    "rename": renamed,
    "mark": marked,
    "unmark": unmarked,
    "punch": punched,
}
"""Every edit that a script or a panel can name. A new edit is one more line here."""


def _few(numbers: list[int]) -> str:
    """Some numbers, and how many others there are."""
    shown = ", ".join(map(str, numbers[:12]))
    return f"{shown} and {len(numbers) - 12} more" if len(numbers) > 12 else shown


def _changed(session: Session, number: int, **changes: Any) -> Session:
    """The session with some fields of a clip replaced."""
    clip = session.clip(number)
    changed = replace(clip, **changes)
    return replace(session, clips=tuple(changed if one is clip else one for one in session.clips))
