"""Describes a session line by line: actors, takes, clips and marks."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from devices.printable import printable
from runtime.session.document import Clip, Session
from runtime.session.files.archive import unpack
from runtime.session.files.folder import Opened, SessionFolder


def contents_of(path: Path) -> list[str]:
    """Return what a session's file holds, a line each; the file stays as it is.

    Raises:
        InputError: it cannot be read.
    """
    with TemporaryDirectory() as folder:
        lost = unpack(path, Path(folder))
        opened = SessionFolder(Path(folder)).read()
    return lines_of(path, Opened(opened.session, (*lost, *opened.lost)))


def lines_of(path: Path, opened: Opened) -> list[str]:
    """Return what is in a session, a line each."""
    session = opened.session
    lines = [
        f"{printable(str(path))}: a session",
        f"duration    {session.duration:.2f} s",
        *(
            f"character   {actor.id}: {printable(actor.name)}, {actor.nodes} nodes, driven "
            f"{printable(actor.drive)}"
            for actor in session.actors
        ),
        *(
            f"take        {take.id}: {printable(take.name)}, of {_name(session, take.actor)}, "
            f"{take.performance.duration:.2f} s, {len(take.performance.nodes)} nodes"
            + (", with sound" if take.sound else "")
            for take in session.takes
        ),
        *(_clip(session, clip) for clip in session.clips),
        *(f"mark        {mark.time:.2f} s: {printable(mark.name)}" for mark in session.marks),
    ]
    if session.punch is not None:
        lines.append(f"records     {session.punch[0]:.2f} to {session.punch[1]:.2f} s")
    return [*lines, *(f"lost        {printable(line)}" for line in opened.lost)]


def _name(session: Session, actor: int) -> str:
    return printable(session.actor(actor).name)


def _clip(session: Session, clip: Clip) -> str:
    how = [
        f"{clip.speed:g} times as fast" if clip.speed != 1.0 else "",
        f"{clip.passes:g} times" if clip.passes != 1.0 else "",
        f"{100.0 * clip.weight:.0f} %" if clip.weight != 1.0 else "",
        "adds" if clip.additive else "",
        "muted" if clip.muted else "",
        "solo" if clip.solo else "",
        f"{len(clip.nodes)} nodes" if clip.nodes is not None else "",
    ]
    said = "".join(f", {each}" for each in how if each)
    take = session.take(clip.take)
    played = f"{printable(take.name)} of {_name(session, take.actor)}"
    return f"clip        {clip.id}: {clip.start:.2f} to {clip.end:.2f} s, {played}{said}"
