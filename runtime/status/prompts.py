"""What a show says to people, in plain words: what it sees, and what to do next."""

from __future__ import annotations

import math

from runtime.control.count_in import Counted
from runtime.session.transport import Mode
from runtime.status.choosing_words import choosing_advice, choosing_headline
from runtime.status.session_words import session_advice, session_headline
from runtime.status.show_status import CharacterStatus, PerformerStatus, ShowStatus
from runtime.status.stream_watch import Sight, Sighting

_COUNTED = {
    Counted.TAKE: "Take your place! r or Escape ends the countdown: no take begins then.",
    Counted.REST: "Stand as the character rests: the pose at zero counts. Escape ends this.",
}


def headline(status: ShowStatus) -> str:
    """What is seen of the performer, to be read from two metres away."""
    if words := _headline_of_flow(status):
        return words
    sighting = status.sighting
    if is_paused(status):
        return "Paused"
    if status.frozen:
        return "Frozen"
    if sighting.sight is Sight.SEEN and status.matching:
        return "Looking for a match"
    return {
        Sight.WAITING: f"Waiting for a performer, {_duration(sighting.seconds)}",
        Sight.NOT_UNDERSTOOD: "Something comes, but no performer",
        Sight.SEEN: _in_view(status) if _is_live(status) else f"{_name(status)} plays",
        Sight.LOST: f"Performer lost for {_duration(sighting.seconds)}",
        Sight.ENDED: "The end",
    }[sighting.sight]


def _headline_of_flow(status: ShowStatus) -> str:
    """What is under way, whatever is seen; empty for nothing."""
    if status.choosing is not None:
        return choosing_headline(status.choosing)
    if status.count_in is not None:
        counted, left = status.count_in
        return f"{counted.value} in {math.ceil(left)}"
    return "" if status.session is None else session_headline(status.session)


def details(status: ShowStatus) -> str:
    """Where the performer comes from, how many are in view, and what is seen of them."""
    sighting, live = status.sighting, _is_live(status)
    name = _name(status)
    words = [] if name in headline(status) else [name]
    if sighting.sight is Sight.SEEN and status.performers:
        words.append(_people(status))
        words += [
            f"{one.seen} of {one.joints} joints seen" + _lost(one) for one in status.performers
        ]
        if live and sighting.seconds >= 1.0:
            words.append(f"for {_duration(sighting.seconds)}")
    return ", ".join(words)


def advice(status: ShowStatus) -> str:
    """What to do next, in one or two sentences."""
    if status.choosing is not None:
        return choosing_advice(status.choosing)
    if status.count_in is not None:
        return _COUNTED[status.count_in[0]]
    return _advice_on_show(status)


def _advice_on_show(status: ShowStatus) -> str:
    if status.session is not None and status.session.mode is not Mode.REHEARSING:
        return session_advice(status.session)
    if is_paused(status):
        return "Space plays on. Drag the line below to go to another moment."
    if status.frozen:
        return "The characters stand still, the performer goes on. Press e to let them move again."
    sighting = status.sighting
    if sighting.trouble:
        return sighting.trouble
    if sighting.sight is Sight.SEEN:
        return _advice_on_matching(status)
    return {
        Sight.WAITING: f"Start the sender, or step in front of the sensor. {_listening(status)}",
        Sight.NOT_UNDERSTOOD: _not_understood(sighting, status.origin),
        Sight.LOST: f"Nothing has come for {_duration(sighting.seconds)}: step back into view, or "
        "look whether the sender still runs.",
        Sight.ENDED: "The recording is over. Home plays it again.",
    }[sighting.sight]


def place_of_match(status: ShowStatus, selected: int | None) -> str:
    """Which of how many matches is shown, and for whom; empty where there are none to step through.

    Args:
        status: of the show.
        selected: the number of the character that the arrows are for; None for all.
    """
    chosen = status.characters if selected is None else [status.characters[selected]]
    for character in chosen:
        candidate = character.candidate
        if candidate is None:
            continue
        whose = f" for {character.name}" if len(status.characters) > 1 else ""
        if candidate.rank == 0:
            return f"mapped by hand{whose}"
        return f"match {candidate.rank} of {candidate.count}{whose}"
    return ""


