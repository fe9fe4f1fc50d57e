"""The action of each key, and the window's keys and mouse at work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from runtime.control.action import Kind
from runtime.control.actions import ACTIONS, press
from runtime.control.show_controls import ShowControls
from runtime.control.window import Clicked, Event, Pointed, Resized, Window
from runtime.render.stage import Stage
from runtime.show.scene import Scene

if TYPE_CHECKING:
    import moderngl

KEYS = {
    "m": "match-again",
    "enter": "accept",
    "right": "next-match",
    "left": "previous-match",
    "1": "match-1",
    "2": "match-2",
    "3": "match-3",
    "4": "match-4",
    "space": "hold",
    "home": "home",
    "f": "frame-all",
    "h": "chains",
    "c": "calibrate",
    "x": "mirror",
    "s": "filter",
    "p": "predict",
    "o": "outliers",
    "w": "swaps",
    "i": "identities",
    "l": "level",
    "z": "scale",
    "k": "recalibrate",
    "j": "order",
    "t": "rest-pose",
    "r": "record",
    "e": "freeze",
    "g": "in-place",
    "b": "blackout",
    "up": "cartoon-up",
    "down": "cartoon-down",
    "page-up": "volume-up",
    "page-down": "volume-down",
    ".": "stiffness-up",
    ",": "stiffness-down",
    "n": "select",
    "backspace": "keep-match",
    "v": "front",
    "tab": "panel",
    "d": "sliders",
    "?": "help",
    "f11": "full-screen",
    "f9": "audience",
    "u": "undo",
    "y": "redo",
    "a": "rehearse",
    "q": "recall",
    "delete": "retake",
    "f2": "save",
    "f3": "loop",
    "f4": "half-speed",
    "f10": "onion-skin",
    "f5": "next-count-in",
    "f6": "map-by-hand",
    "f7": "widest-view",
    "f8": "together",
    "end": "clear-pairs",
    "-": "phase-down",
    "=": "phase-up",
    "escape": "leave",
}
"""The action of each key."""


_HINTED = {
    "match-again": "match again",
    "next-match": "step through matches",
    "hold": "pause",
    "record": "record a take",
    "frame-all": "frame everybody",
    "leave": "leave",
}


def key_hint() -> str:
    """One line on the most useful keys, for somebody who has just opened the window."""
    key_of = {name: key for key, name in KEYS.items()}
    return "keys: " + ", ".join(f"{key_of[name]} to {words}" for name, words in _HINTED.items())


class Overlay(Protocol):
    """What is drawn over the picture in the window."""

    def draw(self, target: moderngl.Framebuffer) -> None:
        """Draw it over a framebuffer of the window's size."""
        ...


class SecondWindow(Protocol):
    """A window that shows the picture to others."""

    on: bool

    @property
    def should_close(self) -> bool:
        """Whether its user asked to close it."""
        ...

    def show(self, stage: Stage) -> None:
        """Show a stage's picture."""
        ...


class WindowControls:
    """Runs the show by the window's keys and mouse.

    Args:
        window: the window that is open.
        scene: the picture in it; the mouse moves its camera.
        controls: what the actions of the keys change.
        panel: is drawn over the picture, and takes input first; None without one.
        audience: the second window; None where there can be none.
    """

    def __init__(
        self,
        window: Window,
        scene: Scene,
        controls: ShowControls,
        panel: Overlay | None = None,
        audience: SecondWindow | None = None,
    ) -> None:
        self._window = window
        self._scene = scene
        self._controls = controls
        self._panel = panel
        self._audience = audience
        self._camera = window.camera = scene.camera

    def serve(self) -> None:
        """Handle all events since the last tick."""
        events = self._window.poll()
        if self._scene.camera is self._camera:
            self._scene.camera = self._window.camera
        for event in events:
            self._handle(event)
        self._controls.chooser.look()
        self._camera = self._window.camera = self._scene.camera
        self._controls.leaving = self._controls.leaving or self._window.should_close
        if self._window.full_screen is not self._controls.view.full_screen:
            self._window.full_screen = self._controls.view.full_screen
            self._controls.view.full_screen = self._window.full_screen  # there may be no screen
        self._serve_audience()

    def present(self) -> None:
        """Show the newest picture in the window."""
        self._scene.stage.show(self._window.framebuffer)
        if self._panel is not None:
            self._panel.draw(self._window.framebuffer)
        if self._audience is not None and self._audience.on:
            self._scene.draw_for_audience()
            self._audience.show(self._scene.stage)
        self._window.swap()

    def _serve_audience(self) -> None:
        """Open and close the audience's window as the view says, or as its user asks."""
        view = self._controls.view
        if self._audience is None:
            return
        if self._audience.should_close:
            view.audience = False
        if self._audience.on is not view.audience:
            self._audience.on = view.audience
            view.audience = self._audience.on

    def _handle(self, event: Event) -> None:
        if isinstance(event, Resized):
            self._scene.stage.resize(event.size)
        elif isinstance(event, Pointed):
            self._controls.chooser.point(event.at)
        elif isinstance(event, Clicked):
            self._controls.chooser.click(event.at)
        elif event.key in KEYS:
            name = KEYS[event.key]
            if not (event.again and ACTIONS[name].kind is Kind.SWITCH):  # by a key held down
                press(name, self._controls)
