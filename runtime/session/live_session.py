"""A session in a running show: plays its clips, records takes into it, and undoes edits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.puppet.puppet import Puppet
from runtime.session import edits
from runtime.session.actor_layers import ActorLayers, Cue
from runtime.session.document import Session, Take
from runtime.session.files import unfinished
from runtime.session.files.store import SessionStore
from runtime.session.kiosk import Kiosk
from runtime.session.live_setups import LiveSetups
from runtime.session.onion_skin import Ghost, OnionSkin
from runtime.session.performance import Performance
from runtime.session.transport import Mode, Transport


@dataclass(frozen=True, slots=True)
class StagedActor:
    """A character of the show that is an actor of the session.

    Attributes:
        actor: its id in the session.
        puppet: on the stage.
        seen: whether its performer is in view.
        performs: whether its performer moves it now.
        named: the nodes that its driver names as driven.
        parts: what drives what, a line each.
    """

    actor: int
    puppet: Puppet
    seen: Callable[[], bool]
    performs: Callable[[], bool]
    named: Callable[[], frozenset[int]]
    parts: Callable[[], Sequence[str]]


class LiveSession:
    """Connects a session with the characters of a show.

    Args:
        store: where it is kept.
        staged: the characters, in the order of the session's actors.
        setups: of the actors.
        armed: whether the performer of a puppet is recorded, and moves it.
        tell: takes one line when something has happened.
        warn: takes one line on a fault.

    Attributes:
        store: as given.
        transport: where the session's time stands.
        kiosk: plays the session while nobody is seen; None where somebody operates the show.
    """

    def __init__(
        self,
        store: SessionStore,
        staged: Sequence[StagedActor],
        setups: LiveSetups,
        armed: Callable[[Puppet], bool],
        *,
        tell: Callable[[str], None],
        warn: Callable[[str], None],
    ) -> None:
        self.store = store
        self.transport = Transport(lambda: self.session.duration)
        self.kiosk: Kiosk | None = None
        self._staged, self._setups, self._armed = staged, setups, armed
        self._tell, self._warn = tell, warn
        self._time = float("nan")
        self._start = 0.0
        self._layers = [self._layered(one) for one in staged]
        self._onion_skin = OnionSkin(self._layers)
        self._recorded: list[ActorLayers] = []
        self._last: list[int] = []  # the clips of the newest take

    @property
    def session(self) -> Session:
        """The present version of the session."""
        return self.store.session

    @property
    def goes_on(self) -> bool:
        """Whether the show goes on while no performer sends frames."""
        return self.kiosk is not None or self.transport.mode is not Mode.REHEARSING

    @property
    def recordings(self) -> Path:
        """The folder for recordings of the performers' frames."""
        return self.store.folder.recordings

    # -- Edits -------------------------------------------------------------------------------------

    def edit(self, session: Session, done: str) -> None:
        """Replace the session by an edited one, as one step, and write it to the disk."""
        self.store.versions.do(session, done)
        self._write()

    def drag(self, session: Session, done: str) -> None:
        """Replace the session while something is dragged; the whole drag is one step."""
        self.store.versions.drag(session, done)

    def drop(self) -> None:
        """End a drag, and write the session to the disk."""
        self.store.versions.drop()
        self._write()

    def note_setups(self) -> None:
        """Note how the actors are driven, where that has changed, as a step that can be undone."""
        if self.kiosk is None and self._setups.note():
            self._write()

    def undo(self) -> None:
        """Go back by one step, and say what was undone."""
        self.note_setups()
        done = self.store.versions.undone
        self._tell(f"undone: {done}" if self.store.versions.undo() else "nothing to undo")
        self._setups.bring_back()
        self._write()

    def redo(self) -> None:
        """Do again what was undone last."""
        self.note_setups()
        done = self.store.versions.redone
        self._tell(f"done again: {done}" if self.store.versions.redo() else "nothing to do again")
        self._setups.bring_back()
        self._write()

    def say(self, line: str) -> None:
        """Say one line to the puppeteer."""
        self._tell(line)

    def save(self) -> None:
        """Write the session as one file."""
        try:
            self.store.save()
        except InputError as error:
            self._warn(str(error))
        else:
            self._tell(f"saved {self.store.path}")

    # -- Takes -------------------------------------------------------------------------------------

    @property
    def recording(self) -> bool:
        """Whether a take is recorded."""
        return self.transport.mode is Mode.RECORDING

    @property
    def performed(self) -> list[ActorLayers]:
        """The armed characters that performers move now."""
        return [
            layers
            for layers, one in zip(self._layers, self._staged, strict=True)
            if one.performs() and self._armed(one.puppet)
        ]

    def stand_by(self) -> bool:
        """Let performers move the characters where a take is to begin; return whether it can."""
        if not self.performed:
            self._warn(
                "no performer moves a selected character yet: step into view, and press Enter to "
                "use the match; then r records"
            )
            return False
        if not self.recording:
            self.transport.rehearse()
        return True

    def record(self) -> bool:
        """Record the armed characters from the session's time on; return whether one can be."""
        if not self.stand_by():
            return False
        self._recorded = self.performed
        self._start = self.transport.position
        for layers in self._recorded:
            layers.start()
        self.transport.record()
        if self.store.microphone is not None:
            self.store.microphone.begin()
        self._tell(f"recording {self._next_name}")
        return True

    def running(self, recording: str) -> None:
        """Note on the disk that the take that has begun is recorded in this file."""
        try:
            unfinished.begin(self.recordings, recording, self._start)
        except InputError as error:
            self._warn(str(error))

    def stop(self, recording: str = "") -> None:
        """End the take: it becomes a clip where it was performed, and can be played from there.

        Args:
            recording: the file of the performers' frames in the session; empty for none.
        """
        if not self.recording:
            return
        takes = [(layers, layers.stop()) for layers in self._recorded]
        made = [(one, each) for one, each in takes if each is not None]
        if self.store.microphone is not None:
            self.store.sound = self.store.microphone.end()
        self._add(made, self._start, recording, self._sound() if made else "")
        unfinished.end(self.recordings)
        self.transport.rehearse()
        self.transport.go_to(self._start)

    def recall(self) -> None:
        """Make a take of what the performers did in the last seconds."""
        takes = [(layers, layers.recall()) for layers in self._layers]
        made = [(one, each) for one, each in takes if each is not None]
        if not made:
            self._tell("nobody has performed yet")
            return
        self._add(made, self.transport.position)

    def drop_last(self) -> None:
        """Remove the clips of the newest take, so that it can be performed again."""
        session = self.session
        there = {clip.id for clip in session.clips}
        gone = [number for number in self._last if number in there]
        if not gone:
            self._tell("there is no take to do again")
            return
        start = min(session.clip(number).start for number in gone)
        for number in gone:
            session = edits.without_clip(session, number)
        self.edit(session, "take away the last take")
        self.transport.rehearse()
        self.transport.go_to(start)

    def _sound(self) -> str:
        """The file of the sound that a take carries; empty where it cannot be kept."""
        try:
            return self.store.keep_sound()
        except InputError as error:
            self._warn(f"{error}; the take has no sound")
            return ""

    @property
    def _next_name(self) -> str:
        """What the next take is called: all that is recorded at once has one name."""
        names = {take.name for take in self.session.takes}
        number = len(names) + 1
        while f"take {number}" in names:
            number += 1
        return f"take {number}"

    def _add(
        self,
        made: Sequence[tuple[ActorLayers, Performance]],
        start: float,
        recording: str = "",
        sound: str = "",
    ) -> None:
        """Add a take and a clip for each actor, as one step; the sound goes with the first."""
        if not made:
            self._tell("the take holds no frame: it is not kept")
            return
        session, speed = self.session, 1.0 / self.transport.speed
        self._last = []
        name = self._next_name
        for layers, performance in made:
            one = self._staged[self._layers.index(layers)]
            parts = tuple(one.parts())
            take = Take(0, name, layers.actor, performance, recording, parts, sound)
            try:
                self.store.keep(performance, _skeleton(one.puppet))
            except InputError as error:
                self._warn(f"{error}; the take is not kept")
                continue
            session = edits.with_take(session, take, start, speed=min(max(speed, 1 / 16), 16.0))
            self._last.append(session.clips[-1].id)
            sound = ""
        if self._last and session.punch is not None:
            session = self._punched(session)
        if len(session.takes) == len(self.session.takes):
            return  # none could be kept, which was told
        self.edit(session, f"record {name}")
        seconds = max(performance.duration for _, performance in made)
        outside = "" if self._last else ", all of it outside the range that is recorded"
        self._tell(f"kept {name}: {seconds:.1f} s{outside}")

    def _punched(self, session: Session) -> Session:
        """The session with its newest clips cut to the range that is to be recorded."""
        assert session.punch is not None
        start, end = session.punch
        for number in list(self._last):
            clip = session.clip(number)
            first, last = max(start, clip.start), min(end, clip.end)
            if last - first < 1e-3:
                session = edits.without_clip(session, number)
                self._last.remove(number)
            else:
                session = edits.trimmed(session, number, first, last)
        return session

    def ghosts(self) -> Sequence[Ghost]:
        """Return the characters some moments before and after the one that is paused at."""
        if self.transport.mode is not Mode.PAUSED:
            return ()
        return self._onion_skin.ghosts(self.session, self.transport.position)

    # -- Frames ------------------------------------------------------------------------------------

    def _layered(self, one: StagedActor) -> ActorLayers:
        def cue(time: float) -> Cue:
            if time != self._time:
                self._time = time
                self.transport.advance(time)
                if self.kiosk is not None:
                    self.kiosk.follow(time, seen=any(each.seen() for each in self._staged))
            mode = self.transport.mode
            live = mode in (Mode.REHEARSING, Mode.RECORDING) and self._armed(one.puppet)
            performs = one.performs()
            return Cue(
                self.session,
                self.transport.position,
                live and performs,
                live and not performs and one.seen(),
                mode is Mode.RECORDING,
            )

        layers = ActorLayers(one.actor, one.puppet, cue, one.named)
        one.puppet.layers = layers
        return layers

    def _write(self) -> None:
        try:
            self.store.write()
        except InputError as error:
            self._warn(str(error))


def _skeleton(puppet: Puppet) -> Skeleton:
    """The nodes of a puppet at rest, as its takes have them."""
    tree = puppet.bound_skeleton.tree
    return Skeleton(puppet.character.skeleton.names, tree.parents, tree.positions)
