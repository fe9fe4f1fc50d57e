"""The options for what a recording's file does not say: rate, up axis, unit, mirroring."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from runtime.cli.options.arguments import positive

if TYPE_CHECKING:
    from replay.stated import Stated


def add_input_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of every command that reads a recording."""
    said = parser.add_argument_group(
        "what the recording's file does not say",
        "What the file does not say is guessed; `bunraku info` shows each guess as a note.",
    )
    said.add_argument(
        "--fps-input",
        type=positive,
        metavar="N",
        help="frames per second, in place of the times in the file",
    )
    said.add_argument(
        "--up-input",
        type=_plain,
        metavar="AXIS",
        help="the axis that points up: x, y, z, -x, -y or -z, as in --up-input=-z",
    )
    said.add_argument(
        "--unit-input",
        type=_plain,
        metavar="UNIT",
        help="the unit of length: m, dm, cm, mm, in or ft",
    )
    said.add_argument(
        "--mirror-input",
        action="store_true",
        help="the recording shows the performer as in a mirror",
    )
    said.add_argument(
        "--animation-input",
        metavar="NAME",
        help="the animation of a glTF file to play: its name, or its number from 1",
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
