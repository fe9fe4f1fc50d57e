"""`bunraku session`: performers record takes into a session, which plays them in layers."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from devices.errors import InputError
from runtime.cli.live import for_performers, is_camera
from runtime.cli.options.arguments import Once, digits, positive, seconds
from runtime.cli.options.input_options import add_input_options, stated
from runtime.cli.options.show_options import (
    add_character_option,
    add_playback_options,
    add_show_options,
)

if TYPE_CHECKING:
    from devices.stream import SkeletonStream
    from runtime.show.settings import KioskSettings
    from runtime.show.show import Show
    from runtime.sound.microphone import Microphone

HELP = "record takes in layers, play and edit them"
USAGE = "SESSION.bunraku [--device URL | --recording FILE] [OPTIONS]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument(
        "session",
        type=Path,
        metavar="SESSION.bunraku",
        help="the session's file; a new one is made where there is none, and needs --character",
    )
    _add_performer(parser)
    _add_takes(parser)
    _add_kiosk(parser)
    add_playback_options(parser)
    add_show_options(parser)
    add_input_options(parser)


def _add_performer(parser: argparse.ArgumentParser) -> None:
    who = parser.add_argument_group("performer and characters")
    performer = who.add_mutually_exclusive_group()
    performer.add_argument(
        "--device",
        action=Once,
        metavar="URL",
        help="a live performer; `bunraku devices` lists the devices (default: nobody)",
    )
    performer.add_argument(
        "--recording",
        action=Once,
        type=Path,
        metavar="FILE",
        help="a recorded performer, played again and again; with --fast once",
    )
    add_character_option(who, default="those of the session")


def _add_takes(parser: argparse.ArgumentParser) -> None:
    take = parser.add_argument_group("takes and time")
    take.add_argument(
        "--take", action="store_true", help="begin a take as soon as somebody performs"
    )
    heard = take.add_mutually_exclusive_group()
    heard.add_argument(
        "--sound",
        action=Once,
        type=Path,
        metavar="FILE",
        help="takes carry this sound from their first frame on; videos of the session have it",
    )
    heard.add_argument(
        "--microphone",
        action=Once,
        metavar="NAME",
        help="takes carry what this microphone hears: default, its number or a part of its name "
        "(extra: microphone)",
    )
    take.add_argument(
        "--at",
        type=seconds,
        default=0.0,
        metavar="S",
        help="begin at this second of the session (default: 0)",
    )


def _add_kiosk(parser: argparse.ArgumentParser) -> None:
    alone = parser.add_argument_group("a show that nobody operates")
    alone.add_argument(
        "--kiosk",
        type=positive,
        metavar="S",
        help="play the session S seconds after the last performer has left, and stop for the next "
        "performer; full screen, without the panel",
    )
    alone.add_argument(
        "--pin",
        type=digits,
        metavar="DIGITS",
        help="with --kiosk: lock keys and mouse until these digits are typed",
    )


def run(options: argparse.Namespace) -> int:
    """Perform until the window is closed, or Ctrl-C; the session is saved then."""
    from runtime.cli.performing import NOBODY, perform
    from runtime.output.files.kept_file import counting
    from runtime.session.files.store import SessionStore
    from runtime.show import messages
    from runtime.sound.sound import read_sound

    sound = None if options.sound is None else read_sound(options.sound)
    store = SessionStore(options.session)
    store.sound = sound
    try:
        store.microphone = _microphone(options)
        options.character = store.adopt(options.character or [])
        if store.session.actors and options.drive == "auto":
            options.drive = store.session.actors[0].drive
        if options.device is not None and is_camera(options.device):
            options.mirror = True if options.mirror is None else options.mirror
        origin = options.device or (options.recording.name if options.recording else NOBODY)
        code = perform(
            options,
            lambda: _source(options),
            origin=origin,
            read=[("--recording", options.recording)] if options.recording else [],
            session=store,
            then=_Beginning(options.at, take=options.take),
            kiosk=_kiosk(options),
        )
    except BaseException:
        store.abandon()
        raise
    finally:
        if store.microphone is not None:
            store.microphone.close()
    session = store.session
    messages.announce(
        f"{store.path}: {counting(len(session.takes), 'take')}, "
        f"{counting(len(session.clips), 'clip')}, "
        f"{session.duration:.2f} s"
    )
    return code


def _microphone(options: argparse.Namespace) -> Microphone | None:
    """The microphone whose sound takes carry."""
    if options.microphone is None:
        return None
    from runtime.sound.microphone import Microphone, SystemMicrophone

    return Microphone(SystemMicrophone(options.microphone))


def _kiosk(options: argparse.Namespace) -> KioskSettings | None:
    """What is asked for of a show that nobody operates."""
    from runtime.show.settings import KioskSettings

    if options.kiosk is None:
        if options.pin:
            raise InputError("--pin locks a kiosk: add --kiosk S")
        return None
    return KioskSettings(options.kiosk, options.pin or "")


class _Beginning:
    """Lets the time stand at a second of the session; begins a take once somebody performs.

    Args:
        at: [s] of the session's time.
        take: whether a take is to begin.
    """

    def __init__(self, at: float, *, take: bool) -> None:
        self._at: float | None = at
        self._waits = take

    def __call__(self, show: Show) -> None:
        """Go on, after a frame of the show."""
        from runtime.control.actions import press

        session = show.controls.session
        assert session is not None
        if self._at is not None:
            session.transport.go_to(self._at)
            self._at = None
        if self._waits and session.performed:
            self._waits = False
            press("record", show.controls)


def _source(options: argparse.Namespace) -> SkeletonStream:
    """The performer: live, recorded, or nobody."""
    from devices.stream import open_stream as open_device
    from replay.formats import read_recording
    from runtime.session.nobody import nobody_for
    from runtime.show.open_stream import play

    if options.device is not None:
        return open_device(for_performers(options.device, options.performers))
    if options.recording is not None:
        recording = read_recording(options.recording, stated(options))
        loop = options.loop or not options.fast
        return play(recording, every_frame=options.fast, speed=options.speed, loop=loop)
    return play(nobody_for(1.0, 60.0), loop=True)
