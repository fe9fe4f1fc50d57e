"""`bunraku figures`: draws the paper's figures on squash and stretch with our own solvers."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.options.arguments import size
from runtime.cli.options.show_options import add_character_option

HELP = "draw the paper's figures on squash and stretch"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder for the pictures")
    parser.add_argument(
        "--size",
        type=size,
        default=(1500, 420),
        metavar="WxH",
        help="width and height of a row in pixels (default 1500x420)",
    )
    add_character_option(parser, required=False)


def run(options: argparse.Namespace) -> int:
    """Write figure-5.png, figure-6.png and figure-7.png; print their figures in numbers."""
    from runtime.characters.open_character import load_character
    from runtime.figures.paper_figures import draw_figures

    characters = [load_character(name) for name in options.character or ["cactus"]]
    for line in draw_figures(options.folder, characters, options.size):
        print(line)
    return 0
