"""`bunraku live`: a live performer drives characters."""

from __future__ import annotations

import argparse

from runtime.cli.options.show_options import add_character_option, add_show_options

HELP = "drive characters with a live performer"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    parser.add_argument(
        "--device", required=True, metavar="URL", help="the device; `bunraku devices` lists them"
    )
    add_character_option(parser, required=True)
    add_show_options(parser)


def run(options: argparse.Namespace) -> int:
    """Perform until the window is closed, or Ctrl-C."""
    from devices.stream import open_stream
    from runtime.cli.performing import perform

    url: str = options.device
    return perform(options, lambda: open_stream(url), origin=url)
