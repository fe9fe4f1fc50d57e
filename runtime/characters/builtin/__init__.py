"""The built-in characters: modelled in code, meshed beforehand, loaded from ``meshes/*.npz``.

Each is a module with `sculpt()`; ``python -m runtime.characters.builtin.build`` meshes them.
`builtin_character` reads only the stored meshes.
"""

from runtime.characters.builtin.catalogue import BUILTIN, builtin_character

__all__ = ["BUILTIN", "builtin_character"]
