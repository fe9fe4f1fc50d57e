"""The characters that ship with Bunraku: sculpted in code, meshed beforehand, read at once.

Each is a module with `sculpt()`; ``python -m runtime.characters.builtin.build`` meshes them into
``meshes/*.npz``, which is all that `builtin_character` needs at run time.
"""

from runtime.characters.builtin.catalogue import BUILTIN, builtin_character

__all__ = ["BUILTIN", "builtin_character"]
