"""`bunraku demo`, `replay` and `live`: a performer drives characters."""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.stream import SkeletonStream, open_stream
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.playback import playback_of
from replay.player import EveryFrame, Player, RealTime
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from replay.recording import Recording
from runtime.characters.builtin import BUILTIN
from runtime.characters.character import Character
from runtime.characters.open_character import load_character
from runtime.conditioning.switches import asked_for, for_live, for_recording
from runtime.control.actions import ShowControls
from runtime.control.keys import WindowControls
from runtime.control.remote import PORT, Remote
from runtime.control.window import Window
from runtime.driving.mapping import Mapping, read_mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.puppet_match import Choices
from runtime.driving.rehearsal import rehearse
from runtime.output.report.report import Report
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from runtime.render.background import NOTHING, Background
from runtime.render.camera import front_camera
from runtime.render.context import headless_context, release_headless
from runtime.show.act_group import Act, ActGroup
from runtime.show.collector_pauses import collector_paused, objects_frozen
from runtime.show.interrupt import held
from runtime.show.loop import FrameLoop
from runtime.show.outputs import check_outputs, needs_pictures, open_outputs
from runtime.show.pacing import TICKS, AtOnce, SpareTime, pace_of
from runtime.show.progress import Progress
from runtime.show.provenance import provenance
from runtime.show.scene import Scene
from runtime.show.takes import Takes, set_aside
from runtime.show.warn import warn
from solvers.deform.arap_cells import SPOKES

STEADY = 1.0  # seconds that a live match stands before it performs by itself


@dataclass(frozen=True, slots=True)
class _Source:
    """Where a show's motion comes from, and what is known of it beforehand.

    Attributes:
        stream: gives the frames.
        origin: what it is called in a recording of it.
        rate: about how many come in a second.
        recording: what is played, or None when live.
        patience: how long [s] a match must stand before it performs by itself.
    """

    stream: SkeletonStream
    origin: str
    rate: float
    recording: Recording | None
    patience: float


def demo(options: argparse.Namespace) -> int:
    """Let one built-in performance drive every built-in character."""
    options.character = options.character or list(BUILTIN)
    if not _has_display():
        options.headless = options.fast = True
    return _show(options, lambda: _played("show", builtin_recording("show"), options))


def replay(options: argparse.Namespace) -> int:
    """Let a recorded stream drive characters."""
    path: Path = options.recording
    return _show(options, lambda: _played(path.name, read_recording(path), options))


def live(options: argparse.Namespace) -> int:
    """Let a live stream drive characters."""
    url = options.device
    return _show(options, lambda: _Source(open_stream(url), url, TICKS, None, STEADY))


