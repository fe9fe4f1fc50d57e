"""The frame loop and everything around it: characters, matching, window, outputs, command line.

The library is at the front: `open_stream`, `load_character`, `ShowSettings` with its parts, and
`Show`. Each is imported when it is first used, so that ``import runtime`` itself loads nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from runtime.characters.open_character import load_character
    from runtime.show.open_stream import open_stream
    from runtime.show.settings import (
        CharacterSettings,
        FileSettings,
        MatchSettings,
        RemoteSettings,
        SenderSettings,
        ShowSettings,
    )
    from runtime.show.show import Show

__all__ = [
    "CharacterSettings",
    "FileSettings",
    "MatchSettings",
    "RemoteSettings",
    "SenderSettings",
    "Show",
    "ShowSettings",
    "load_character",
    "open_stream",
]

_MODULES = {
    **dict.fromkeys(__all__, "runtime.show.settings"),
    "Show": "runtime.show.show",
    "load_character": "runtime.characters.open_character",
    "open_stream": "runtime.show.open_stream",
}
"""The module of each name."""


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
