"""The timeline of a session: bars are dragged, cut and selected, and the ruler goes to a moment."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import pytest

from replay.player import EveryFrame, Player
from runtime.control.actions import press
from runtime.panel.panel import Panel
from runtime.panel.timeline import Timeline
from runtime.session import edits
from runtime.session.files.store import SessionStore
from runtime.session.live_session import LiveSession
from runtime.session.transport import Mode
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show
from tests.runtime.stick_figures import make_figure, record, waving

SIZE = (1280, 720)


class Seat:
    """A show with a session, the panel over a grey picture, and a mouse.

    Attributes:
        x: where on the screen seconds are: found by scrubbing.
    """

    def __init__(self, context: moderngl.Context, folder: Path) -> None:
        stream = Player(record(waving(60)), EveryFrame(), loop=True)
        settings = ShowSettings(size=(64, 36), match=MatchSettings(rehearse=False, patience=0.0))
        store = SessionStore(folder / "s.bunraku")
        self.show = Show(stream, [make_figure()], settings, context=context, session=store)
        self.now = 0.0
        self.target = context.simple_framebuffer(SIZE, components=4)
        controls, status = self.show.controls, self.show._opened.status
        self.panel = Panel(context, controls, status, clock=lambda: self.now)
        assert controls.session is not None
        self.session: LiveSession = controls.session

    def perform(self, frames: int) -> None:
        for _ in range(frames):
            self.show.tick()

    def take(self, frames: int) -> None:
        press("record", self.show.controls)
        self.perform(frames)
        press("record", self.show.controls)

    def draw(self) -> None:
        self.now += 0.2
        self.panel.draw(self.target)

    def drag(self, *path: tuple[float, float]) -> None:
        """Press at the first place, move along the others, and let go at the last."""
        gui = self.panel.gui
        gui.cursor(*path[0])
        self.draw()
        gui.button(0, down=True)
        self.draw()
        for place in path[1:]:
            gui.cursor(*place)
            self.draw()
        gui.button(0, down=False)
        self.draw()

    @property
    def timeline(self) -> Timeline:
        return self.panel._timeline

    def row_of(self, clip: int) -> float:
        """The height [px] of a clip's bar on the screen."""
        place = [each.id for each in reversed(self.session.session.clips)].index(clip)
        return self.timeline.ruler[1] + 20.0 + 22.0 * (place + 0.5)

    def x(self, time: float) -> float:
        """Where a second is on the screen [px], measured by a scrub on the ruler."""
        left, y = self.timeline.ruler
        position, mode = self.session.transport.position, self.session.transport.mode
        self.drag((900.0, y + 8.0))
        seen = self.session.transport.position
        self.session.transport.go_to(position)
        self.session.transport.mode = mode
        return left + (900.0 - left) * time / seen

    def close(self) -> None:
        self.panel.close()
        self.target.release()
        self.show.close()


@pytest.fixture
def seat(context: moderngl.Context, tmp_path: Path) -> Iterator[Seat]:
    seat = Seat(context, tmp_path)
    seat.perform(4)
    seat.take(60)
    seat.take(40)
    seat.draw()
    seat.draw()
    yield seat
    seat.close()


def test_the_ruler_scrubs(seat: Seat) -> None:
    y = seat.timeline.ruler[1] + 8.0
    seat.drag((300.0, y), (500.0, y), (700.0, y))
    assert seat.session.transport.mode is Mode.PAUSED
    assert seat.session.transport.position > 2.0
    seat.drag((700.0, y), (20.0, y))
    assert seat.session.transport.position == 0.0


def test_a_bar_is_moved_in_one_step(seat: Seat) -> None:
    y, start = seat.row_of(2), seat.x(0.2)
    seat.drag((start, y), (start + 40, y), (start + 90, y), (seat.x(1.2), y))
    assert seat.session.session.clip(2).start == pytest.approx(1.0, abs=0.03)
    assert seat.timeline.selected == 2
    press("undo", seat.show.controls)
    assert seat.session.session.clip(2).start == 0.0


def test_the_end_of_a_bar_is_dragged(seat: Seat) -> None:
    clip = seat.session.session.clip(1)
    y, end = seat.row_of(1), seat.x(clip.end)
    seat.drag((end - 2.0, y), (end - 20.0, y), (seat.x(0.5) - 2.0, y))
    assert seat.session.session.clip(1).end == pytest.approx(0.5, abs=0.03)
    assert seat.session.session.clip(1).start == clip.start


def test_buttons_of_the_selected_clip_edit_it(seat: Seat) -> None:
    """A row of clicks along the buttons above the ruler: each of them does its edit."""
    seat.drag((seat.x(0.1), seat.row_of(1)), (seat.x(0.1), seat.row_of(1)))
    assert seat.timeline.selected == 1
    y, seen = seat.timeline.ruler[1] - 22.0, set()
    before = seat.session.session
    for x in range(500, 1200, 24):
        seat.timeline.selected = 1
        seat.session.transport.go_to(0.3)
        seat.draw()
        seat.drag((float(x), y), (float(x), y))
        after = seat.session.session
        seen |= {
            name
            for name, done in {
                "mute": after.clips and after.clips[0].muted,
                "solo": after.clips and after.clips[0].solo,
                "additive": after.clips and after.clips[0].additive,
                "weight": after.clips and after.clips[0].weight < 1.0,
                "more": len(after.clips) > 2,
                "fewer": len(after.clips) < 2,
            }.items()
            if done
        }
        seat.session.stop()
        seat.session.edit(before, "back")
        seat.session.transport.rehearse()
    assert seen == {"mute", "solo", "additive", "weight", "more", "fewer"}


def test_more_layers_than_rows_are_reached_by_the_wheel(seat: Seat) -> None:
    session = seat.session.session
    for number in range(8):
        session = edits.copied(session, 1, 1.0 + number)
    seat.session.edit(session, "copies")
    seat.draw()
    seat.panel.gui.cursor(640.0, seat.timeline.ruler[1] + 40.0)
    seat.draw()
    for _ in range(8):
        seat.panel.gui.scroll(0.0, -1.0)
        seat.draw()
    assert seat.timeline._first == len(session.clips) - 5


def test_the_timeline_lies_low_and_leaves_the_stage_free(seat: Seat) -> None:
    seat.draw()
    left, top = seat.timeline.ruler
    assert top > 500.0
    assert left > 100.0
