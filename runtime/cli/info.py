"""`bunraku info`: prints what a recording, a character or a session contains."""

from __future__ import annotations

import argparse
from pathlib import Path

from runtime.cli.options.input_options import add_input_options, stated

HELP = "show what a recording, a character or a session contains"
USAGE = "FILE [OPTIONS]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument(
        "file",
        metavar="FILE",
        help="a recording, a mesh, a rig, a session, or the name of a built-in character",
    )
    add_input_options(parser)


def run(options: argparse.Namespace) -> int:
    """Print what is in a recording, a mesh, a rig or a session."""
    from replay.formats import recognise
    from replay.info import summary
    from runtime.characters.open_character import is_character

    if options.file.lower().endswith(".bunraku"):
        from runtime.cli.sessions.contents import contents_of

        lines = contents_of(Path(options.file))
    elif is_character(options.file):
        lines = _of_character(options.file)
    else:
        path = Path(options.file)
        kind = recognise(path)
        lines = summary(kind.read(path, stated(options)), path, kind.name)
    print("\n".join(lines))
    return 0


def _of_character(name: str) -> list[str]:
    from devices.printable import printable
    from runtime.characters.open_character import load_character

    character = load_character(name)
    morphs = character.morphs
    blends = [] if morphs is None else [one.name for one in morphs.expressions if one.binds]
    width, height, depth = character.vertices.max(axis=0) - character.vertices.min(axis=0)
    parents = character.skeleton.parents
    leaves = set(range(len(parents))) - set(parents.tolist())
    return [
        f"{printable(name)}: a character",
        f"vertices    {len(character.vertices)} ({len(character.surface.vertex)} in the file)",
        f"faces       {len(character.faces)}",
        f"nodes       {len(parents)}, {len(leaves)} of them leaves",
        f"rig         {'from the file' if character.weights is not None else 'none in the file'}",
        f"on stage    {width:.2f} x {height:.2f} x {depth:.2f} m",
        f"animations  {_animations(Path(name)) or 'none'}",
        f"blends      {printable(', '.join(blends)) or 'none'}",
        *(f"note        {printable(note)}" for note in character.notes),
    ]


def _animations(path: Path) -> str:
    """What a file could play as a recording; "" for nothing."""
    from devices.errors import ContentError
    from replay.gltf.reader import animations_in
    from runtime.characters.character_file import RIG_SUFFIXES

    if path.suffix.lower() not in RIG_SUFFIXES:
        return ""
    try:
        return animations_in(path)
    except ContentError as error:
        return f"damaged: {error}"
