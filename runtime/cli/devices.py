"""`bunraku devices`: lists what is connected, what arrives, and why nothing does."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.options.arguments import positive

HELP = "list connected devices, arriving data and taken ports"
USAGE = "[URL ...] [--seconds N] [--json FILE]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    heard = parser.add_argument_group("where to listen, and how long")
    heard.add_argument(
        "addresses",
        nargs="*",
        metavar="URL",
        help="listen only at these addresses (default: the usual one of each kind of device)",
    )
    heard.add_argument(
        "--seconds",
        type=positive,
        default=2.0,
        metavar="N",
        help="listen for N seconds (default: 2)",
    )
    kept = parser.add_argument_group("file to write")
    kept.add_argument(
        "--json", type=Path, metavar="FILE", help="also write the result to this file"
    )


def run(options: argparse.Namespace) -> int:
    """Listen at every address and print what is there.

    Raises:
        InputError: an address is of no known kind, or the file cannot be written.
    """
    from devices.printable import printable
    from replay.formats import formats
    from runtime.characters.builtin import BUILTIN
    from runtime.cli.device_watch import PLACES, check_kind, watch, write_json
    from runtime.output.files.whole_file import check_writable

    if options.json is not None:
        check_writable(options.json)
    for address in options.addresses:
        check_kind(address)
    seconds: float = options.seconds
    watches = watch(options.addresses or PLACES, seconds)
    width = max(len(seen.address) for seen in watches)
    for seen in watches:
        print(f"{seen.state:<10} {printable(seen.address):<{width}}  {printable(seen.detail)}")
    if not options.addresses:
        print("recordings " + ", ".join(kind.name for kind in formats()))
        print("characters " + ", ".join(BUILTIN))
    if options.json is not None:
        write_json(options.json, seconds, watches)
    return 0
