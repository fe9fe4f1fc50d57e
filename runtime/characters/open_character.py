"""Who can go on stage: files of meshes and rigs, and the characters that come with the program."""

from __future__ import annotations

from pathlib import Path

from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.characters.bundles import unbundled
from runtime.characters.character import Character
from runtime.characters.character_file import SUFFIXES, read_character
from runtime.characters.side_view import seen_from_best_side


def is_character(name: str) -> bool:
    """Whether `name` is a built-in character or looks like the file of one."""
    return name in BUILTIN or Path(name).suffix.lower() in SUFFIXES


def load_character(name: str | Path) -> Character:
    """The built-in character or the character in the file called `name`.

    Raises:
        InputError: there is no such file or built-in character, or the file cannot be used.
    """
    if str(name) in BUILTIN:
        return builtin_character(str(name))
    return seen_from_best_side(unbundled(read_character(Path(name))))
