"""All that a puppeteer can do while a show runs: one table, by whatever name it is asked for.

Keys (`runtime.control.keys`) and remote controls (`runtime.control.remote`) are names for these
actions and nothing more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from devices.stream import SkeletonStream
from replay.player import Player
from runtime.conditioning.switches import SWITCHES, Conditioning
from runtime.puppet.deformable_surface import DeformableSurface, Elasticity
from runtime.show.act_group import Cues
from runtime.show.loop import FrameLoop
from runtime.show.scene import Scene
from runtime.show.takes import Takes

STEP = 0.1  # of a fader's way that a key moves it
MOST = {
    "cartoon": 1.0,
    "volume_gain": 2.0,  # the middle of its fader is all of the volume
    "stiffness": 0.99,  # a limb that could not bend at all would have no answer
}


@dataclass(slots=True, eq=False)
class ShowControls:
    """What actions act upon.

    Attributes:
        cues: who decides what drives what.
        stream: where frames come from; a `Player` can be held and wound back.
        conditioning: what is done to them.
        loop: performs them.
        surfaces: the characters' surfaces.
        takes: records.
        theatre: where the show is seen, or None where nobody sees it.
        leaving: whether it is time to go.
    """

    cues: Cues
    stream: SkeletonStream
    conditioning: Conditioning
    loop: FrameLoop
    surfaces: Sequence[DeformableSurface]
    takes: Takes
    scene: Scene | None = None
    leaving: bool = False


Do = Callable[[ShowControls], None]
Read = Callable[[ShowControls], float]
Write = Callable[[ShowControls, float], None]


@dataclass(frozen=True, slots=True)
class Action:
    """Something that can be done.

    Attributes:
        text: what it does, in a few words.
        press: does it as a button or a key would; None for a fader.
        write: sets its value in [0, 1]; None where there is nothing to be set.
        read: gives its value in [0, 1], for a light or a fader that shows it.
    """

    text: str
    press: Do | None = None
    write: Write | None = None
    read: Read | None = None


def _switch(
    text: str, read: Callable[[ShowControls], bool], write: Callable[[ShowControls, bool], None]
) -> Action:
    """On or off: turned over when pressed, or set."""
    return Action(
        text,
        press=lambda desk: write(desk, not read(desk)),
        write=lambda desk, value: write(desk, value >= 0.5),
        read=lambda desk: float(read(desk)),
    )


def _fader(text: str, field: str) -> Action:
    """Something that all characters are made of; it shows the first's."""
    return Action(
        text,
        write=lambda desk, value: _make(desk, field, value),
        read=lambda desk: _made_of(desk, field),
    )


def _nudge(text: str, field: str, by: float) -> Action:
    """A fader moved a little."""

    def press(desk: ShowControls) -> None:
        now = _made_of(desk, field)
        moved = min(max(now + by, 0.0), 1.0)
        if moved != now:
            _make(desk, field, moved)

    return Action(text, press=press)


def _made_of(desk: ShowControls, field: str) -> float:
    return min(float(getattr(desk.surfaces[0].elasticity, field)) / MOST[field], 1.0)


def _make(desk: ShowControls, field: str, value: float) -> None:
    for surface in desk.surfaces:
        changed: Elasticity = replace(surface.elasticity, **{field: value * MOST[field]})
        if changed != surface.elasticity:
            surface.elasticity = changed


def _conditioning(name: str, text: str) -> Action:
    """A switch of the conditioning."""

    def write(desk: ShowControls, on: bool) -> None:
        desk.conditioning.switch(name, on)

    return _switch(text, lambda desk: bool(getattr(desk.conditioning, name)), write)


def _accept(desk: ShowControls) -> None:
    if desk.cues.matching:
        desk.cues.accept()


def _player(desk: ShowControls) -> Player | None:
    return desk.stream if isinstance(desk.stream, Player) else None


def _play(desk: ShowControls) -> None:
    if (player := _player(desk)) is not None:
        player.resume()


def _pause(desk: ShowControls) -> None:
    if (player := _player(desk)) is not None:
        player.pause()


def _paused(desk: ShowControls) -> bool:
    player = _player(desk)
    return player is not None and player.paused


