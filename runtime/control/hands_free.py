"""Hands-free: the next step of the flow is done when a performer makes a gesture."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from runtime.control.gestures import Gestures
from runtime.control.show_controls import ShowControls
from runtime.control.take_actions import is_matching, is_recording
from runtime.session.transport import Mode
from runtime.show.act_group import Act

STEPS = {
    "accept": "to use this match",
    "record": "to begin a take",
    "end": "to end the take",
    "play": "to see the take",
    "rehearse": "to perform again",
}


class HandsFree:
    """Presses for a performer what is to be done next, whenever a gesture is complete.

    Args:
        kind: of the gestures, see `Gestures`.
        acts: whose performers are watched.
        controls: the parts of the show that actions change.
        press: presses an action by its name.
    """

    def __init__(
        self,
        kind: str,
        acts: Sequence[Act],
        controls: ShowControls,
        press: Callable[[str, ShowControls], None],
    ) -> None:
        self._acts, self._controls, self._press = acts, controls, press
        self._gestures = [Gestures(act.performer.skeleton, kind) for act in acts]
        self._kept = self._clips  # the clips when a take had been seen, or undone

    def follow(self) -> None:
        """Go on to the newest poses; press what is next where a gesture is complete."""
        done = [
            gesture.follow(act.pose)
            for act, gesture in zip(self._acts, self._gestures, strict=True)
            if act.pose is not None
        ]
        if not any(done) or self._controls.count_in.counted is not None:
            return
        step = self.step
        if step in ("play", "accept"):
            self._kept = self._clips
        self._press("record" if step == "end" else step, self._controls)

    @property
    def step(self) -> str:
        """What a gesture does next: an action, or "end" for the end of a take."""
        controls, session = self._controls, self._controls.session
        if is_recording(controls):
            return "end"
        if is_matching(controls):
            return "accept"
        if session is not None and session.transport.mode in (Mode.PLAYING, Mode.PAUSED):
            return "rehearse"
        return "play" if self._clips > self._kept else "record"

    @property
    def wanted(self) -> str:
        """What to do for which step, in words; empty where nothing can be asked for now."""
        if self._controls.count_in.counted is not None:
            return ""
        words = next((gesture.wanted for gesture in self._gestures if gesture.wanted), "")
        return f"{words} {STEPS[self.step]}" if words else ""

    @property
    def progress(self) -> float:
        """How much of a gesture is done, in [0, 1]."""
        if self._controls.count_in.counted is not None:
            return 0.0
        return max(gesture.progress for gesture in self._gestures)

    @property
    def _clips(self) -> int:
        session = self._controls.session
        return 0 if session is None else len(session.session.clips)
