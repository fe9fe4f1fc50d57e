"""A whole session through the real window: real keys, a real mouse, a crash and a render."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.cli.command_line import main
from runtime.driving.by_hand.choosing import Target
from runtime.panel.timeline import Timeline
from runtime.render.context import renderer_name
from runtime.render.picking import on_screen
from runtime.session.document import Session
from runtime.session.files.store import SessionStore
from runtime.session.transport import Mode
from runtime.show.open_stream import play
from runtime.show.settings import ShowSettings
from runtime.show.show import Show
from runtime.status.prompts import advice, headline
from tests.runtime.control.x_input import XInput
from tests.runtime.output.files.test_point_cache import read_pc2
from tests.runtime.render.golden import Picture, assert_like_golden, save_golden

SIZE = (960, 540)


class Clock:
    """The show's time [s], which a test lets go by."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Puppeteer:
    """Somebody at the window of a show."""

    def __init__(self, show: Show, path: Path, clock: Clock) -> None:
        self.show, self.path, self.clock = show, path, clock
        window = show._opened.display.window
        assert window is not None
        self.hands = XInput(window.handle)
        self.hands.move(0.7 * SIZE[0], 0.3 * SIZE[1])  # where nothing is pointed at
        self.perform(4)

    def perform(self, frames: int) -> None:
        for _ in range(frames):
            self.clock.now += 0.1
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

    def click(self, place: tuple[float, float]) -> None:
        self.drag(place)

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
    def seen(self) -> Picture:
        """(H, W, 4) what the window shows, a while after anything was said or moved."""
        self.perform(4)
        opened = self.show._opened
        scene, controls = self.show.controls.scene, opened.window_controls
        assert scene is not None
        assert controls is not None
        self.clock.now += 10.0
        for _ in range(12):  # until the panel has found its size, and its small pictures are new
            self.clock.now += 0.2
            target = scene.stage._context.simple_framebuffer(SIZE, components=4)
            scene.redraw()
            scene.stage.show(target)
            controls._panel.draw(target)  # type: ignore[union-attr]  # the window has a panel
            read = np.frombuffer(target.read(components=4, alignment=1), np.uint8)
            target.release()
        picture = read.reshape(SIZE[1], SIZE[0], 4)[::-1].copy()
        picture[..., 3] = 255
        return picture

    @property
    def told(self) -> tuple[str, str]:
        """What the window says: what is seen, and what to do next."""
        status = self.show._opened.status()
        return headline(status), advice(status)


@pytest.fixture
def puppeteer(display: None, tmp_path: Path) -> Iterator[Puppeteer]:
    path = tmp_path / "show.bunraku"
    stream = play(builtin_recording("show"), every_frame=True, loop=True)
    settings = ShowSettings(window=True, size=SIZE, origin="show.mcap")
    clock, store = Clock(), SessionStore(path)
    try:
        show = Show(stream, [load_character("squid")], settings, session=store, clock=clock)
    except InputError as error:
        pytest.skip(f"no window here: {error}")
    with show:
        try:
            yield Puppeteer(show, path, clock)
        except OSError as error:
            pytest.skip(f"no real keys here: {error}")


@pytest.fixture
def looks(pytestconfig: pytest.Config, tmp_path: Path) -> Callable[[str, Picture], None]:
    """Compares a picture of the window with the golden one, where that was drawn as here."""
    (tmp_path / "story").mkdir()

    def compare(name: str, picture: Picture) -> None:
        if "llvmpipe" not in renderer_name(moderngl.get_context()):
            return
        if pytestconfig.getoption("--regenerate-golden"):
            save_golden(f"story/{name}", picture)
        assert_like_golden(f"story/{name}", picture, tmp_path)

    return compare


def record_three_takes(one: Puppeteer, looks: Callable[[str, Picture], None]) -> None:
    """Match by a pose, take one of the matches, and record three takes over one another."""
    one.press("m", "3")
    assert one.told[0] == "Looking for a match"
    assert "match 3 of" in one.told[1]
    looks("matching", one.seen)
    one.press("enter")
    assert "Press r to record a take" in one.told[1]
    one.press("r")
    assert one.told == ("Recording", "Perform! Press r again to end the take.")
    looks("recording", one.seen)
    one.perform(30)
    one.press("r")
    assert "Space plays the takes" in one.told[1]
    for _ in range(2):
        one.press("r")
        one.perform(15)
        one.press("r")
    assert len(one.session.clips) == 3
    looks("layered", one.seen)


def test_three_takes_are_layered_undone_scrubbed_saved_recovered_and_rendered(
    puppeteer: Puppeteer, looks: Callable[[str, Picture], None], tmp_path: Path
) -> None:
    one = puppeteer
    record_three_takes(one, looks)
    one.press("u")
    assert len(one.session.clips) == 2
    one.press("y")
    assert len(one.session.clips) == 3

    left, top = one.timeline.ruler
    one.drag((left + 20.0, top + 8.0), (left + 40.0, top + 8.0))
    assert one.mode is Mode.PAUSED
    assert one.told[0] == "Paused"
    one.press("f10")
    one.perform(20)
    looks("scrubbed", one.seen)
    one.press("f10")
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


def test_a_pair_is_clicked_in_the_window_and_drives_and_comes_back(puppeteer: Puppeteer) -> None:
    """AniMesh, figure 2: one chain of the performer, one of the character, and both move as one."""
    one = puppeteer
    chooser, scene = one.show.controls.chooser, one.show.controls.scene
    assert scene is not None

    def of_performer(name: str) -> tuple[float, float]:
        parts, joints = chooser._pickable.performer, scene.performer_on_screen
        assert joints is not None
        line = joints[list(parts.chains[parts.named(name)])]
        return tuple(((line[1] + line[2]) / 2.0).tolist())

    def of_squid(name: str) -> tuple[float, float]:
        target = Target(0, chooser._pickable.character(0).named(name))
        points = one.show.puppets[0].places[list(chooser._pickable.nodes(target))]
        places = on_screen(scene.seen_by, SIZE, points + scene.position(0))
        return tuple(places[len(places) // 2].tolist())

    one.press("f6")
    assert one.told[0] == "Mapping by hand"
    one.perform(20)  # until the stage has made room for the card
    one.press("end")
    one.click(of_performer("right arm"))
    assert one.told == (
        "What moves with the right arm?",
        "Click the part of squid that the right arm moves.",
    )
    one.hands.move(*of_squid("tentacle 2"))
    one.perform(2)
    lit = max(scene.lights.chains(0), key=lambda chain: chain.width)  # type: ignore[union-attr]  # while choosing
    assert lit.width > 1.0, "what lies under the mouse lights up"
    one.click(of_squid("tentacle 2"))
    assert "Enter uses this pair." in one.told[1]
    one.press("enter")
    assert not chooser.on
    (match,) = one.show.controls.match_controls.matches
    assert [(part.name, part.target_name[:10]) for part in match.parts] == [
        ("right arm", "tentacle 2")
    ]
    one.perform(10)
    (actor,) = one.session.actors
    if match.rest is not None:
        assert actor.setup is not None
        assert actor.setup.match is not None
        assert actor.setup.match.by_hand

    one.press("f6", "f6")
    one.press("f6", "end", "escape")
    assert not chooser.on
    assert not one.show.controls.leaving
    assert len(match.parts) == 1
