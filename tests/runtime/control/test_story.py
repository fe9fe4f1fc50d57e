"""A whole session through the real window: real keys, a real mouse, a crash and a render."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.cli.command_line import main
from runtime.panel.timeline import Timeline
from runtime.session.document import Session
from runtime.session.files.store import SessionStore
from runtime.session.transport import Mode
from runtime.show.open_stream import play
from runtime.show.settings import ShowSettings
from runtime.show.show import Show
from runtime.status.prompts import advice, headline
from tests.runtime.control.x_input import XInput
from tests.runtime.output.files.test_point_cache import read_pc2

SIZE = (960, 540)


class Puppeteer:
    """Somebody at the window of a show."""

    def __init__(self, show: Show, path: Path) -> None:
        self.show, self.path = show, path
        window = show._opened.display.window
        assert window is not None
        self.hands = XInput(window.handle)
        self.perform(4)

    def perform(self, frames: int) -> None:
        for _ in range(frames):
            self.show.tick()

    def press(self, *keys: str) -> None:
        for key in keys:
            self.hands.key(key)
            self.perform(3)

    def drag(self, *path: tuple[float, float]) -> None:
        self.hands.move(*path[0])
        self.perform(2)
        self.hands.button(True)
        self.perform(2)
        for place in path[1:]:
            self.hands.move(*place)
            self.perform(2)
        self.hands.button(False)
        self.perform(2)

    @property
    def session(self) -> Session:
        assert self.show.controls.session is not None
        return self.show.controls.session.session

    @property
    def mode(self) -> Mode:
        assert self.show.controls.session is not None
        return self.show.controls.session.transport.mode

    @property
    def timeline(self) -> Timeline:
        controls = self.show._opened.window_controls
        assert controls is not None
        return controls._panel._timeline  # type: ignore[union-attr]  # the window has a panel

    @property
    def told(self) -> tuple[str, str]:
        """What the window says: what is seen, and what to do next."""
        status = self.show._opened.status()
        return headline(status), advice(status)


@pytest.fixture
def puppeteer(display: None, tmp_path: Path) -> Iterator[Puppeteer]:
    path = tmp_path / "show.bunraku"
    stream = play(builtin_recording("show"), every_frame=True, loop=True)
    settings = ShowSettings(window=True, size=SIZE)
    try:
        show = Show(stream, [load_character("squid")], settings, session=SessionStore(path))
    except InputError as error:
        pytest.skip(f"no window here: {error}")
    with show:
        try:
            yield Puppeteer(show, path)
        except OSError as error:
            pytest.skip(f"no real keys here: {error}")


def test_three_takes_are_layered_undone_scrubbed_saved_recovered_and_rendered(
    puppeteer: Puppeteer, tmp_path: Path
) -> None:
    one = puppeteer
    assert "Press r to record a take" in one.told[1]
    one.press("r")
    assert one.told == ("Recording", "Perform! Press r again to end the take.")
    one.perform(30)
    one.press("r")
    assert "Space plays the takes" in one.told[1]
    for _ in range(2):
        one.press("r")
        one.perform(15)
        one.press("r")
    assert len(one.session.clips) == 3

    one.press("u")
    assert len(one.session.clips) == 2
    one.press("y")
    assert len(one.session.clips) == 3

    left, top = one.timeline.ruler
    one.drag((left + 20.0, top + 8.0), (left + 40.0, top + 8.0))
    assert one.mode is Mode.PAUSED
    assert one.told[0] == "Paused"
    highest = one.session.clips[-1]
    row = top + (20.0 + 11.0) * SIZE[1] / 720.0
    one.drag((left + 12.0, row), (left + 60.0, row), (left + 120.0, row))
    assert one.session.clip(highest.id).start > 0.5
    one.press("home", "space")
    assert one.mode is Mode.PLAYING
    one.perform(20)
    one.press("space", "f2")
    assert one.path.is_file()

    crashed = tmp_path / "crash"  # what a crash leaves: the file, and the folder beside it
    crashed.mkdir()
    one.press("u")
    for each in tmp_path.glob("show.bunraku*"):
        copy = shutil.copytree if each.is_dir() else shutil.copyfile
        copy(each, crashed / each.name)
    recovered = SessionStore(crashed / "show.bunraku")
    assert recovered.session == one.session
    assert "all its edits are back" in recovered.notes[0]
    recovered.close()
    cache = tmp_path / "a.pc2"
    options = ["--cache", str(cache), "--rate", "30"]
    assert main(["render", str(crashed / "show.bunraku"), *options]) == 0
    assert len(read_pc2(cache)[1]) > 10
