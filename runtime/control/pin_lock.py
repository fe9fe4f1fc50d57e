"""Locks the keys and the mouse of a window until a PIN is typed."""

from __future__ import annotations

import math
from collections.abc import Callable

from runtime.control.window import InputTaker

OPEN = 60.0  # [s] without input after which it locks again


class PinLock:
    """Keeps all input to itself until the PIN is typed, then hands it on.

    Args:
        taker: what takes the input while it is unlocked.
        pin: digits.
        clock: host monotonic time [s].
        tell: takes one line when it is unlocked.
    """

    def __init__(
        self,
        taker: InputTaker,
        pin: str,
        *,
        clock: Callable[[], float],
        tell: Callable[[str], None],
    ) -> None:
        self._taker, self._pin = taker, pin
        self._clock, self._tell = clock, tell
        self._typed = ""
        self._used_at = -math.inf

    def key(self, name: str, *, down: bool, shift: bool, control: bool) -> bool:
        """Take a key: see `InputTaker.key`."""
        if self._keeps():
            if down:
                self._type(name)
            return True
        return self._taker.key(name, down=down, shift=shift, control=control)

    def letter(self, character: str) -> bool:
        """Take a typed character: see `InputTaker.letter`."""
        return self._keeps() or self._taker.letter(character)

    def button(self, button: int, *, down: bool) -> bool:
        """Take a button of the mouse: see `InputTaker.button`."""
        return self._keeps() or self._taker.button(button, down=down)

    def cursor(self, x: float, y: float) -> bool:
        """Take the place of the mouse: see `InputTaker.cursor`."""
        return self._keeps() or self._taker.cursor(x, y)

    def scroll(self, right: float, up: float) -> bool:
        """Take notches of the wheel: see `InputTaker.scroll`."""
        return self._keeps() or self._taker.scroll(right, up)

    def _keeps(self) -> bool:
        """Whether it is locked; input keeps it unlocked."""
        now = self._clock()
        if now - self._used_at > OPEN:
            return True
        self._used_at = now
        return False

    def _type(self, name: str) -> None:
        """Note a key that was typed; unlock where the last ones are the PIN."""
        self._typed = (self._typed + (name if name.isdecimal() else " "))[-len(self._pin) :]
        if self._typed == self._pin:
            self._typed, self._used_at = "", self._clock()
            self._tell("unlocked: keys and mouse work until they rest for a minute")
