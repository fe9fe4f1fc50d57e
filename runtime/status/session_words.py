"""What a session says to people, in plain words: what it does, and what to do next."""

from __future__ import annotations

from dataclasses import dataclass

from runtime.session.live_session import LiveSession
from runtime.session.transport import Mode


@dataclass(frozen=True, slots=True)
class SessionStatus:
    """The state of the session that is open.

    Attributes:
        mode: what its time does.
        clips: how many it has.
        undone, redone: what undo and redo would do, in words; empty for nothing.
    """

    mode: Mode
    clips: int
    undone: str
    redone: str


def session_status(session: LiveSession) -> SessionStatus:
    """Return the state of a session as it is now."""
    versions = session.store.versions
    return SessionStatus(
        session.transport.mode, len(session.session.clips), versions.undone, versions.redone
    )


def session_headline(status: SessionStatus) -> str:
    """What the session does, to be read from two metres; empty while the performer is all."""
    return {
        Mode.REHEARSING: "",
        Mode.PLAYING: "Playing the session",
        Mode.PAUSED: "Paused",
        Mode.RECORDING: "Recording",
    }[status.mode]


def session_advice(status: SessionStatus) -> str:
    """What to do next, in one or two sentences; empty where the performer comes first."""
    if status.mode is Mode.RECORDING:
        return "Perform! Press r again to end the take."
    if status.mode is Mode.PLAYING:
        return "Space pauses, r records over it, a lets the performer move the characters."
    if status.mode is Mode.PAUSED:
        return "Space plays on, r records from here, a lets the performer move the characters."
    if status.clips:
        return "Rehearse! Space plays the takes, r records one more, Delete redoes the last."
    return "Rehearse! Press r to record a take."
