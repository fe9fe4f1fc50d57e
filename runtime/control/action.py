"""An action: something that a puppeteer can trigger or set while a show runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from runtime.control.show_controls import ShowControls


class Kind(Enum):
    """How an action is operated."""

    PRESS = "press"
    SWITCH = "switch"
    FADER = "fader"


Do = Callable[[ShowControls], None]
Read = Callable[[ShowControls], float]
Write = Callable[[ShowControls, float], None]


@dataclass(frozen=True, slots=True)
class Action:
    """One row of the table.

    Attributes:
        label: its name on a button.
        text: what the action does, in a few words.
        press: does it, as a button or a key does; None for a fader.
        write: sets its value in [0, 1]; None where there is no value to set.
        read: returns its value in [0, 1], for a light or a fader; None where there is none.
        words: says what a press has done, where that is not its label with its state; nothing where
            it says nothing.
    """

    label: str
    text: str
    press: Do | None = None
    write: Write | None = None
    read: Read | None = None
    words: Callable[[ShowControls], str] | None = None

    @property
    def kind(self) -> Kind:
        """How the action is operated: a switch can be pressed and set, a fader only set."""
        if self.press is None:
            return Kind.FADER
        return Kind.PRESS if self.write is None else Kind.SWITCH


def switch(
    label: str,
    text: str,
    read: Callable[[ShowControls], bool],
    write: Callable[[ShowControls, bool], None],
    *,
    done: tuple[str, str] | None = None,
) -> Action:
    """Build an action that is on or off: a press reverses it, `write` sets it.

    Args:
        label, text: as of `Action`.
        read: returns whether it is on.
        write: sets it.
        done: what is said once a press has switched it on, and off; nothing where that is empty.
    """
    return Action(
        label,
        text,
        press=lambda controls: write(controls, not read(controls)),
        write=lambda controls, value: write(controls, value >= 0.5),
        read=lambda controls: float(read(controls)),
        words=None if done is None else lambda controls: done[0 if read(controls) else 1],
    )
