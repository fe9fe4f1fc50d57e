"""`bunraku figures`: draws the pictures of the documents: a paper's figures, or the window."""

from __future__ import annotations

import argparse
from pathlib import Path

from devices.errors import InputError
from runtime.cli.options.arguments import size
from runtime.cli.options.show_options import add_character_option

HELP = "draw figures of the papers, edits of shapes, or pictures of the window"
USAGE = "DIR [OPTIONS]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument("folder", type=Path, metavar="DIR", help="the folder for the pictures")
    drawn = parser.add_argument_group("what is drawn")
    drawn.add_argument(
        "--of",
        choices=("paper", "editing", "window"),
        default="paper",
        help="the paper's figures 5 to 7, the figures on editing, or the window (default: paper)",
    )
    drawn.add_argument(
        "--size",
        type=size,
        metavar="WxH",
        help="width and height in pixels of a row of the paper's figures (default: 1500x420) or "
        "of the window (default: 1280x720)",
    )
    add_character_option(drawn, default="cactus; only for the paper's figures")


def run(options: argparse.Namespace) -> int:
    """Write the pictures; print what each is, or its figures in numbers."""
    if options.character and options.of != "paper":
        raise InputError(f"--character is for the paper's figures; --of {options.of} has its own")
    if options.of == "window":
        from runtime.figures.window import draw_window

        print("\n".join(draw_window(options.folder, options.size or (1280, 720))))
        return 0
    if options.of == "editing":
        from runtime.figures.editing import draw_editing

        print("\n".join(draw_editing(options.folder, options.size or (1500, 420))))
        return 0
    from runtime.characters.open_character import load_character
    from runtime.figures.paper_figures import draw_figures

    characters = [load_character(name) for name in options.character or ["cactus"]]
    for line in draw_figures(options.folder, characters, options.size or (1500, 420)):
        print(line)
    return 0
