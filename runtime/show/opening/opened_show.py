"""Opens devices, solvers, window and files of a show, in an order that fails early."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING

from devices.stream import SkeletonStream
from replay.playback import OfRecording, playback_of, recording_of
from replay.recorded_stream import RecordedStream
from replay.recording import Recording
from runtime.characters.character import Character
from runtime.conditioning.switches import asked_for, for_live, for_recording
from runtime.control.actions import press
from runtime.control.by_hand.chooser import Chooser
from runtime.control.count_in import CountIn
from runtime.control.hands_free import HandsFree
from runtime.control.remote import PORT, Remote
from runtime.control.show_controls import ShowControls, View
from runtime.driving.by_hand.pair_words import check_named
from runtime.driving.by_hand.parts import character_parts, performer_parts
from runtime.driving.by_hand.worded import mapping_in_words
from runtime.driving.drivers import LIMB_BY_LIMB, DriverFactory
from runtime.driving.mapping import Mapping, read_mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.rehearsal import rehearse
from runtime.output.output import Output
from runtime.output.report.report import Report
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from runtime.render.camera import front_camera
from runtime.session.files.store import SessionStore
from runtime.session.kiosk import Kiosk
from runtime.session.live_session import LiveSession
from runtime.session.open_session import open_session
from runtime.session.session_takes import end_take
from runtime.show.act_group import Act, ActGroup
from runtime.show.interrupts import interrupts_deferred
from runtime.show.loop import FrameLoop
from runtime.show.match_choices import choices_of, driver_of
from runtime.show.opening.display import Display
from runtime.show.opening.written import Written
from runtime.show.outputs import check_outputs
from runtime.show.pacing import TICKS
from runtime.show.scene import Scene
from runtime.show.settings import CharacterSettings, ShowSettings, check_characters
from runtime.status.notices import Notices, SecondPress
from runtime.status.prompts import news
from runtime.status.show_status import ShowStatus, status_of
from runtime.status.stream_watch import Sight, StreamWatch

if TYPE_CHECKING:
    import moderngl


class OpenedShow:
    """Everything that a `Show` opens; `closing` closes it, in reverse order.

    Args:
        stream, characters, settings, outputs, session, context, make_scene, make_driver, clock,
            tell, warn: as of `Show`.
        closing: closes what was opened, also if the constructor fails.

    Attributes:
        display: where it is drawn.
        written: what it writes.
        loop: performs the frames.
        scene: draws them, or None where nothing is drawn.
        controls: the parts of the show that actions change.
        window_controls: the window's keys and mouse, or None without a window.
        remote: the remote control, or None.
        hands_free: does the next step when a performer makes a gesture, or None.
        notices: what happened last, for the panel.
        watch: what is seen of the performer.
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
        session: SessionStore | None,
        context: moderngl.Context | None,
        make_scene: Callable[..., Scene],
        make_driver: DriverFactory | None,
        clock: Callable[[], float],
        tell: Callable[[str], None],
        warn: Callable[[str], None],
    ) -> None:
        self._settings, self._closing = settings, closing
        self._store = session
        if session is not None:
            closing.callback(session.close)
        self._clock = clock
        self.notices = Notices(tell, warn, clock)
        self._tell, self._warn = self.notices.tell, self.notices.warn
        self._source = stream
        self._stream = closing.enter_context(RecordedStream(stream))
        check_characters(settings, len(characters))
        names = [character.name for character in characters]
        check_outputs(settings, names)
        check_named(settings.match.pairs, names)
        playback = playback_of(stream)
        if isinstance(playback, OfRecording) and settings.match.driver != "relative":
            playback.leave_out_false_start()
        self._make_driver = make_driver or driver_of(settings.match)
        if self._make_driver in LIMB_BY_LIMB and settings.match.mapping is None:
            characters = [character.limb_by_limb for character in characters]
        self.remote = self._open_remote()
        usual = for_live() if self._recording is None else for_recording()
        self._conditioning = asked_for(usual, settings.conditioning)
        first = self._performer()
        self.watch = StreamWatch(stream, live=playback_of(stream) is None, clock=clock)
        self.written = Written(
            settings,
            self._stream,
            stream,
            self._origin,
            closing,
            notices=self.notices,
            clock=clock,
        )
        self._parts = [self.report.add_character(character) for character in characters]
        own = settings.characters
        own = own if len(own) == len(characters) else own * len(characters)
        self.puppets = list(map(self._puppet, characters, own))
        self.display = Display(settings, context, closing, clock)
        self.scene = self.display.open_scene(make_scene, self.puppets, self._stream.skeleton)
        self.acts = self._open_acts(first)
        self.written.check_export(self.puppets)
        if self._recording is not None and settings.match.rehearse:
            self._rehearse(self._recording)
        with interrupts_deferred():  # files come last, when nothing else can fail
            self.loop = self._open_loop(outputs)
            self.controls = self._open_controls()
        self.hands_free = self._open_hands_free()
        self.window_controls = self.display.open_controls(self.scene, self.controls, self.status)
        closing.callback(self.display.make_current)  # for outputs that draw, and for the scene

    @property
    def report(self) -> Report:
        """The figures of the show."""
        return self.written.report

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
        """Report when a live performer comes, goes or comes back; warn of unusable data."""
        changed = self.watch.changed() if self._recording is None else None
        if changed is not None:
            tell = self._warn if changed[1].sight is Sight.NOT_UNDERSTOOD else self._tell
            tell(news(*changed, self._origin))

    @property
    def _origin(self) -> str:
        return self._settings.origin or type(self._source).__name__

    @property
    def _recording(self) -> Recording | None:
        return recording_of(self._source)

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

    def _open_acts(self, first: Performer) -> list[Act]:
        """Give each performer one character, and all remaining characters to the last."""
        count = self._settings.match.performers
        acts = []
        for part in range(count):
            puppets = self.puppets[part : None if part == count - 1 else part + 1]
            performer = first if part == 0 else self._performer()
            acts.append(Act(performer, puppets, self._open_match_session(performer, puppets)))
        if self.scene is not None:
            self.scene.performers = [part for part, act in enumerate(acts) for _ in act.puppets]
        return acts

    def _open_match_session(self, performer: Performer, puppets: list[Puppet]) -> MatchSession:
        match = self._settings.match
        # Only a window's camera can be walked round the stage. A camera that merely steps back to
        # have all in view would turn by a rounding error, and the bytes of a cache with it.
        scene, front = (self.scene if self.display.window else None), front_camera()
        return MatchSession(
            performer,
            puppets,
            lambda: (front if scene is None else scene.camera).view_rotation,
            choices_of(
                match,
                recorded=self._recording is not None,
                attended=self.display.window is not None,
            ),
            [self._by_hand(performer, puppet) for puppet in puppets],
            make_driver=self._make_driver,
        )

    def _by_hand(self, performer: Performer, puppet: Puppet) -> Mapping | None:
        """What the settings let drive a puppet; None for a match."""
        match, character = self._settings.match, puppet.character
        if match.mapping is not None:
            return read_mapping(match.mapping, performer.skeleton, character.skeleton)
        if not match.pairs:
            return None
        bound = puppet.bound_skeleton
        return mapping_in_words(
            match.pairs,
            character.name,
            performer_parts(performer.skeleton),
            character_parts(character, bound),
            bound,
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

    def _open_loop(self, own: Sequence[Output]) -> FrameLoop:
        characters = (puppet.character for puppet in self.puppets)
        parts = list(zip(characters, self._parts, strict=True))
        outputs = self.written.open_outputs(parts, own, self._rate)
        loop = FrameLoop(
            self._stream,
            self.acts,
            report=self.report,
            scene=self.scene,
            outputs=outputs,
            conditioning=self._conditioning,
            shown=self.display.shown,
            watch=self.watch,
            clock=self._clock,
        )
        self._closing.callback(self.complete_report)
        return loop

    def _open_controls(self) -> ShowControls:
        matching = ActGroup(self.acts)
        session = self._open_session(matching)
        takes = self.written.open_takes(None if session is None else session.recordings)
        if session is not None:
            self._closing.callback(end_take, session, takes)
        count_in = CountIn(self._settings.flow.count_in)
        self.loop.before = count_in.follow
        return ShowControls(
            match_controls=matching,
            conditioning=self._conditioning,
            loop=self.loop,
            puppets=self.puppets,
            takes=takes,
            session=session,
            notices=self.notices,
            chooser=Chooser(
                matching,
                self.puppets,
                self._stream.skeleton,
                self.scene,
                self.notices,
                recorded=self._recording is not None,
            ),
            leave_asked=SecondPress(self._clock),
            count_in=count_in,
            playback=playback_of(self._stream) if session is None else session.transport,
            scene=self.scene,
            view=View() if self._settings.kiosk is None else View(panel=False, full_screen=True),
        )

    def _open_hands_free(self) -> HandsFree | None:
        kind = self._settings.flow.hands_free
        return HandsFree(kind, self.acts, self.controls, press) if kind else None

    def _open_session(self, matching: ActGroup) -> LiveSession | None:
        if self._store is None:
            return None
        drive, tell, warn = self._settings.match.driver, self._tell, self._warn
        session = open_session(
            self._store, self.acts, matching, drive, clock=self._clock, tell=tell, warn=warn
        )
        self.loop.goes_on = lambda: session.goes_on
        if self._settings.kiosk is not None:
            session.kiosk = Kiosk(session.transport, self._settings.kiosk.patience)
        return session

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
            controls.session,
            controls.chooser,
            controls.count_in,
            self.hands_free,
        )
