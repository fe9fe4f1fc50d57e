"""The audience's window shows the show alone, while the operator keeps chains and mirror."""

from __future__ import annotations

import glfw
import numpy as np
import pytest

from devices.errors import InputError
from replay.player import EveryFrame, Player
from runtime.control.actions import press
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show
from tests.runtime.stick_figures import make_figure, record, waving

SIZE = (320, 180)


@pytest.fixture
def show(display: None) -> object:
    settings = ShowSettings(window=True, size=SIZE, match=MatchSettings())
    try:
        show = Show(Player(record(waving(60)), EveryFrame()), [make_figure()], settings)
    except InputError as error:
        pytest.skip(f"no window here: {error}")
    yield show
    show.close()


def test_the_audience_sees_neither_panel_nor_chains_nor_mirror(show: Show) -> None:
    shown = show._opened.window_controls
    audience, window = shown._audience, shown._window
    show.tick()
    press("audience", show.controls)
    show.tick()
    assert audience.on
    assert show.controls.view.audience
    show.tick()
    seen = np.frombuffer(audience._picture.image.read(), np.uint8).reshape(180, 320, 4)[::-1]
    scene = show.controls.scene
    plain = scene.picture()
    scene.redraw()
    operators = scene.picture()
    np.testing.assert_array_equal(seen[..., :3], plain[..., :3])
    assert (operators[:60, :60] != plain[:60, :60]).any(), "the mirror is the operator's"
    glfw.make_context_current(audience._handle)
    screen = audience._screen._context
    copy = screen.simple_framebuffer(SIZE, components=4)
    audience._screen.show(audience._picture, SIZE)
    screen.copy_framebuffer(copy, screen.screen)
    drawn = np.frombuffer(copy.read(components=3, alignment=1), np.uint8).reshape(180, 320, 3)
    window.make_current()
    np.testing.assert_allclose(drawn[::-1], seen[..., :3], atol=1)
    press("audience", show.controls)
    show.tick()
    show.tick()
    assert not audience.on
    assert window.context.error == "GL_NO_ERROR"
