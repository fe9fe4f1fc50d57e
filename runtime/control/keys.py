"""What the keys do while a window is open."""

from __future__ import annotations

from runtime.control.actions import ACTIONS, ShowControls
from runtime.control.window import Event, KeyPressed, Resized, Window
from runtime.show.scene import Scene

KEYS = {
    "m": "match-again",
    "enter": "accept",
    "right": "next-match",
    "left": "previous-match",
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
    "b": "blackout",
    "up": "cartoon-up",
    "down": "cartoon-down",
    "page-up": "volume-up",
    "page-down": "volume-down",
    ".": "stiffness-up",
    ",": "stiffness-down",
    "escape": "leave",
}
"""The action of each key."""


class Controls:
    """Lets the window's keys and mouse steer the show.

    Args:
        window: whose keys and mouse.
        theatre: what is seen in it.
        desk: what the keys' actions act upon.
    """

    def __init__(self, window: Window, scene: Scene, desk: ShowControls) -> None:
        self._window = window
        self._scene = scene
        self._desk = desk
        self._camera = window.camera = scene.camera

    def serve(self) -> None:
        """Do what was asked since the last tick."""
        events = self._window.poll()
        if self._scene.camera is self._camera:
            self._scene.camera = self._window.camera
        for event in events:
            self._obey(event)
        self._camera = self._window.camera = self._scene.camera
        self._desk.leaving = self._desk.leaving or self._window.should_close

    def present(self) -> None:
        """Show the newest picture in the window."""
        self._scene.stage.show(self._window.framebuffer)
        self._window.swap()

    def _obey(self, event: Event) -> None:
        if isinstance(event, Resized):
            self._scene.stage.resize(event.size)
        elif isinstance(event, KeyPressed) and event.key in KEYS:
            action = ACTIONS[KEYS[event.key]]
            is_switch = action.write is not None  # not turned over and over by a key held down
            if action.press is not None and not (event.again and is_switch):
                action.press(self._desk)
