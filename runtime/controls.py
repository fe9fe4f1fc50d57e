"""What the keys do while a window is open."""

from __future__ import annotations

from collections.abc import Sequence

from devices.stream import SkeletonStream
from replay.player import Player
from runtime.conditioning.switches import Conditioning, filled_only
from runtime.ensemble import Cues
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
    "c": "calibrate: the pose is the rest state, floor and sizes are measured anew",
    "x": "mirror, on or off",
    "s": "smoothing, on or off",
    "p": "prediction, on or off",
    "o": "the gate for outliers, on or off",
    "w": "putting swapped limbs right, on or off",
    "i": "steady identities, on or off",
    "l": "levelling the floor, on or off",
    "z": "one size for all performers, on or off",
    "k": "calibrating by a T or A pose that is held, on or off",
    "escape": "leave",
}
SWITCH_OF_KEY = {
    "x": "mirror",
    "s": "filter",
    "p": "predict",
    "o": "outliers",
    "w": "swaps",
    "i": "identities",
    "l": "level",
    "z": "scale",
    "k": "recalibrate",
}


class Controls:
    """Lets the window's keys and mouse steer the show.

    Attributes:
        leaving: whether it is time to go.
    """

    def __init__(
        self,
        window: Window,
        theatre: Theatre,
        director: Cues,
        stream: SkeletonStream,
        conditioning: Conditioning | None = None,
    ) -> None:
        self.leaving = False
        self._window = window
        self._theatre = theatre
        self._director = director
        self._stream = stream
        self._conditioning = conditioning or filled_only()
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
        elif key == "c":
            self._director.calibrate()
        elif key in SWITCH_OF_KEY:
            self._conditioning.switch(SWITCH_OF_KEY[key])
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
