"""The actions of mapping by hand: begin, take all alike, set delays, turn the view, clear."""

from __future__ import annotations

from collections.abc import Mapping

from runtime.control.action import Action, switch
from runtime.control.show_controls import ShowControls

MOST_PHASE = 1.0  # [s] at the upper end of the fader
STEP = 0.05  # [s] that one key press moves it


def _choose(controls: ShowControls, on: bool) -> None:
    if on and not controls.chooser.on:
        controls.chooser.begin()
    elif not on and controls.chooser.on:
        controls.chooser.leave()


def _together(controls: ShowControls, on: bool) -> None:
    controls.chooser.together = on


def _clear(controls: ShowControls) -> None:
    if not controls.chooser.on:
        controls.notices.show("no pairs are chosen now: F6 begins")
        return
    controls.chooser.clear()


def _widest_view(controls: ShowControls) -> None:
    if controls.scene is not None:
        controls.scene.view_widest(controls.match_controls.selected)


def _set_phase(controls: ShowControls, share: float) -> None:
    controls.chooser.phase = share * MOST_PHASE


def _move_phase(controls: ShowControls, by: float) -> None:
    controls.chooser.phase = min(max(controls.chooser.phase + by, 0.0), MOST_PHASE)


def phase_words(controls: ShowControls) -> str:
    """The phase with its name and its value."""
    return f"One after the other: {controls.chooser.phase:.2f} s"


CHOOSING_ACTIONS: Mapping[str, Action] = {
    "map-by-hand": switch(
        "Map by hand",
        "pair parts of performer and character by clicks, or stop",
        lambda controls: controls.chooser.on,
        _choose,
        done=("", "what drove goes on"),
    ),
    "together": switch(
        "All alike",
        "let a click take all parts that are alike, such as a squid's arms, or only one",
        lambda controls: controls.chooser.together,
        _together,
        done=("a click takes all parts that are alike", "a click takes one part"),
    ),
    "clear-pairs": Action(
        "No pairs", "remove all pairs", press=_clear, words=lambda _: "all pairs are gone"
    ),
    "widest-view": Action(
        "Widest view",
        "turn to where the most bones of the character are seen",
        press=_widest_view,
        words=lambda _: "seen from where it shows the most",
    ),
    "phase": Action(
        "One after the other",
        "delay between parts that one part of the performer drives",
        write=_set_phase,
        read=lambda controls: min(controls.chooser.phase / MOST_PHASE, 1.0),
    ),
    "phase-up": Action(
        "One after the other +",
        "a longer delay between such parts",
        press=lambda controls: _move_phase(controls, STEP),
        words=phase_words,
    ),
    "phase-down": Action(
        "One after the other -",
        "a shorter delay between such parts",
        press=lambda controls: _move_phase(controls, -STEP),
        words=phase_words,
    ),
}
"""The rows of the table of actions that are for choosing by hand."""
