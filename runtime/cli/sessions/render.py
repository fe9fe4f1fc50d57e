"""`bunraku render`: the pictures and files of a saved session, without a window."""

from __future__ import annotations

import argparse
from pathlib import Path

from devices.errors import InputError
from runtime.cli.options.arguments import positive
from runtime.cli.options.output_options import add_file_options, file_settings
from runtime.cli.options.show_options import add_picture_options, background_of

EXACT = 1e-4  # of a character's height
HELP = "write a session's video, pictures and characters"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    parser.add_argument("session", type=Path, metavar="SESSION.bunraku")
    part = parser.add_argument_group("the part that is rendered")
    part.add_argument(
        "--from", dest="start", type=float, default=0.0, metavar="S", help="from this second on"
    )
    part.add_argument(
        "--to", dest="end", type=float, metavar="S", help="to this second (default: the end)"
    )
    part.add_argument(
        "--rate", type=positive, default=60.0, metavar="HZ", help="frames a second (default 60)"
    )
    add_picture_options(parser)
    add_file_options(parser, export_within=EXACT)


def run(options: argparse.Namespace) -> int:
    """Render the session; its file stays as it is."""
    from runtime.cli.performing import tell_kept
    from runtime.cli.warm import warm_up
    from runtime.session.rendering import RenderedSession
    from runtime.show import messages
    from runtime.show.settings import ShowSettings
    from runtime.status.progress import Progress

    settings = ShowSettings(
        size=options.size,
        background=background_of(options),
        plain=True,
        fps=options.fps,
        files=file_settings(options),
        origin=options.session.name,
    )
    if not settings.is_noticed:
        raise InputError("nothing to write: add --video, --frames, --cache, --export or --report")
    warm_up()
    with RenderedSession(
        options.session, options.start, options.end, options.rate, warn=messages.warn
    ) as rendered:
        show = rendered.show(settings, tell=messages.say)
        with show, Progress("rendering", rendered.frames) as progress:
            show.run(progress.advance)
    tell_kept(show)
    return 0
