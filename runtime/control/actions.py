"""The table of everything a puppeteer can do while a show runs.

Keys (`runtime.control.keys`), the OSC remote (`runtime.control.remote`), the documentation and the
tests read the names, texts and ranges of this table and have none of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from replay.playback import Playback
from runtime.conditioning.switches import SWITCHES, Conditioning
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import MatchControls
from runtime.show.loop import FrameLoop
from runtime.show.scene import Scene
from runtime.show.takes import Takes

STEP = 0.1  # share of a fader's range that one key press moves it


@dataclass(slots=True, eq=False)
class ShowControls:
    """The parts of a show that actions change.

    Attributes:
        match_controls: matching, of all acts.
        conditioning: the switches of the conditioning.
        loop: the frame loop, which freezes the characters.
        puppets: all characters as they are driven.
        takes: the recorder of takes.
        playback: the playback of a recording; None where the stream is live.
        scene: the picture; None where no picture is drawn.
        leaving: whether the show is to end.
    """

    match_controls: MatchControls
    conditioning: Conditioning
    loop: FrameLoop
    puppets: Sequence[Puppet]
    takes: Takes
    playback: Playback | None = None
    scene: Scene | None = None
    leaving: bool = False


class Kind(Enum):
    """How an action is operated."""

    PRESS = "press"
    SWITCH = "switch"
    FADER = "fader"


Do = Callable[[ShowControls], None]
Read = Callable[[ShowControls], float]
Write = Callable[[ShowControls, float], None]


@dataclass(frozen=True, slots=True)
class Action:
    """One row of the table.

    Attributes:
        text: what the action does, in a few words.
        press: does it, as a button or a key does; None for a fader.
        write: sets its value in [0, 1]; None where there is no value to set.
        read: returns its value in [0, 1], for a light or a fader; None where there is none.
    """

    text: str
    press: Do | None = None
    write: Write | None = None
    read: Read | None = None

    @property
    def kind(self) -> Kind:
        """How the action is operated: a switch can be pressed and set, a fader only set."""
        if self.press is None:
            return Kind.FADER
        return Kind.PRESS if self.write is None else Kind.SWITCH


@dataclass(frozen=True, slots=True)
class Slider:
    """A number that all characters' surfaces share, with one fader and two keys.

    Attributes:
        field: its field of `Elasticity`, in [0, `most`].
        most: the fader's upper end.
        text: what the fader sets.
        more: what the action that raises it does.
        less: what the action that lowers it does.
    """

    field: str
    most: float
    text: str
    more: str
    less: str

    def read(self, controls: ShowControls) -> float:
        """Return the first character's value as a share of the fader's range."""
        value = float(getattr(controls.puppets[0].surface.elasticity, self.field))
        return min(value / self.most, 1.0)

    def write(self, controls: ShowControls, share: float) -> None:
        """Set all characters to a share of the fader's range."""
        for surface in (puppet.surface for puppet in controls.puppets):
            changed: Elasticity = replace(surface.elasticity, **{self.field: share * self.most})
            if changed != surface.elasticity:
                surface.elasticity = changed

    def move(self, controls: ShowControls, by: float) -> None:
        """Move the fader by a share of its range; a value beyond its upper end stays."""
        share = self.read(controls)
        moved = min(max(share + by, 0.0), 1.0)
        if moved != share:
            self.write(controls, moved)


SLIDERS: Mapping[str, Slider] = {
    "cartoon": Slider(
        "cartoon",
        1.0,
        "how much characters squash and stretch, from not at all",
        "more squash and stretch",
        "less squash and stretch",
    ),
    "volume": Slider(
        "volume_gain",
        2.0,  # the middle of the fader keeps exactly the volume
        "how much of their volume is kept; more than all of it above the middle",
        "keep more of the volume",
        "keep less of the volume",
    ),
    "stiffness": Slider(
        "stiffness",
        0.99,  # at 1 the deformation of a limb has no solution
        "how stiff limbs are between their joints",
        "stiffer limbs",
        "softer limbs",
    ),
}

STEPS = {
    "order": "dropping late and duplicate frames, on or off",
    "identities": "steady identities, on or off",
    "swaps": "putting swapped limbs right, on or off",
    "outliers": "the gate for outliers, on or off",
    "filter": "smoothing, on or off",
    "predict": "prediction, on or off",
    "level": "levelling the floor, on or off",
    "mirror": "exchanging left and right, on or off",
    "scale": "one size for all performers, on or off",
    "recalibrate": "calibrating by a T or A pose kept still, on or off",
}


