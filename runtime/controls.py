"""What the keys do while a window is open."""

from __future__ import annotations

from collections.abc import Sequence

from devices.stream import SkeletonStream
from replay.player import Player
from runtime.director import Director
from runtime.theatre import Theatre
from runtime.window import Event, KeyPressed, Resized, Window

KEYS = {
    "m": "match again: strike a pose, the best match is shown",
    "enter": "accept the match shown; the pose is the rest state",
    "right": "the next match",
    "left": "the match before",
    "space": "hold or go on (a recording)",
    "home": "back to the start (a recording)",
    "f": "frame every character",
    "h": "show or hide the matched chains",
    "escape": "leave",
}


class Controls:
    """Lets the window's keys and mouse steer the show.

    Attributes:
        leaving: whether it is time to go.
    """

    def __init__(
        self, window: Window, theatre: Theatre, director: Director, stream: SkeletonStream
    ) -> None:
        self.leaving = False
        self._window = window
        self._theatre = theatre
        self._director = director
        self._stream = stream
        window.camera = theatre.camera

    def serve(self) -> None:
        """Do what was asked since the last tick."""
        for event in self._window.poll():
            self._obey(event)
        self._theatre.camera = self._window.camera
        self.leaving = self.leaving or self._window.should_close

    def present(self) -> None:
        """Show the newest picture in the window."""
        self._theatre.stage.show(self._window.framebuffer)
        self._window.swap()

    def _obey(self, event: Event) -> None:
        if isinstance(event, Resized):
            self._theatre.stage.resize(event.size)
        elif isinstance(event, KeyPressed):
            self._press(event.key)

    def _press(self, key: str) -> None:
        if key == "m":
            self._director.match_again()
        elif key == "enter" and self._director.matching:
            self._director.accept()
        elif key == "right":
            self._director.next_match()
        elif key == "left":
            self._director.previous_match()
        elif key == "f":
            self._theatre.frame_all()
            self._window.camera = self._theatre.camera
        elif key == "h":
            self._theatre.highlights = not self._theatre.highlights
        elif key == "escape":
            self.leaving = True
        elif isinstance(self._stream, Player):
            self._press_on_recording(key, self._stream)

    def _press_on_recording(self, key: str, player: Player) -> None:
        if key == "home":
            player.seek(0.0)
        elif key == "space" and player.paused:
            player.resume()
        elif key == "space":
            player.pause()


def key_help() -> Sequence[str]:
    """A line for each key."""
    return [f"{key:<8}{text}" for key, text in KEYS.items()]
