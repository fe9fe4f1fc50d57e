"""Undo and redo: the versions of a session, one for each step of the user."""

from __future__ import annotations

from dataclasses import dataclass

from runtime.session.document import Session

MOST = 1000  # steps that can be undone


@dataclass(frozen=True, slots=True)
class Step:
    """A session and what was done to make it, in words: "move the clip"."""

    session: Session
    done: str


class Versions:
    """Keeps the versions of a session; they share everything that an edit does not change.

    Args:
        session: the first version.
    """

    def __init__(self, session: Session) -> None:
        self._steps = [Step(session, "")]
        self._at = 0
        self._dragged = ""

    @property
    def session(self) -> Session:
        """The present version of the session."""
        return self._steps[self._at].session

    @property
    def undone(self) -> str:
        """What `undo` would undo, in words; empty where there is nothing to undo."""
        return self._steps[self._at].done if self._at > 0 else ""

    @property
    def redone(self) -> str:
        """What `redo` would do again; empty where there is nothing."""
        return self._steps[self._at + 1].done if self._at + 1 < len(self._steps) else ""

    def do(self, session: Session, done: str) -> None:
        """Add a version as one step. What had been undone is dropped.

        A session that equals the one before is no step.
        """
        self._dragged = ""
        if session == self.session:
            return
        self._steps = [*self._steps[: self._at + 1], Step(session, done)][-(MOST + 1) :]
        self._at = len(self._steps) - 1

    def drag(self, session: Session, done: str) -> None:
        """Add a version of a drag; all of it, until `drop` or another edit, is one step."""
        if self._dragged == done and self._at > 0:
            self._steps[self._at] = Step(session, done)
            return
        if session != self.session:
            self.do(session, done)
            self._dragged = done

    def drop(self) -> None:
        """End a drag: the next one is another step."""
        self._dragged = ""

    def undo(self) -> bool:
        """Go back by one step; return whether there was one."""
        self._dragged = ""
        if self._at == 0:
            return False
        self._at -= 1
        return True

    def redo(self) -> bool:
        """Do again what was undone last; return whether there was something."""
        self._dragged = ""
        if self._at + 1 == len(self._steps):
            return False
        self._at += 1
        return True