def news(before: Sight, sighting: Sighting, origin: str) -> str:
    """One line on what is seen, after something else was seen before."""
    if sighting.sight is Sight.SEEN:
        return "the performer is back" if before is Sight.LOST else "the performer is in view"
    if sighting.sight is Sight.LOST:
        return "the performer is lost: nothing comes any more; the characters ease to rest"
    if sighting.sight is Sight.NOT_UNDERSTOOD:
        return _not_understood(sighting, origin)
    return f"waiting for a performer at {origin}"


def counted_down(status: ShowStatus) -> float | None:
    """[s] of a count-in or a countdown that goes by; None while the performer still moves."""
    counts = status.count_in is not None or any(one.counts for one in status.characters)
    return countdown(status) if counts else None


def countdown(status: ShowStatus) -> float | None:
    """[s] until a count-in ends or what is shown performs by itself; None where nothing does."""
    if status.count_in is not None:
        return status.count_in[1]
    left = [
        character.countdown
        for character in status.characters
        if character.countdown is not None and math.isfinite(character.countdown)
    ]
    return min(left, default=None)


def _name(status: ShowStatus) -> str:
    """What the stream is called: an address as it is, of a path its last part."""
    origin = status.origin
    return origin if "://" in origin else origin.replace("\\", "/").rsplit("/", 1)[-1]


def _is_live(status: ShowStatus) -> bool:
    """Whether somebody performs now; the playback of a session is its own."""
    return status.session is not None or status.playback is None


def is_paused(status: ShowStatus) -> bool:
    """Whether a recording stands still; the time of a session does so while one rehearses."""
    return status.session is None and status.playback is not None and status.playback.paused


def _advice_on_matching(status: ShowStatus) -> str:
    matching = [character for character in status.characters if character.matching]
    if not matching and status.session is not None:
        return session_advice(status.session)
    if not matching:
        first = "Perform!" if _is_live(status) else "It plays by itself."
        return f"{first} Press m to match again, r to record a take, ? for all keys."
    if all(character.countdown is None for character in matching):
        return "Step into view with your whole body."
    live = _is_live(status)
    strike = f"Strike the pose of {matching[0].name}: " if live else f"{matching[0].name}: "
    return f"{strike}{_candidate(matching[0])} {_accepting(status)}"


def _candidate(character: CharacterStatus) -> str:
    if character.candidate is None:
        return "it follows limb by limb."
    if character.candidate.rank == 0:
        return "it follows the mapping made by hand."
    return f"match {character.candidate.rank} of {character.candidate.count} lights up."


def _accepting(status: ShowStatus) -> str:
    left = countdown(status)
    if status.hands_free is not None and status.hands_free[0]:
        return "Make the gesture below to use it."
    if left is None:
        return "Enter accepts it, the arrows show others."
    return f"Keep still: it starts in {math.ceil(left)}. Enter starts it, the arrows show others."


def _in_view(status: ShowStatus) -> str:
    people = _count(status)
    return "Performer in view" if people < 2 else f"{people} performers in view"


def _people(status: ShowStatus) -> str:
    people = _count(status)
    return {0: "nobody", 1: "1 person"}.get(people, f"{people} people")


def _count(status: ShowStatus) -> int:
    return sum(one.seen > 0 for one in status.performers)


def _lost(performer: PerformerStatus) -> str:
    return f" ({' and '.join(performer.lost)} lost)" if performer.lost else ""


def _listening(status: ShowStatus) -> str:
    return f"Listening at {status.origin}." if "://" in status.origin else ""


def _not_understood(sighting: Sighting, origin: str) -> str:
    refused = f", {sighting.refused} of them unreadable" if sighting.refused else ""
    return (
        f"{sighting.packets} packets came{refused}, and no skeleton in them. Does the sender send "
        f"what {origin.partition('://')[0] or 'this device'} expects?"
    )


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min"