def _switch(
    text: str, read: Callable[[ShowControls], bool], write: Callable[[ShowControls, bool], None]
) -> Action:
    """Build an action that is on or off: a press reverses it, `write` sets it."""
    return Action(
        text,
        press=lambda controls: write(controls, not read(controls)),
        write=lambda controls, value: write(controls, value >= 0.5),
        read=lambda controls: float(read(controls)),
    )


def _slider_actions(name: str, slider: Slider) -> dict[str, Action]:
    """Build a slider's fader and the two actions that move it by a step."""
    return {
        name: Action(slider.text, write=slider.write, read=slider.read),
        f"{name}-up": Action(slider.more, press=lambda controls: slider.move(controls, STEP)),
        f"{name}-down": Action(slider.less, press=lambda controls: slider.move(controls, -STEP)),
    }


def _conditioning(name: str, text: str) -> Action:
    """Build the action of one switch of the conditioning."""

    def write(controls: ShowControls, on: bool) -> None:
        controls.conditioning.switch(name, on)

    return _switch(text, lambda controls: bool(getattr(controls.conditioning, name)), write)


def _accept(controls: ShowControls) -> None:
    if controls.match_controls.matching:
        controls.match_controls.accept()


def _is_paused(controls: ShowControls) -> bool:
    return controls.playback is not None and controls.playback.paused


def _pause(controls: ShowControls, on: bool) -> None:
    if controls.playback is None:
        return
    if on:
        controls.playback.pause()
    else:
        controls.playback.resume()


def _home(controls: ShowControls) -> None:
    if controls.playback is not None:
        controls.playback.seek(0.0)


def _record(controls: ShowControls, on: bool) -> None:
    if on:
        controls.takes.start()
    else:
        controls.takes.stop()


def _freeze(controls: ShowControls, on: bool) -> None:
    controls.loop.frozen = on


def _in_place(controls: ShowControls, on: bool) -> None:
    for puppet in controls.puppets:
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


def _leave(controls: ShowControls) -> None:
    controls.leaving = True


ACTIONS: Mapping[str, Action] = {
    "match-again": Action(
        "match again: strike a pose, the best match is shown",
        press=lambda controls: controls.match_controls.match_again(),
        read=lambda controls: float(controls.match_controls.matching),
    ),
    "accept": Action("accept the match shown; the pose is the rest state", press=_accept),
    "next-match": Action(
        "the next match", press=lambda controls: controls.match_controls.next_match()
    ),
    "previous-match": Action(
        "the match before", press=lambda controls: controls.match_controls.previous_match()
    ),
    "rest-pose": Action(
        "the pose is the rest state", press=lambda controls: controls.match_controls.take_rest()
    ),
    "calibrate": Action(
        "calibrate: the pose is the rest state, floor and sizes are measured anew",
        press=lambda controls: controls.match_controls.calibrate(),
    ),
    "hold": _switch("pause or resume playback (a recording)", _is_paused, _pause),
    "play": Action(
        "resume playback (a recording)",
        press=lambda controls: _pause(controls, False),
        read=lambda controls: float(not _is_paused(controls)),
    ),
    "pause": Action(
        "pause playback (a recording)",
        press=lambda controls: _pause(controls, True),
        read=lambda controls: float(_is_paused(controls)),
    ),
    "home": Action("back to the start (a recording)", press=_home),
    "record": _switch(
        "begin or end a take: the performer goes to a new file",
        lambda controls: controls.takes.recording,
        _record,
    ),
    "freeze": _switch(
        "freeze: characters stand still while the stream goes on",
        lambda controls: controls.loop.frozen,
        _freeze,
    ),
    "in-place": _switch(
        "in place: characters stay where they are, or travel as their performers do",
        lambda controls: controls.puppets[0].travel.in_place,
        _in_place,
    ),
    "blackout": _switch(
        "blackout: fade to black, and back",
        lambda controls: controls.scene is not None and controls.scene.blackout.target > 0.0,
        _blackout,
    ),
    "frame-all": Action("frame every character", press=_frame_all),
    "chains": _switch(
        "show or hide the matched chains",
        lambda controls: controls.scene is not None and controls.scene.highlights,
        _chains,
    ),
    **{
        name: action
        for slider_name, slider in SLIDERS.items()
        for name, action in _slider_actions(slider_name, slider).items()
    },
    **{name: _conditioning(name, STEPS[name]) for name in SWITCHES},
    "leave": Action("leave", press=_leave),
}
"""Every action by its name. A new action is one more row, and a key in `runtime.control.keys`."""
