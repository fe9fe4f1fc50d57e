"""The options that say of a recording what its file leaves open."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from runtime.cli.options.arguments import positive

if TYPE_CHECKING:
    from replay.stated import Stated


def add_input_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of every command that reads a recording."""
    said = parser.add_argument_group(
        "what the recording's file leaves open",
        "Without these it is guessed; `bunraku info` shows every guess as a note.",
    )
    said.add_argument(
        "--fps-input", type=positive, metavar="N", help="its frames per second, instead of times"
    )
    said.add_argument(
        "--up-input",
        type=_plain,
        metavar="AXIS",
        help="which of its axes points up: x, y, z; or -x, -y, -z, as in --up-input=-z",
    )
    said.add_argument(
        "--unit-input",
        type=_plain,
        metavar="UNIT",
        help="its unit of length: m, dm, cm, mm, in or ft",
    )
    said.add_argument(
        "--mirror-input", action="store_true", help="it shows the performer as in a mirror"
    )
    said.add_argument(
        "--animation-input",
        metavar="NAME",
        help="which animation of a glTF file is played: its name, or its number from 1",
    )


def stated(options: argparse.Namespace) -> Stated:
    """What the options of a command line say of the recording."""
    from replay.stated import Stated

    return Stated(
        rate=options.fps_input,
        up=options.up_input,
        unit=options.unit_input,
        mirrored=options.mirror_input,
        animation=options.animation_input,
    )


def _plain(text: str) -> str:
    return text.strip().lower().removeprefix("+")
