"""The window: what it shows, and what keys and mouse do to it."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import glfw
import moderngl
import numpy as np
import pytest

from devices.errors import InputError
from runtime.control.window import Clicked, KeyPressed, Pointed, Resized, Window
from runtime.render.camera import front_camera
from runtime.render.context import headless_context, release_headless
from runtime.render.stage import Stage
from tests.waiting import PATIENCE


@pytest.fixture
def window(display: None) -> object:
    try:
        window = Window("Bunraku", (320, 180))
    except InputError as error:
        pytest.skip(f"no window here: {error}")
    yield window
    window.close()


def test_the_window_shows_the_picture_that_is_read(window: Window) -> None:
    stage = Stage(window.context, window.size)
    stage.draw(window.camera)
    stage.show(window.framebuffer)
    copy = window.context.simple_framebuffer(window.size, components=4)
    window.context.copy_framebuffer(copy, window.framebuffer)
    width, height = window.size
    shown = np.frombuffer(copy.read(components=3, alignment=1), np.uint8)
    np.testing.assert_array_equal(shown.reshape(height, width, 3)[::-1], stage.read()[..., :3])
    window.swap()
    assert window.context.error == "GL_NO_ERROR"
    stage.release()


def test_keys_and_resizing_become_events(window: Window) -> None:
    window.poll()
    window.on_key(None, glfw.KEY_SPACE, 0, glfw.PRESS, glfw.MOD_SHIFT)
    window.on_key(None, glfw.KEY_SPACE, 0, glfw.RELEASE, 0)
    window._on_resize(None, 200, 100)
    assert window.poll() == [
        KeyPressed("space", shift=True),
        Resized((200, 100)),
    ]
    assert window.poll() == []


def test_the_mouse_orbits_pans_and_zooms(window: Window) -> None:
    window.poll()
    window._cursor = (100.0, 100.0)
    start = window.camera
    window._on_cursor(None, 120.0, 100.0)
    assert window.camera == start  # no button is held
    window._on_button(None, glfw.MOUSE_BUTTON_LEFT, glfw.PRESS, 0)
    window._on_cursor(None, 140.0, 100.0)
    assert window.camera.target == start.target
    assert window.camera.eye[0] < start.eye[0]  # the stage turns with the hand
    window._on_button(None, glfw.MOUSE_BUTTON_LEFT, glfw.RELEASE, 0)
    window._on_button(None, glfw.MOUSE_BUTTON_RIGHT, glfw.PRESS, 0)
    turned = window.camera
    window._on_cursor(None, 150.0, 100.0)
    assert window.camera.target != turned.target
    window._on_button(None, glfw.MOUSE_BUTTON_RIGHT, glfw.RELEASE, 0)
    window._on_scroll(None, 0.0, 1.0)
    assert window.camera.distance < turned.distance


def test_a_press_and_release_at_one_place_is_a_click_and_a_drag_is_none(window: Window) -> None:
    window.poll()
    left = glfw.MOUSE_BUTTON_LEFT
    window._on_cursor(None, 50.0, 40.0)
    for moved, button in ((2.0, left), (30.0, left), (0.0, glfw.MOUSE_BUTTON_RIGHT)):
        window._on_button(None, button, glfw.PRESS, 0)
        if moved:
            window._on_cursor(None, 50.0 + moved, 40.0)
        window._on_button(None, button, glfw.RELEASE, 0)
        window._on_cursor(None, 50.0, 40.0)
    pointed = Pointed((50.0, 40.0))
    there = [Pointed((52.0, 40.0)), Clicked((50.0, 40.0)), pointed]
    assert window.poll() == [pointed, *there, Pointed((80.0, 40.0)), pointed, pointed]


def test_what_the_panel_takes_is_no_click(window: Window) -> None:
    class Panel:
        def cursor(self, x: float, y: float) -> bool:
            return False

        def button(self, button: int, *, down: bool) -> bool:
            return True

    window.poll()
    window.taker = Panel()  # type: ignore[assignment]  # takes the mouse only
    window._on_cursor(None, 50.0, 40.0)
    window._on_button(None, glfw.MOUSE_BUTTON_LEFT, glfw.PRESS, 0)
    window._on_button(None, glfw.MOUSE_BUTTON_LEFT, glfw.RELEASE, 0)
    assert window.poll() == [Pointed((50.0, 40.0))]


def test_without_a_display_one_line_says_to_go_headless() -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("only Linux can be without a display")
    code = """
        from devices.errors import InputError
        from runtime.control.window import Window
        try:
            Window("Bunraku", (64, 64))
        except InputError as error:
            print(error)
    """
    hidden = ("DISPLAY", "WAYLAND_DISPLAY")
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        cwd=root,
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
    )
    assert done.stderr == ""
    assert done.stdout.startswith("could not open a window (")
    assert done.stdout.endswith("add --headless to go without one\n")


def test_a_window_and_a_file_get_the_same_picture(window: Window) -> None:
    shown = _picture(window.context)
    headless = headless_context()
    written = _picture(headless)
    release_headless(headless)
    glfw.make_context_current(window.handle)
    assert np.abs(shown - written).mean() < 1.0


def _picture(context: moderngl.Context) -> np.ndarray:
    stage = Stage(context, (160, 90))
    stage.draw(front_camera())
    picture = stage.read().astype(int)
    stage.release()
    return picture
