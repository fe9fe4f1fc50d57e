"""`bunraku replay`: a recording drives characters."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.options.input_options import add_input_options, stated
from runtime.cli.options.show_options import add_character_option, add_show_options

HELP = "drive characters with a recording"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    parser.add_argument("recording", type=Path, metavar="RECORDING", help="any recording")
    add_character_option(parser, required=True)
    add_input_options(parser)
    add_show_options(parser)


def run(options: argparse.Namespace) -> int:
    """Perform the recording to its end."""
    from runtime.cli.performing import perform
    from runtime.show.open_stream import open_stream

    path: Path = options.recording
    return perform(
        options,
        lambda: open_stream(
            path,
            every_frame=options.fast,
            speed=options.speed,
            loop=options.loop,
            stated=stated(options),
        ),
        origin=path.name,
        read=[("RECORDING", path)],
    )
