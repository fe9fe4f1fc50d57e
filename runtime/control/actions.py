"""The table of everything a puppeteer can do while a show runs.

Keys (`runtime.control.keys`), the OSC remote (`runtime.control.remote`), the documentation and the
tests read the names, texts and ranges of this table and have none of their own.
"""

from __future__ import annotations

from collections.abc import Mapping

from runtime.conditioning.switches import STEPS, SWITCHES
from runtime.control.action import Action, Kind, switch
from runtime.control.by_hand.choosing_actions import CHOOSING_ACTIONS
from runtime.control.match_actions import MATCH_ACTIONS
from runtime.control.session_actions import SESSION_ACTIONS
from runtime.control.show_controls import ShowControls
from runtime.control.sliders import SLIDERS, STEP, Slider
from runtime.control.take_actions import (
    ACCEPT,
    TAKE_ACTIONS,
    end_count_in,
    is_matching,
    leave,
    record,
)


def _slider_actions(name: str, slider: Slider) -> dict[str, Action]:
    """Build a slider's fader and the two actions that move it by a step."""
    return {
        name: Action(slider.label, slider.text, write=slider.write, read=slider.read),
        f"{name}-up": Action(
            f"{slider.label} +",
            slider.more,
            press=lambda controls: slider.move(controls, STEP),
            words=slider.words,
        ),
        f"{name}-down": Action(
            f"{slider.label} -",
            slider.less,
            press=lambda controls: slider.move(controls, -STEP),
            words=slider.words,
        ),
    }


def _conditioning(name: str, label: str, text: str) -> Action:
    """Build the action of one switch of the conditioning."""

    def write(controls: ShowControls, on: bool) -> None:
        if on is not getattr(controls.conditioning, name):
            controls.conditioning.switch(name, on)
            for puppet in controls.puppets:
                puppet.ease()

    return switch(label, text, lambda controls: bool(getattr(controls.conditioning, name)), write)


def _is_paused(controls: ShowControls) -> bool:
    return controls.playback is not None and controls.playback.paused


def _pause(controls: ShowControls, on: bool) -> None:
    if controls.playback is None:
        controls.notices.show("a live performer cannot be paused: e freezes the characters")
        return
    if controls.session is not None:
        end_count_in(controls)
    if controls.session is not None and controls.session.recording:
        record(controls, False)
    elif on:
        controls.playback.pause()
    else:
        controls.playback.resume()


def _home(controls: ShowControls) -> None:
    if controls.playback is None:
        controls.notices.show("a live performer has no start to go back to")
    else:
        controls.playback.seek(0.0)


def _freeze(controls: ShowControls, on: bool) -> None:
    controls.loop.frozen = on


def _in_place(controls: ShowControls, on: bool) -> None:
    for puppet in controls.selected:
        puppet.travel.in_place = on


def _blackout(controls: ShowControls, on: bool) -> None:
    if controls.scene is not None:
        controls.scene.blackout.to(float(on))


def _chains(controls: ShowControls, on: bool) -> None:
    if controls.scene is not None:
        controls.scene.highlights = on


def _frame_all(controls: ShowControls) -> None:
    if controls.scene is not None:
        controls.scene.frame_all()


def _panel(controls: ShowControls, on: bool) -> None:
    controls.view.panel = on


def _sliders(controls: ShowControls, on: bool) -> None:
    controls.view.sliders = on


def _help(controls: ShowControls, on: bool) -> None:
    controls.view.help = on


def _full_screen(controls: ShowControls, on: bool) -> None:
    controls.view.full_screen = on


def _audience(controls: ShowControls, on: bool) -> None:
    controls.view.audience = on


def _keep(controls: ShowControls) -> None:
    if controls.chooser.on:
        controls.chooser.leave()
    controls.match_controls.keep()


def _front(controls: ShowControls) -> None:
    if controls.scene is not None:
        controls.scene.view_from_front()


def _select(controls: ShowControls) -> None:
    """Select the next character; after the last one all of them."""
    count, before = len(controls.puppets), controls.match_controls.selected
    after = 0 if before is None else before + 1
    controls.select(after if after < count else None)
    which = "all characters" if after >= count else controls.puppets[after].character.name
    controls.notices.show(f"keys are for {which}")


