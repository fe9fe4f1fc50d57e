"""Recording into a session: the performers' frames and what they make of the characters."""

from __future__ import annotations

from runtime.session.live_session import LiveSession
from runtime.show.takes import Takes


def record_into(session: LiveSession, takes: Takes, on: bool) -> None:
    """Begin or end a take of a session, with a recording of the performers' frames beside it."""
    if on:
        if not session.recording and session.record():
            takes.start()
            if takes.recording:
                session.running(takes.running[-1].path.name)
        return
    file = takes.running[-1].path.name if takes.recording else ""
    takes.stop()
    session.stop(file)
