"""`bunraku replay`: a recording drives characters."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.options.input_options import add_input_options, stated
from runtime.cli.options.show_options import (
    add_character_option,
    add_playback_options,
    add_show_options,
)

HELP = "drive characters with a recording"
USAGE = "RECORDING --character C [OPTIONS]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument(
        "recording", type=Path, metavar="RECORDING", help="a file; docs/recordings.md lists formats"
    )
    add_character_option(needed)
    add_playback_options(parser)
    add_show_options(parser)
    add_input_options(parser)


def run(options: argparse.Namespace) -> int:
    """Perform the recording to its end."""
    from devices.printable import printable
    from devices.stream import SkeletonStream
    from replay.formats import read_recording
    from runtime.cli.performing import perform
    from runtime.show.open_stream import play

    path: Path = options.recording

    def opened() -> SkeletonStream:
        recording = read_recording(path, stated(options))
        if "animation" in recording.source:
            print(f"animation {printable(recording.source['animation'])}")
        return play(recording, every_frame=options.fast, speed=options.speed, loop=options.loop)

    return perform(
        options,
        opened,
        origin=path.name,
        read=[("RECORDING", path)],
    )
