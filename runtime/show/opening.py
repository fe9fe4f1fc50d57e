"""Opening a show: its devices, solvers, window and files, in an order that fails early."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from devices.errors import InputError
from devices.stream import SkeletonStream
from replay.playback import playback_of
from replay.player import Player
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from replay.recording import Recording
from runtime.characters.character import Character
from runtime.conditioning.switches import asked_for, for_live, for_recording
from runtime.control.keys import WindowControls
from runtime.control.remote import PORT, Remote
from runtime.control.show_controls import ShowControls
from runtime.control.window import Window, leave_windows
from runtime.driving.drivers import LIMB_BY_LIMB, DriverFactory
from runtime.driving.mapping import read_mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.rehearsal import rehearse
from runtime.output.files.export import OF_NODES
from runtime.output.files.kept_file import Kept, KeptFile, size_of
from runtime.output.output import Output
from runtime.output.report.report import Report
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from runtime.render.camera import front_camera
from runtime.render.context import headless_context, make_current, release_headless
from runtime.show.act_group import Act, ActGroup
from runtime.show.interrupts import interrupts_deferred
from runtime.show.loop import FrameLoop
from runtime.show.match_choices import choices_of, driver_of
from runtime.show.outputs import check_outputs, open_outputs
from runtime.show.pacing import TICKS, loses_no_frame
from runtime.show.provenance import provenance
from runtime.show.scene import Scene
from runtime.show.settings import CharacterSettings, ShowSettings, check_characters
from runtime.show.takes import Takes, set_aside
from runtime.status.notices import Notices, SecondPress
from runtime.status.prompts import news
from runtime.status.show_status import ShowStatus, status_of
from runtime.status.stream_watch import Sight, StreamWatch

if TYPE_CHECKING:
    import moderngl

    from runtime.panel.panel import Panel


class OpenedShow:
    """Everything that a `Show` opens; `closing` closes it, in reverse order.

    Args:
        stream, characters, settings, outputs, context, make_scene, make_driver, clock, tell,
            warn: as of `Show`.
        closing: closes what was opened, also if the constructor fails.

    Attributes:
        loop: performs the frames.
        scene: draws them, or None where nothing is drawn.
        controls: the parts of the show that actions change.
        window_controls: the window's keys and mouse, or None without a window.
        remote: the remote control, or None.
        notices: what happened last, for the panel.
        watch: what is seen of the performer.
        report: the figures of the show.
        acts: each performer with their puppets and their match session.
        puppets: the characters as they are driven.
    """

    def __init__(
        self,
        stream: SkeletonStream,
        characters: Sequence[Character],
        settings: ShowSettings,
        closing: ExitStack,
        *,
        outputs: Sequence[Output],
        context: moderngl.Context | None,
        make_scene: Callable[..., Scene],
        make_driver: DriverFactory | None,
        clock: Callable[[], float],
        tell: Callable[[str], None],
        warn: Callable[[str], None],
    ) -> None:
        self._settings, self._closing = settings, closing
        self._clock = clock
        self.notices = Notices(tell, warn, clock)
        self._tell, self._warn = self.notices.tell, self.notices.warn
        self._source = stream
        self._stream = closing.enter_context(RecordedStream(stream))
        check_characters(settings, len(characters))
        check_outputs(settings, [character.name for character in characters])
        playback = playback_of(stream)
        if isinstance(playback, Player) and settings.match.driver != "relative":
            playback.leave_out_false_start()
        self._make_driver = make_driver or driver_of(settings.match)
        if self._make_driver in LIMB_BY_LIMB and settings.match.mapping is None:
            characters = [character.limb_by_limb for character in characters]
        self.remote = self._open_remote()
        usual = for_live() if self._recording is None else for_recording()
        self._conditioning = asked_for(usual, settings.conditioning)
        first = self._performer()
        self.watch = StreamWatch(stream, live=playback_of(stream) is None, clock=clock)
        self.report = Report(settings.files.report)
        self._parts = [self.report.add_character(character) for character in characters]
        own = settings.characters
        own = own if len(own) == len(characters) else own * len(characters)
        self.puppets = list(map(self._puppet, characters, own))
        self._window = self._open_window()
        self._shown = self._window is not None or context is not None
        self.scene = self._open_scene(context, make_scene)
        self.acts = self._open_acts(first)
        self._check_export()
        if self._recording is not None and settings.match.rehearse:
            self._rehearse(self._recording)
        with interrupts_deferred():  # files come last, when nothing else can fail
            self.loop = self._open_loop(outputs)
            self.controls = self._open_controls()
        self.window_controls = None
        if self._window is not None and self.scene is not None:
            self.window_controls = WindowControls(
                self._window, self.scene, self.controls, self._open_panel(self._window)
            )
        closing.callback(self.make_current)  # for outputs that draw, and for the scene

    def make_current(self) -> None:
        """Make the OpenGL context current, if there is one; another show may have drawn since."""
        if self._window is not None:
            self._window.make_current()
        elif self._context is not None:
            leave_windows()
            make_current(self._context)

    def complete_report(self) -> None:
        """Put the recording and the matches, as they are now, into the report."""
        skeleton, recording = self._stream.skeleton, self._recording
        if recording is None:
            frames, seconds = self.loop.received, self.loop.seconds
        else:
            frames, seconds = len(recording), recording.seconds
        self.report.recorded(frames=frames, joints=len(skeleton.names), seconds=seconds)
        sessions = [act.match_session for act in self.acts]
        mappings = [mapping for session in sessions for mapping in session.mappings]
        driven = [parts for session in sessions for parts in session.parts]
        for part, mapping, parts in zip(self._parts, mappings, driven, strict=True):
            part.matched(mapping.score, parts, skeleton)

    def tell_sight(self) -> None:
        """Tell when a live performer comes into view, goes or comes back; warn of unusable data."""
        changed = self.watch.changed() if self._recording is None else None
        if changed is not None:
            tell = self._warn if changed[1].sight is Sight.NOT_UNDERSTOOD else self._tell
            tell(news(*changed, self._origin))

    @property
    def _origin(self) -> str:
        return self._settings.origin or type(self._source).__name__

    @property
    def kept(self) -> list[Kept]:
        """What lies where the show wrote files, once it is closed."""
        outputs = [output for own in self._outputs for output in own]
        files = [output.kept for output in outputs if isinstance(output, KeptFile)]
        return [*files, *self.controls.takes.kept, *self._kept_report]

    @property
    def _recording(self) -> Recording | None:
        playback = playback_of(self._source)
        return playback.recording if isinstance(playback, Player) else None

    @property
    def _rate(self) -> float:
        """About how many frames come in a second."""
        recording = self._recording
        if recording is None or recording.seconds == 0.0:
            return TICKS
        return (len(recording) - 1) / recording.seconds

    def _performer(self) -> Performer:
        return Performer(self._stream.skeleton, self._settings.match.source, self._conditioning)

    def _puppet(self, character: Character, own: CharacterSettings) -> Puppet:
        puppet = Puppet(character, iterations=own.iterations, energy=own.energy, tell=self._warn)
        puppet.surface.elasticity = Elasticity(own.cartoon, own.volume_gain, own.stiffness)
        puppet.travel.in_place = self._settings.match.in_place
        for note in puppet.surface.notes:
            self._warn(f"{character.name}: {note}")
        return puppet

    def _open_remote(self) -> Remote | None:
        asked = self._settings.remote
        if asked is None:
            return None
        host, port = asked.address
        remote = Remote(
            host,
            PORT if port is None else port,
            answer_port=asked.feedback_port or 0,
            tell=self._warn,
            clock=self._clock,
        )
        return self._closing.enter_context(remote)

    def _open_window(self) -> Window | None:
        if not self._settings.window:
            return None
        window = Window("Bunraku", self._settings.size, transparent=self._settings.transparent)
        return self._closing.enter_context(window)

    def _open_scene(
        self, context: moderngl.Context | None, make_scene: Callable[..., Scene]
    ) -> Scene | None:
        settings = self._settings
        size = settings.size
        if self._window is not None:
            context, size = self._window.context, self._window.size
        elif context is None and settings.needs_pictures:
            leave_windows()
            context = headless_context()
            self._closing.callback(release_headless, context)
        self._context = context
        if context is None:
            return None
        self.make_current()
        scene = make_scene(
            context,
            size,
            self.puppets,
            self._stream.skeleton,
            background=settings.background,
            plain=settings.plain,
            clock=self._clock,
        )
        self._closing.callback(scene.close)
        self._closing.callback(self.make_current)
        return scene

    def _open_acts(self, first: Performer) -> list[Act]:
        """Give each performer one character, and all remaining characters to the last."""
        count = self._settings.match.performers
        acts = []
        for part in range(count):
            puppets = self.puppets[part : None if part == count - 1 else part + 1]
            performer = first if part == 0 else self._performer()
            acts.append(Act(performer, puppets, self._open_match_session(performer, puppets)))
        return acts

    def _open_match_session(self, performer: Performer, puppets: list[Puppet]) -> MatchSession:
        match = self._settings.match
        # Only a window's camera can be walked round the stage. A camera that merely steps back to
        # have all in view would turn by a rounding error, and the bytes of a cache with it.
        scene, front = (self.scene if self._window else None), front_camera()
        return MatchSession(
            performer,
            puppets,
            lambda: (front if scene is None else scene.camera).view_rotation,
            choices_of(
                match, recorded=self._recording is not None, attended=self._window is not None
            ),
            [
                None
                if match.mapping is None
                else read_mapping(match.mapping, performer.skeleton, puppet.character.skeleton)
                for puppet in puppets
            ],
            make_driver=self._make_driver,
        )

    def _rehearse(self, recording: Recording) -> None:
        """Let each act start from the best poses of the recording, and frame all they fill."""
        source = self._settings.match.source
        reaches = [
            rehearse(recording, source, act.match_session, self._conditioning, part)
            for part, act in enumerate(self.acts)
        ]
        if self.scene is not None and all(each is not None for each in reaches):
            self.scene.frame_all([reach for own in reaches for reach in own or ()])

    def _check_export(self) -> None:
        """Refuse to export nodes that no driver poses, before a file is touched.

        Raises:
            InputError: a driver poses no nodes, and the export needs them.
        """
        export = self._settings.files.export
        if export is None or export.suffix.lower() not in OF_NODES:
            return
        for puppet in self.puppets:
            if puppet.driver is not None and not puppet.driver.poses_nodes:
                raise InputError(
                    f"cannot export {export}: the driver of {puppet.character.name} poses no "
                    "nodes; export a .usdc, which holds the surface, or choose another driver"
                )

    def _open_loop(self, own: Sequence[Output]) -> FrameLoop:
        self._kept_report: list[Kept] = []
        self._closing.callback(self._keep_report)
        outputs = open_outputs(
            self._settings,
            [
                (puppet.character, part)
                for puppet, part in zip(self.puppets, self._parts, strict=True)
            ],
            self._stream.skeleton,
            self._rate,
            self._closing,
            warn=self._warn,
        )
        self._outputs = outputs
        outputs[0].extend(self._closing.enter_context(output) for output in own)
        loop = FrameLoop(
            self._stream,
            self.acts,
            report=self.report,
            scene=self.scene,
            outputs=outputs,
            conditioning=self._conditioning,
            shown=self._shown,
            watch=self.watch,
            clock=self._clock,
        )
        self._closing.callback(self.complete_report)
        return loop

    def _keep_report(self) -> None:
        path = self._settings.files.report
        if path is None:
            return
        try:
            self.report.close()
        except InputError as error:
            self._warn(str(error))
            self._kept_report.append(Kept(path, "not written", str(error)))
        else:
            self._kept_report.append(Kept(path, size_of(path)))

    def _open_controls(self) -> ShowControls:
        return ShowControls(
            match_controls=ActGroup(self.acts),
            conditioning=self._conditioning,
            loop=self.loop,
            puppets=self.puppets,
            takes=self._open_takes(),
            notices=self.notices,
            leave_asked=SecondPress(self._clock),
            playback=playback_of(self._stream),
            scene=self.scene,
        )

    def _open_panel(self, window: Window) -> Panel:
        from runtime.panel.panel import Panel  # noqa: PLC0415  # no headless show needs ImGui

        panel = Panel(window.context, self.controls, self.status, clock=self._clock)
        self._closing.callback(panel.close)
        window.taker = panel.gui
        return panel

    def status(self) -> ShowStatus:
        """Return the state of the show as it is now."""
        controls = self.controls
        return status_of(
            self._origin,
            self.watch,
            self.acts,
            self.loop,
            controls.takes,
            controls.playback,
        )

    def _open_takes(self) -> Takes:
        """Takes that may be started, and the recording of the whole show that was asked for."""
        files = self._settings.files
        recorder = None
        if files.record is not None:
            set_aside(files.record, self._warn)
            recorder = self._open_recorder(files.record)
            self._closing.callback(self.report.kept, recorder)  # once it is closed
        takes = Takes(
            self._stream,
            files.takes or files.record or Path("take.mcap"),
            self._open_recorder,
            tell=self._tell,
            warn=self._warn,
            whole=recorder,
            waits=loses_no_frame(self._source),
            clock=self._clock,
        )
        return self._closing.enter_context(takes)

    def _open_recorder(self, path: Path) -> Recorder:
        source = provenance(self._origin)
        return Recorder(path, self._stream.skeleton, source=source, tell=self._warn)