def _home(desk: ShowControls) -> None:
    if (player := _player(desk)) is not None:
        player.seek(0.0)


def _record(desk: ShowControls, on: bool) -> None:
    if on:
        desk.takes.start()
    else:
        desk.takes.stop()


def _freeze(desk: ShowControls, on: bool) -> None:
    desk.loop.frozen = on


def _blackout(desk: ShowControls, on: bool) -> None:
    if desk.scene is not None:
        desk.scene.blackout.to(float(on))


def _chains(desk: ShowControls, on: bool) -> None:
    if desk.scene is not None:
        desk.scene.highlights = on


def _frame_all(desk: ShowControls) -> None:
    if desk.scene is not None:
        desk.scene.frame_all()


def _leave(desk: ShowControls) -> None:
    desk.leaving = True


STEPS = {
    "order": "dropping what comes late or twice, on or off",
    "identities": "steady identities, on or off",
    "swaps": "putting swapped limbs right, on or off",
    "outliers": "the gate for outliers, on or off",
    "filter": "smoothing, on or off",
    "predict": "prediction, on or off",
    "level": "levelling the floor, on or off",
    "mirror": "mirror, on or off",
    "scale": "one size for all performers, on or off",
    "recalibrate": "calibrating by a T or A pose that is held, on or off",
}

ACTIONS: Mapping[str, Action] = {
    "match-again": Action(
        "match again: strike a pose, the best match is shown",
        press=lambda desk: desk.cues.match_again(),
        read=lambda desk: float(desk.cues.matching),
    ),
    "accept": Action("accept the match shown; the pose is the rest state", press=_accept),
    "next-match": Action("the next match", press=lambda desk: desk.cues.next_match()),
    "previous-match": Action("the match before", press=lambda desk: desk.cues.previous_match()),
    "rest-pose": Action("the pose is the rest state", press=lambda desk: desk.cues.take_rest()),
    "calibrate": Action(
        "calibrate: the pose is the rest state, floor and sizes are measured anew",
        press=lambda desk: desk.cues.calibrate(),
    ),
    "hold": _switch(
        "hold or go on (a recording)", _paused, lambda desk, on: (_pause if on else _play)(desk)
    ),
    "play": Action("go on (a recording)", press=_play, read=lambda desk: float(not _paused(desk))),
    "pause": Action("hold (a recording)", press=_pause, read=lambda desk: float(_paused(desk))),
    "home": Action("back to the start (a recording)", press=_home),
    "record": _switch(
        "begin or end a take: the performer goes to a new file",
        lambda desk: desk.takes.recording,
        _record,
    ),
    "freeze": _switch(
        "freeze: characters hold still while the stream goes on",
        lambda desk: desk.loop.frozen,
        _freeze,
    ),
    "blackout": _switch(
        "blackout: fade to black, and back",
        lambda desk: desk.scene is not None and desk.scene.blackout.target > 0.0,
        _blackout,
    ),
    "frame-all": Action("frame every character", press=_frame_all),
    "chains": _switch(
        "show or hide the matched chains",
        lambda desk: desk.scene is not None and desk.scene.highlights,
        _chains,
    ),
    "cartoon": _fader("how much characters squash and stretch, from not at all", "cartoon"),
    "cartoon-up": _nudge("more squash and stretch", "cartoon", STEP),
    "cartoon-down": _nudge("less squash and stretch", "cartoon", -STEP),
    "volume": _fader(
        "how much of their volume is kept; more than all of it above the middle", "volume_gain"
    ),
    "volume-up": _nudge("keep more of the volume", "volume_gain", STEP),
    "volume-down": _nudge("keep less of the volume", "volume_gain", -STEP),
    "stiffness": _fader("how stiff limbs are between their joints", "stiffness"),
    "stiffness-up": _nudge("stiffer limbs", "stiffness", STEP),
    "stiffness-down": _nudge("softer limbs", "stiffness", -STEP),
    **{name: _conditioning(name, STEPS[name]) for name in SWITCHES},
    "leave": Action("leave", press=_leave),
}
"""Every action by its name. One more is one more line here, and a key in `runtime.control.keys`."""