ACTIONS: Mapping[str, Action] = {
    "match-again": Action(
        "Match again",
        "look for a match: strike a pose, and the best one lights up",
        press=lambda controls: controls.match_controls.match_again(),
        read=lambda controls: float(is_matching(controls)),
        words=lambda _: "looking for a match: strike a pose",
    ),
    "accept": ACCEPT,
    "next-match": Action(
        "Next match",
        "light up the next match",
        press=lambda controls: controls.match_controls.next_match(),
    ),
    "previous-match": Action(
        "Previous match",
        "light up the previous match",
        press=lambda controls: controls.match_controls.previous_match(),
    ),
    "rest-pose": Action(
        "Rest pose",
        "take your present pose for the character's rest pose",
        press=lambda controls: controls.match_controls.take_rest(),
        words=lambda _: "this pose now stands for the character's rest pose",
    ),
    "calibrate": Action(
        "Calibrate",
        "take the rest pose, and measure floor and sizes",
        press=lambda controls: controls.match_controls.calibrate(),
        words=lambda _: "calibrated: this is the rest pose, floor and sizes are measured anew",
    ),
    "hold": switch(
        "Play / pause",
        "pause or play a recording",
        _is_paused,
        _pause,
        done=("paused", "playing"),
    ),
    "play": Action(
        "Play",
        "play a recording",
        press=lambda controls: _pause(controls, False),
        read=lambda controls: float(not _is_paused(controls)),
        words=lambda _: "playing",
    ),
    "pause": Action(
        "Pause",
        "pause a recording",
        press=lambda controls: _pause(controls, True),
        read=lambda controls: float(_is_paused(controls)),
        words=lambda controls: "paused" if _is_paused(controls) else "",
    ),
    "home": Action(
        "To the start",
        "go back to the start of a recording",
        press=_home,
        words=lambda _: "back at the start",
    ),
    **TAKE_ACTIONS,
    "freeze": switch(
        "Freeze",
        "freeze the characters, or let them move",
        lambda controls: controls.loop.frozen,
        _freeze,
        done=("the characters stand still", "the characters move again"),
    ),
    "in-place": switch(
        "Stay in place",
        "keep characters where they are, or let them travel as their performers do",
        lambda controls: controls.selected[0].travel.in_place,
        _in_place,
        done=("characters stay where they are", "characters travel as their performers do"),
    ),
    "blackout": switch(
        "Blackout",
        "fade to black, and back",
        lambda controls: controls.scene is not None and controls.scene.blackout.target > 0.0,
        _blackout,
        done=("the stage fades to black", "the light comes back"),
    ),
    "select": Action("Next character", "select the next character, or all", press=_select),
    "keep-match": Action(
        "Go on as before",
        "stop looking for a match",
        press=_keep,
        words=lambda _: "going on as before",
    ),
    "front": Action(
        "Front",
        "look from the front",
        press=_front,
        words=lambda _: "seen from the front",
    ),
    "frame-all": Action(
        "Frame all",
        "bring every character into the picture",
        press=_frame_all,
        words=lambda _: "every character is in the picture",
    ),
    "chains": switch(
        "Show chains",
        "light up the matched chains, or hide them",
        lambda controls: controls.scene is not None and controls.scene.highlights,
        _chains,
        done=("the matched chains light up", "the matched chains are hidden"),
    ),
    "panel": switch(
        "Panel",
        "hide the panel, or show it again",
        lambda controls: controls.view.panel,
        _panel,
        done=("", "the panel is hidden: Tab shows it again"),
    ),
    "sliders": switch(
        "Sliders",
        "show sliders and switches, or hide them",
        lambda controls: controls.view.sliders,
        _sliders,
        done=("", ""),
    ),
    "help": switch(
        "Keys",
        "show all keys, or hide them",
        lambda controls: controls.view.help,
        _help,
        done=("", ""),
    ),
    "full-screen": switch(
        "Full screen",
        "fill the screen, or go back to the window",
        lambda controls: controls.view.full_screen,
        _full_screen,
        done=("F11 goes back from the full screen", ""),
    ),
    "audience": switch(
        "Audience",
        "open or close a window of the show alone, on another screen if there is one",
        lambda controls: controls.view.audience,
        _audience,
        done=("the audience's window opens", "the audience's window is closed"),
    ),
    **{
        name: action
        for slider_name, slider in SLIDERS.items()
        for name, action in _slider_actions(slider_name, slider).items()
    },
    **{name: _conditioning(name, *STEPS[name]) for name in SWITCHES},
    **MATCH_ACTIONS,
    **CHOOSING_ACTIONS,
    **SESSION_ACTIONS,
    "leave": Action("Leave", "end the show", press=leave, words=lambda _: "leaving"),
}
"""Every action by its name. A new action is one more row, and a key in `runtime.control.keys`."""


def press(name: str, controls: ShowControls) -> None:
    """Press an action, as a key or a button does, and say on the panel what it has done."""
    action = ACTIONS[name]
    if action.press is None:
        return
    before = controls.notices.latest
    action.press(controls)
    _perform_again(controls)
    said = _done(action, controls)
    if said and controls.notices.latest is before:  # it has not spoken for itself
        controls.notices.show(said)


def set_value(name: str, value: float, controls: ShowControls) -> None:
    """Set a switch or a fader to a value in [0, 1]."""
    action = ACTIONS[name]
    if action.write is not None:
        action.write(controls, value)
        _perform_again(controls)


def _perform_again(controls: ShowControls) -> None:
    """Let what has changed be seen where no frame comes; in a pause at once."""
    controls.loop.perform_again()
    if _is_paused(controls):
        for puppet in controls.puppets:
            puppet.change_at_once()


def _done(action: Action, controls: ShowControls) -> str:
    """What an action has just done, in words."""
    if action.words is not None:
        return action.words(controls)
    if action.read is None or action.kind is Kind.PRESS:
        return action.label
    return f"{action.label}: {'on' if action.read(controls) >= 0.5 else 'off'}"
