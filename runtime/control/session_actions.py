"""The actions on an open session: takes, undo, and the speed of its time."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from runtime.control.action import Action, Do, switch
from runtime.control.show_controls import ShowControls
from runtime.control.take_actions import is_recording, record
from runtime.session.live_session import LiveSession

NO_SESSION = "no session is open: start with `bunraku session FILE`"


def _with_session(do: Callable[[LiveSession], None]) -> Do:
    """What a press does to the session that is open; it says so where none is."""

    def press(controls: ShowControls) -> None:
        if controls.session is None:
            controls.notices.show(NO_SESSION)
        else:
            do(controls.session)

    return press


def _rehearse(controls: ShowControls) -> None:
    session = controls.session
    if session is None:
        controls.notices.show(NO_SESSION)
    elif is_recording(controls):
        record(controls, False)
    else:
        session.transport.rehearse()


def _retake(controls: ShowControls) -> None:
    session = controls.session
    if session is None:
        controls.notices.show(NO_SESSION)
    elif not is_recording(controls):
        session.drop_last()
        record(controls, True)


def _half_speed(controls: ShowControls, on: bool) -> None:
    if controls.session is None:
        controls.notices.show(NO_SESSION)
    elif controls.session.recording:
        controls.notices.show("the speed stays as it is until the take has ended")
    else:
        controls.session.transport.speed = 0.5 if on else 1.0


def _onion_skin(controls: ShowControls, on: bool) -> None:
    if controls.session is None:
        controls.notices.show(NO_SESSION)
    elif controls.scene is not None:
        controls.scene.ghosts = controls.session.ghosts if on else None


def _loop(controls: ShowControls, on: bool) -> None:
    if controls.playback is not None:
        controls.playback.loop = on


SESSION_ACTIONS: Mapping[str, Action] = {
    "rehearse": Action(
        "Rehearse",
        "let the performer move the characters (in a session)",
        press=_rehearse,
        words=lambda _: "the performer moves the characters again",
    ),
    "retake": Action(
        "Retake", "remove the newest take and record it again (in a session)", press=_retake
    ),
    "recall": Action(
        "Keep last",
        "make a take of the last 30 seconds (in a session)",
        press=_with_session(lambda session: session.recall()),
    ),
    "undo": Action(
        "Undo", "undo the last edit (in a session)", press=_with_session(lambda s: s.undo())
    ),
    "redo": Action(
        "Redo",
        "redo the last edit that was undone (in a session)",
        press=_with_session(lambda s: s.redo()),
    ),
    "save": Action(
        "Save", "write the session to its file", press=_with_session(lambda s: s.save())
    ),
    "half-speed": switch(
        "Half speed",
        "run the session's time at half speed, also while a take is recorded",
        lambda controls: controls.session is not None and controls.session.transport.speed < 1.0,
        _half_speed,
    ),
    "onion-skin": switch(
        "Onion skin",
        "in a pause, show the moments just before and after (in a session)",
        lambda controls: controls.scene is not None and controls.scene.ghosts is not None,
        _onion_skin,
        done=("in a pause, the moments before are blue, those after orange", "no onion skin"),
    ),
    "loop": switch(
        "Loop",
        "start again at the end, or stop there",
        lambda controls: controls.playback is not None and controls.playback.loop,
        _loop,
    ),
}
"""The rows of the table of actions that are for sessions."""
