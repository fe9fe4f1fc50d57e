"""`bunraku render`: the pictures and files of a saved session, without a window."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from devices.errors import InputError
from runtime.cli.options.arguments import Once, positive
from runtime.cli.options.output_options import add_file_options, file_settings
from runtime.cli.options.show_options import add_picture_options, background_of

if TYPE_CHECKING:
    from runtime.session.rendering import RenderedSession
    from runtime.show.settings import ShowSettings

EXACT = 1e-4  # of a character's height
HELP = "write a session's video, pictures and characters"
USAGE = "SESSION.bunraku [OPTIONS]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed", "Give at least one file to write, too.")
    needed.add_argument("session", type=Path, metavar="SESSION.bunraku", help="the session's file")
    part = parser.add_argument_group("the part that is rendered")
    part.add_argument(
        "--from",
        dest="start",
        type=float,
        default=0.0,
        metavar="S",
        help="begin at this second of the session (default: 0)",
    )
    part.add_argument(
        "--to",
        dest="end",
        type=float,
        metavar="S",
        help="end at this second (default: the session's end)",
    )
    part.add_argument(
        "--rate", type=positive, default=60.0, metavar="HZ", help="frames per second (default: 60)"
    )
    add_picture_options(parser)
    files = add_file_options(parser, export_within=EXACT)
    files.add_argument(
        "--timeline",
        action=Once,
        type=Path,
        metavar="OUT.otio",
        help="write all clips and marks of the session for editing programs",
    )
    parser.set_defaults(record=None)  # a session has no performer


def run(options: argparse.Namespace) -> int:
    """Render the session; its file stays as it is."""
    from runtime.output.files.kept_file import size_of
    from runtime.session.files.timeline import TimelineFile
    from runtime.session.rendering import RenderedSession
    from runtime.show import messages
    from runtime.show.settings import ShowSettings

    settings = ShowSettings(
        size=options.size,
        background=background_of(options),
        plain=True,
        fps=options.fps,
        files=file_settings(options),
        origin=options.session.name,
    )
    timeline = None if options.timeline is None else TimelineFile(options.timeline)
    if timeline is None and not settings.is_noticed:
        raise InputError(
            "nothing to write: add --video, --frames, --cache, --export, --timeline or --report"
        )
    with RenderedSession(
        options.session, options.start, options.end, options.rate, warn=messages.warn
    ) as rendered:
        if timeline is not None:
            said = timeline.write(rendered.session, options.session, options.rate)
            messages.announce(f"{options.timeline}: {said}, {size_of(options.timeline)}")
        if settings.is_noticed:
            _perform(rendered, settings)
    return 0


def _perform(rendered: RenderedSession, settings: ShowSettings) -> None:
    """Play the part, and say of each file what it holds."""
    from runtime.cli.performing import tell_kept
    from runtime.cli.warm import warm_up
    from runtime.show import messages
    from runtime.status.progress import Progress

    warm_up()
    show = rendered.show(settings, tell=messages.say)
    with show, Progress("rendering", rendered.frames) as progress:
        show.run(progress.advance)
    tell_kept(show)
