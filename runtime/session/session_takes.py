"""Records takes into a session: the performers' frames, and what the characters did."""

from __future__ import annotations

from collections.abc import Callable

from runtime.session.live_session import LiveSession
from runtime.show.takes import Takes


def begin_take(session: LiveSession, takes: Takes, start: Callable[[], None]) -> None:
    """Begin a take of a session, with a recording of the performers' frames beside it.

    Args:
        session: the session.
        takes: of the show.
        start: starts a take of these.
    """
    if not session.recording and session.record():
        start()
        if takes.recording:
            session.running(takes.running[-1].path.name)


def end_take(session: LiveSession, takes: Takes) -> None:
    """End the take of a session, if there is one."""
    file = takes.running[-1].path.name if takes.recording else ""
    takes.stop()
    session.stop(file)
