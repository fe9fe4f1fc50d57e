"""Load characters by name or file: the entry point for everything that performs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from devices.bodies.plan_by_names import plan_by_declaration, plan_by_names
from devices.errors import InputError
from runtime.characters.bare_body import with_body_by_shape
from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.characters.character import Character
from runtime.characters.character_file import SUFFIXES, read_character
from runtime.characters.facing import facing_the_audience
from runtime.characters.formats.mesh_file import MESH_SUFFIXES
from runtime.characters.parallel_bones import split_parallel_bones
from runtime.characters.sheet import is_sheet
from runtime.characters.side_view import turned_to_best_side


def is_character(name: str) -> bool:
    """Whether `name` is a built-in character or has the suffix of a character file."""
    return name in BUILTIN or Path(name).suffix.lower() in SUFFIXES


def load_character(name: str | Path) -> Character:
    """Return a character ready to perform: built-in, or read from a mesh or rig file.

    A file's character is read by `read_character`; then parallel bones are split, the parts of its
    body are recognised, a back is turned from the audience, and a long character, such as a camel,
    is turned to show its side.

    Args:
        name: of a built-in character, or the path of a file.

    Raises:
        InputError: there is no such file or built-in character, or the file cannot be used.
    """
    if str(name) in BUILTIN:
        return _planned(builtin_character(str(name)))
    if not Path(name).suffix and not Path(name).exists():
        raise InputError(
            f"no character is called {str(name)!r}: give the path of a mesh or rig file, or one of "
            f"{', '.join(BUILTIN)}"
        )
    return turned_to_best_side(_recognised(Path(name)))


def _recognised(path: Path) -> Character:
    """The character in a file with the plan of its body.

    A mesh that shows its back is turned about; rig files say themselves which way is forward.
    """
    character = split_parallel_bones(read_character(path))
    planned = _planned(character)
    if planned.plan is not None or is_sheet(character.vertices, character.faces):
        return planned
    character = with_body_by_shape(character)
    return facing_the_audience(character) if path.suffix.lower() in MESH_SUFFIXES else character


def _planned(character: Character) -> Character:
    """The character with the plan of its body, where one is declared or recognised."""
    skeleton = character.skeleton
    plan = plan_by_declaration(skeleton, character.humanoid)
    if plan is None and not is_sheet(character.vertices, character.faces):
        plan = plan_by_names(skeleton)
    return replace(character, plan=plan)
