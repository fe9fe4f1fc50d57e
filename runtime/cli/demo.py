"""`bunraku demo`: a built-in performance drives every built-in character."""

from __future__ import annotations

import argparse
import os
import sys

from runtime.cli.options.show_options import (
    add_character_option,
    add_playback_options,
    add_show_options,
)

HELP = "play the built-in show with the built-in characters"
USAGE = "[OPTIONS]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    add_character_option(parser.add_argument_group("characters"), default="all built-in ones")
    add_playback_options(parser)
    add_show_options(parser)
    parser.set_defaults(fps=30.0, size="1280x560")


def run(options: argparse.Namespace) -> int:
    """Perform the built-in show; without a display headless, and as fast as it can."""
    from replay.builtin import builtin_recording
    from runtime.characters.builtin import BUILTIN
    from runtime.cli.performing import perform
    from runtime.show import messages
    from runtime.show.open_stream import play

    options.character = options.character or list(BUILTIN)
    if not _has_display():
        options.headless = options.fast = True
    code = perform(
        options,
        lambda: play(
            builtin_recording("show"),
            every_frame=options.fast,
            speed=options.speed,
            loop=options.loop,
        ),
        origin="show",
    )
    kept = (options.video, options.frames, options.cache, options.report, options.export)
    if options.headless and not any(kept):
        messages.announce("nothing was kept: add --video demo.mp4 to look at the show")
    return code


def _has_display() -> bool:
    if not sys.platform.startswith("linux"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
