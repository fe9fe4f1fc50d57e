"""`bunraku convert`: writes a recording of any kind as a file of another kind."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.options.arguments import positive, whole
from runtime.cli.options.input_options import add_input_options, stated

HELP = "convert a recording to another format"
USAGE = "IN OUT.{mcap,bvh,csv} [OPTIONS]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument(
        "recording", type=Path, metavar="IN", help="a recording; docs/recordings.md lists formats"
    )
    needed.add_argument(
        "out",
        type=Path,
        metavar="OUT.{mcap,bvh,csv}",
        help="the file to write; its suffix chooses the format",
    )
    written = parser.add_argument_group("what is written")
    written.add_argument(
        "--performer", type=whole, metavar="N", help="write only performer N (default: all)"
    )
    written.add_argument(
        "--unit", choices=("cm", "m", "mm", "in"), help="the unit of a BVH file (default: cm)"
    )
    written.add_argument(
        "--rate",
        type=positive,
        metavar="HZ",
        help="frames per second of a BVH file (default: those of the recording)",
    )
    written.add_argument("--force", action="store_true", help="replace OUT if it already exists")
    add_input_options(parser)


def run(options: argparse.Namespace) -> int:
    """Write the recording again; print what was guessed and what was lost."""
    from devices.printable import printable
    from runtime.cli.conversion import Conversion, convert

    conversion = Conversion(
        recording=options.recording,
        out=options.out,
        performer=options.performer,
        unit=options.unit,
        rate=options.rate,
        force=options.force,
        stated=stated(options),
    )
    for line in convert(conversion):
        print(printable(line))
    return 0
