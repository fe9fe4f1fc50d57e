"""Shows that record into a session and edit it, each killed at a random moment; run as a program.

Prints a line of JSON for each seed: what the show said before its death. What it left on the disk
is copied to a folder of its own.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import random
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.control.actions import press
from runtime.session.document import Session
from runtime.session.files.codec import as_json
from runtime.session.files.store import SessionStore
from runtime.session.live_session import LiveSession
from runtime.show.open_stream import play
from runtime.show.settings import ShowSettings
from runtime.show.show import Show
from tests.runtime.session.sessions import chain, random_edit

ON_DISK = {"open", "os.rename", "os.remove", "os.mkdir", "os.truncate"}


def digest(session: Session) -> str:
    """A name of a session's content."""
    return hashlib.sha256(json.dumps(as_json(session)).encode()).hexdigest()[:12]


class TellingStore(SessionStore):
    """Tells each version of a session before and after it is written."""

    def write(self) -> None:
        tell("will", digest(self.session))
        super().write()
        tell("did", digest(self.session))


def tell(*said: str) -> None:
    """Write a line that is read even if the next thing is death."""
    if _PIPE:
        os.write(_PIPE[1], (json.dumps(said) + "\n").encode())


def die_on_the_disk(events: int) -> None:
    """Kill this process before one of its next operations on the disk."""
    left = itertools.count(events, -1)

    def count(event: str, arguments: tuple[Any, ...]) -> None:
        if event in ON_DISK and "bunraku" in str(arguments[0]) and next(left) <= 0:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(count)


def perform(show: Show, seed: int) -> None:
    """Record, edit and undo until death."""
    dice, session = random.Random(seed), show.controls.session
    assert session is not None
    ticks = itertools.count(dice.randint(1, 150), -1)
    if seed % 2:
        die_on_the_disk(dice.randint(0, 60))
    while True:
        for _ in range(dice.randint(1, 12)):
            show.tick()
            if not seed % 2 and next(ticks) == 0:
                os.kill(os.getpid(), signal.SIGKILL)
        act(show, session, dice)


def act(show: Show, session: LiveSession, dice: random.Random) -> None:
    """Do one thing that a user may do."""
    if dice.random() < 0.4:
        tell("turning")
        press("record", show.controls)
        tell("recording" if session.recording else "not recording")
    elif dice.random() < 0.5 and session.session.clips:
        edited = random_edit(session.session, dice)
        for take in edited.takes:
            session.store.keep(take.performance, chain())
        session.edit(edited, "edit")
    else:
        press(dice.choice(["undo", "redo", "recall", "retake", "save"]), show.controls)
        tell("recording" if session.recording else "not recording")


def main(folder: Path, seeds: int) -> None:
    """Let `seeds` shows die, one after the other."""
    path = folder / "show.bunraku"
    stream = play(builtin_recording("wave"), every_frame=True, loop=True)
    clock = itertools.count()  # so that takes may follow one another at once
    show = Show(
        stream,
        [load_character("mannequin")],
        ShowSettings(),
        session=TellingStore(path),
        clock=lambda: float(next(clock)),
        warn=lambda _: None,
    )
    show.tick()
    begun = folder / "begun"
    shutil.copytree(path.with_name("show.bunraku.unsaved"), begun)
    for seed in range(seeds):
        said = lived(show, seed)
        left = folder / str(seed)
        left.mkdir()
        for each in folder.glob("show.bunraku*"):
            each.rename(left / each.name)
        shutil.copytree(begun, path.with_name("show.bunraku.unsaved"))
        sys.stdout.write(json.dumps(said) + "\n")
        sys.stdout.flush()
    os._exit(0)  # nothing is closed, as the children had it open too


def lived(show: Show, seed: int) -> list[list[str]]:
    """What a show says until it is killed."""
    _PIPE[:] = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(_PIPE[0])
        try:
            perform(show, seed)
        finally:
            os._exit(1)
    os.close(_PIPE[1])
    with os.fdopen(_PIPE[0]) as told:
        said = [json.loads(line) for line in told]
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status), f"show {seed} ended by itself"
    return said


_PIPE: list[int] = []

if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
