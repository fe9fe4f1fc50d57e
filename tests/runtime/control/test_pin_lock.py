"""The lock of a kiosk's window: keys and mouse reach nothing until the PIN is typed."""

from __future__ import annotations

from dataclasses import dataclass, field

import glfw
import pytest

from devices.errors import InputError
from runtime.control.pin_lock import OPEN, PinLock
from runtime.control.window import KeyPressed, Window
from runtime.show.settings import KioskSettings


@dataclass
class NothingKept:
    """Lets all input through to the window, and counts it."""

    count: int = 0

    def key(self, name: str, *, down: bool, shift: bool, control: bool) -> bool:
        return self._pass()

    def letter(self, character: str) -> bool:
        return self._pass()

    def button(self, button: int, *, down: bool) -> bool:
        return self._pass()

    def cursor(self, x: float, y: float) -> bool:
        return self._pass()

    def scroll(self, right: float, up: float) -> bool:
        return self._pass()

    def _pass(self) -> bool:
        self.count += 1
        return False


@dataclass
class Locked:
    """A lock with the PIN 1213, a clock that is set by hand, and what it hands on and tells."""

    now: float = 0.0
    said: list[str] = field(default_factory=list)
    inner: NothingKept = field(default_factory=NothingKept)

    def __post_init__(self) -> None:
        self.lock = PinLock(self.inner, "1213", clock=lambda: self.now, tell=self.said.append)

    def type(self, *names: str) -> list[bool]:
        kept = []
        for name in names:
            kept += [
                self.lock.key(name, down=down, shift=False, control=False) for down in (True, False)
            ]
        return kept


def test_nothing_gets_through_before_the_pin() -> None:
    locked = Locked()
    assert all(locked.type("1", "2", "1", "a", "3", "escape"))
    assert locked.lock.button(0, down=True)
    assert locked.lock.cursor(1.0, 2.0)
    assert locked.lock.scroll(0.0, 1.0)
    assert locked.lock.letter("?")
    assert locked.inner.count == 0
    assert locked.said == []


def test_the_pin_unlocks_until_input_rests_for_a_minute() -> None:
    locked = Locked()
    locked.type("1", "1", "2", "1", "3")  # a wrong digit first
    assert len(locked.said) == 1
    assert not any(locked.type("m"))
    for _ in range(3):
        locked.now += 0.9 * OPEN
        assert not locked.lock.scroll(0.0, 1.0)
    locked.now += 1.1 * OPEN
    assert all(locked.type("m"))
    locked.type("1", "2", "1", "3")
    assert not any(locked.type("escape"))


def test_a_window_hears_no_key_behind_the_lock(display: None) -> None:
    try:
        window = Window("Bunraku", (320, 180))
    except InputError as error:
        pytest.skip(f"no window here: {error}")
    with window:
        window.poll()
        window.taker = PinLock(NothingKept(), "7", clock=lambda: 0.0, tell=lambda _: None)
        window.on_key(None, glfw.KEY_ESCAPE, 0, glfw.PRESS, 0)
        assert window.poll() == []
        window.on_key(None, glfw.KEY_KP_7, 0, glfw.PRESS, 0)
        window.on_key(None, glfw.KEY_ESCAPE, 0, glfw.PRESS, 0)
        assert window.poll() == [KeyPressed("escape")]


@pytest.mark.parametrize("pin", ["abc", "1" * 13, 12, "٣"])
def test_a_pin_has_digits(pin: str) -> None:
    with pytest.raises(InputError, match=r"KioskSettings\.pin.*digits"):
        KioskSettings(5.0, pin)