def _has_display() -> bool:
    if not sys.platform.startswith("linux"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _played(name: str, recording: Recording, options: argparse.Namespace) -> _Source:
    pace = EveryFrame() if options.fast else RealTime(options.speed)
    seconds = recording.seconds
    rate = (len(recording) - 1) / seconds if seconds > 0.0 else TICKS
    return _Source(Player(recording, pace, loop=options.loop), name, rate, recording, 0.0)


def _show(options: argparse.Namespace, open_source: Callable[[], _Source]) -> int:
    """Open everything, run the loop to the end, close everything, whatever happens."""
    check_outputs(options)
    closing = ExitStack()
    try:
        with collector_paused():
            show = _Show(options, open_source(), closing)
            show.prepare()
        show.run()
    finally:
        with held():  # nobody's impatience leaves half a file
            closing.close()
    return 0


def _made(character: Character, number: int, options: argparse.Namespace) -> Puppet:
    """The puppet of the `number`-th character, of what was asked for it."""

    def asked(values: list[Any] | None, otherwise: Any) -> Any:
        return values[min(number, len(values) - 1)] if values else otherwise

    puppet = Puppet(character, iterations=options.iterations, energy=asked(options.energy, SPOKES))
    puppet.surface.elasticity = Elasticity(
        cartoon=asked(options.cartoon, 0.0),
        volume_gain=asked(options.volume_gain, 1.0),
        stiffness=asked(options.stiffness, 0.0),
    )
    for note in puppet.surface.notes:
        warn(f"{character.name}: {note}")
    return puppet


def _background(options: argparse.Namespace) -> Background | None:
    """What is there instead of the house, if anything is."""
    if options.transparent:
        return NOTHING
    return None if options.background is None else Background(*options.background)


class _Show:
    """One show as the command line asked for it; what it opens is left to `closing`."""

    def __init__(self, options: argparse.Namespace, source: _Source, closing: ExitStack) -> None:
        self._options = options
        self._source = source
        self._closing = closing
        self._stream = closing.enter_context(RecordedStream(source.stream))
        self._remote = self._open_remote()
        usual = for_live() if source.recording is None else for_recording()
        self._conditioning = asked_for(usual, vars(options))
        self._performer = Performer(self._stream.skeleton, options.source, self._conditioning)
        characters = [load_character(name) for name in options.character]
        self._report = Report(options.report)
        self._parts = [self._report.cast(character) for character in characters]
        self._puppets = [_made(one, number, options) for number, one in enumerate(characters)]
        self._window = None
        if not options.headless:
            self._window = closing.enter_context(
                Window("Bunraku", options.size, transparent=options.transparent)
            )
        self._scene = self._open_scene()
        self._acts = self._call_acts()

    def prepare(self) -> None:
        """Go through what is to be performed, where that is known."""
        recording = self._source.recording
        if recording is None:
            return
        filled = self._rehearse(recording)
        if self._scene is not None:
            self._scene.frame_all(filled)

    def run(self) -> None:
        """Perform until the stream ends or the window is closed."""
        options, recording = self._options, self._source.recording
        with held():
            loop = self._open_loop()
            desk = self._open_desk(loop)
        total = None if recording is None or options.loop else len(recording)
        progress = self._closing.enter_context(Progress("performing", total))
        controls = None
        if self._window is not None and self._scene is not None:
            controls = WindowControls(self._window, self._scene, desk)
        pace = AtOnce() if options.fast else pace_of(self._source.stream)
        spare = SpareTime(pace, loop)
        self._closing.enter_context(objects_frozen())
        while not (self._stream.ended or desk.leaving):
            with held():  # so that all outputs have the same frames
                performed = loop.tick()
            if performed:
                progress.advance(said=_milliseconds(loop.latency))
            if controls is not None:
                controls.present()
                controls.serve()
            if self._remote is not None:
                self._remote.serve(desk)
            spare.spend()
            pace.wait()

    def _open_loop(self) -> FrameLoop:
        """The loop with all that keeps the show; opened last, when nothing else can fail."""
        self._closing.enter_context(self._report)
        cast = [
            (puppet.character, part)
            for puppet, part in zip(self._puppets, self._parts, strict=True)
        ]
        performers = [act.performer for act in self._acts]
        loop = FrameLoop(
            self._stream,
            self._acts[0].performer,
            self._acts[0].puppets,
            match_session=self._acts[0].match_session,
            others=self._acts[1:],
            report=self._report,
            scene=self._scene,
            outputs=open_outputs(self._options, cast, performers, self._source.rate, self._closing),
            conditioning=self._conditioning,
            shown=self._window is not None,
        )
        self._closing.callback(self._tell, loop)
        return loop

    def _open_desk(self, loop: FrameLoop) -> ShowControls:
        """What a puppeteer reaches, by keys or from afar."""
        return ShowControls(
            cues=ActGroup([act.match_session for act in self._acts]),
            conditioning=self._conditioning,
            loop=loop,
            surfaces=[puppet.surface for puppet in self._puppets],
            takes=self._open_takes(),
            playback=playback_of(self._stream),
            scene=self._scene,
        )

    def _open_takes(self) -> Takes:
        """The takes that may be asked for, and the recording that was, which begins at once."""
        path = self._options.record
        # A recording that waits for the loop can wait for the disk as well, and loses nothing.
        waits = self._options.fast and self._source.recording is not None
        recorder = None
        if path is not None:
            set_aside(path, warn)
            recorder = self._open_recorder(path)
            self._closing.callback(self._report.kept, recorder)  # once it is closed
        takes = Takes(
            self._stream, path or Path("take.mcap"), self._open_recorder, tell=warn, waits=waits
        )
        self._closing.enter_context(takes)
        if recorder is not None:
            takes.record(recorder)
        return takes

    def _open_recorder(self, path: Path) -> Recorder:
        source = provenance(self._source.origin)
        return Recorder(path, self._stream.skeleton, source=source, tell=warn)

    def _open_remote(self) -> Remote | None:
        """The remote control, if one was asked for."""
        if self._options.remote is None:
            if self._options.remote_feedback is not None:
                raise InputError("--remote-feedback answers a remote control: add --remote")
            return None
        host, port = self._options.remote
        answers = self._options.remote_feedback or 0
        remote = Remote(host, PORT if port is None else port, answer_port=answers, tell=warn)
        return self._closing.enter_context(remote)

    def _open_scene(self) -> Scene | None:
        """The house, if anybody looks."""
        if self._window is not None:
            context, size = self._window.context, self._window.size
        elif needs_pictures(self._options):
            context, size = headless_context(), self._options.size
            self._closing.callback(release_headless, context)
        else:
            return None
        scene = Scene(
            context,
            size,
            self._puppets,
            self._stream.skeleton,
            background=_background(self._options),
            plain=self._options.plain,
        )
        self._closing.callback(scene.close)
        return scene

    def _call_acts(self) -> list[Act]:
        """Give each performer their characters: one each, all that are left to the last."""
        count = self._options.performers
        if count > len(self._puppets):
            raise InputError(
                f"--performers {count} needs as many characters, got {len(self._puppets)}; give "
                "--character more often"
            )
        acts = []
        for part in range(count):
            puppets = self._puppets[part : None if part == count - 1 else part + 1]
            performer = self._performer
            if part > 0:
                performer = Performer(
                    self._stream.skeleton, self._options.source, self._conditioning
                )
            acts.append(Act(performer, puppets, self._open_match_session(performer, puppets)))
        return acts

    def _rehearse(self, recording: Recording) -> NDArray[np.float64] | None:
        """Let each act choose poses of the recording; corners of all that they fill, or None."""
        filled = [
            rehearse(recording, self._options.source, act.match_session, self._conditioning, part)
            for part, act in enumerate(self._acts)
        ]
        known = [corners for corners in filled if corners is not None]
        return np.concatenate(known) if len(known) == len(filled) else None

    def _open_match_session(self, performer: Performer, puppets: list[Puppet]) -> MatchSession:
        options = self._options
        # Only who sits at the window can walk round the stage; a camera that merely steps back to
        # have all in view would turn by a rounding error, and the bytes of a cache with it.
        scene, front = (self._scene if self._window else None), front_camera()
        by_hand: list[Mapping | None] = [
            None
            if options.mapping is None
            else read_mapping(options.mapping, performer.skeleton, one.character.skeleton)
            for one in puppets
        ]
        return MatchSession(
            performer,
            puppets,
            lambda: (front if scene is None else scene.camera).view_rotation,
            Choices(options.match, options.chains == "extend", options.flip, self._source.patience),
            by_hand,
        )

    def _tell(self, loop: FrameLoop) -> None:
        """Put what is only known at the end into the report."""
        skeleton, recording = self._performer.skeleton, self._source.recording
        if recording is None:
            frames, seconds = loop.received, loop.seconds
        else:
            frames, seconds = len(recording), recording.seconds
        self._report.recorded(frames=frames, joints=len(skeleton.names), seconds=seconds)
        mappings = [mapping for act in self._acts for mapping in act.match_session.mappings]
        for part, mapping in zip(self._parts, mappings, strict=True):
            part.matched(mapping, skeleton)


def _milliseconds(seconds: float) -> str:
    """For a puppeteer's eye; nothing where it is not known."""
    return f"{1e3 * seconds:.1f} ms" if math.isfinite(seconds) else ""
