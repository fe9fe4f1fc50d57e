"""`bunraku live`: a live performer drives characters."""

from __future__ import annotations

import argparse

from runtime.cli.options.show_options import add_character_option, add_show_options

HELP = "drive characters with a live performer"
USAGE = "--device URL --character C [OPTIONS]"
CAMERA = "webcam://"
FILM = "webcam:///"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument(
        "--device", required=True, metavar="URL", help="the device; `bunraku devices` lists them"
    )
    add_character_option(needed)
    add_show_options(parser)


def run(options: argparse.Namespace) -> int:
    """Perform until the window is closed, or Ctrl-C."""
    from devices.stream import open_stream
    from runtime.cli.performing import perform

    url: str = options.device
    if is_camera(url):
        options.mirror = True if options.mirror is None else options.mirror
    return perform(
        options, lambda: open_stream(for_performers(url, options.performers)), origin=url
    )


def is_camera(url: str) -> bool:
    """Whether an address is a webcam's, whose performers see the show as in a mirror."""
    return url.startswith(CAMERA) and not url.startswith(FILM)


def for_performers(url: str, count: int) -> str:
    """A webcam's or film's address with the number of performers, unless it has one."""
    path, _, query = url.partition("?")
    if not path.startswith(CAMERA) or count == 1 or "people=" in query:
        return url
    return f"{path}?{query}{'&' if query else ''}people={count}"
