"""Performs a show for the commands `demo`, `replay`, `live` and `session`, with its progress."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from devices.errors import InputError
from devices.stream import SkeletonStream
from replay.playback import playback_of, recording_of
from runtime.characters.open_character import load_character
from runtime.cli.options.show_options import show_settings
from runtime.cli.warm import warm_up
from runtime.control.keys import key_hint
from runtime.session.files.store import SessionStore
from runtime.show import messages
from runtime.show.collector_pauses import collector_paused
from runtime.show.interrupts import Interrupted
from runtime.show.outputs import check_outputs
from runtime.show.pacing import AtOnce
from runtime.show.settings import KioskSettings
from runtime.show.show import Show
from runtime.status.progress import Progress

NOBODY = "nobody"


def perform(
    options: argparse.Namespace,
    open_source: Callable[[], SkeletonStream],
    *,
    origin: str,
    read: Sequence[tuple[str, Path]] = (),
    session: SessionStore | None = None,
    then: Callable[[Show], object] = lambda _: None,
    kiosk: KioskSettings | None = None,
) -> int:
    """Perform the show that the options ask for; the exit code.

    Args:
        options: of the command line; nothing behind this sees them.
        open_source: opens the stream, once all files are known to be possible.
        origin: the address or name of the stream; `NOBODY` where nobody performs.
        read: files that are read and must not be written, each with the name of its option.
        session: where takes are kept and played from.
        then: is called after each frame that was performed.
        kiosk: of `ShowSettings`.

    Raises:
        InputError: anything that a user can put right; at the end, also for files that are not
            whole.
    """
    settings = replace(show_settings(options, origin), kiosk=kiosk)
    names = [Path(name).stem for name in options.character]
    check_outputs(
        settings, names, [*read, *(("--character", Path(name)) for name in options.character)]
    )
    warm_up()
    with collector_paused():
        source = open_source()
    with source as stream:
        with collector_paused():
            characters = [load_character(name) for name in options.character]
        unused = session is None or origin == NOBODY
        if unused and not settings.is_noticed and _frames_of(stream) is None:
            messages.warn(
                "this show has no window, file or sender, and runs until Ctrl-C: nobody sees it"
            )
        pace = AtOnce() if options.fast else None
        show = Show(stream, characters, settings, pace=pace, session=session, tell=messages.say)
        try:
            with show:
                _run(show, stream, then)
        except Interrupted:
            tell_kept(show)
            raise
        tell_kept(show)
        traffic = getattr(stream, "traffic", None)
        if traffic is not None and (why := traffic.unused(origin)):
            messages.warn(why)
    return 0


def _frames_of(stream: SkeletonStream) -> int | None:
    """How many frames a stream has; None where it has no end."""
    playback, recording = playback_of(stream), recording_of(stream)
    if recording is None or playback is None or playback.loop:
        return None
    return len(recording)


def tell_kept(show: Show) -> None:
    """Say of each file what it holds.

    Raises:
        InputError: some are not whole.
    """
    for kept in show.kept:
        messages.announce(str(kept))
    faulty = [str(kept.path) for kept in show.kept if kept.fault]
    if faulty:
        raise InputError(f"not kept whole: {', '.join(faulty)}")


def _run(show: Show, stream: SkeletonStream, then: Callable[[Show], object]) -> None:
    told: dict[str, object] = {}
    if show.settings.window:
        messages.announce(f"{key_hint()}; docs/remote.md lists all")
    _tell_parts(show, told)
    with Progress("performing", _frames_of(stream)) as progress:

        def advance() -> None:
            then(show)
            _tell_parts(show, told)
            progress.advance(said=_milliseconds(show.latency))

        show.run(advance)


def _tell_parts(show: Show, told: dict[str, object]) -> None:
    """Say what drives each character, in words, when it begins and when it has changed.

    Args:
        show: the show.
        told: the last rest state by what was said of it; those that drive still are not told again.
    """
    for act in show.acts:
        session = act.match_session
        if all(rest is None or rest in told.values() for rest in session.rests):
            continue
        for puppet, parts, rest in zip(act.puppets, session.parts, session.rests, strict=True):
            line = f"{puppet.character.name}: " + "; ".join(map(str, parts))
            if parts and rest is not None and line not in told:
                messages.announce(line)
            told[line] = rest


def _milliseconds(seconds: float) -> str:
    """For the progress bar; empty where the latency is unknown."""
    return f"{1e3 * seconds:.1f} ms" if math.isfinite(seconds) else ""
