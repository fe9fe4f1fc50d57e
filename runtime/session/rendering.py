"""A saved session as a show without a performer, frame by frame."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Self

from devices.errors import InputError
from runtime.characters.builtin import BUILTIN
from runtime.characters.open_character import load_character
from runtime.session.actor_layers import ActorLayers, Cue
from runtime.session.files.archive import unpack
from runtime.session.files.folder import SOUNDS, SessionFolder
from runtime.session.nobody import nobody_for
from runtime.show.open_stream import play
from runtime.show.settings import FileSettings, MatchSettings, ShowSettings
from runtime.show.show import Show
from runtime.sound.mix import heard_in, write_mix
from runtime.sound.sounds import Sounds

MOST_FRAMES = 10_000_000


class RenderedSession:
    """A range of a saved session; its file is only read.

    Args:
        path: of the session.
        start, end: [s] of the session's time; without an end to the end of the session.
        rate: frames a second.
        warn: takes one line for each part of the session that is lost.

    Attributes:
        session: all of it that is whole.
        frames: how many are rendered.

    Raises:
        InputError: it cannot be read, or the range is empty.
    """

    def __init__(
        self,
        path: Path,
        start: float,
        end: float | None,
        rate: float,
        *,
        warn: Callable[[str], None],
    ) -> None:
        self._unpacked = TemporaryDirectory()
        self._start, self._rate = start, rate
        try:
            lost = unpack(path, self._folder)
            opened = SessionFolder(self._folder).read()
            self.session = opened.session
            for line in (*lost, *opened.lost):
                warn(line)
            last = self.session.duration if end is None else end
            if not (math.isfinite(start) and math.isfinite(last) and 0.0 <= start < last):
                raise InputError(
                    f"cannot render {path} from {start:g} to {last:g} s: it lasts from 0 to "
                    f"{self.session.duration:g} s"
                )
            if (last - start) * rate > MOST_FRAMES:
                raise InputError(f"cannot render more than {MOST_FRAMES} frames; render parts")
            self._seconds = math.floor((last - start) * rate + 1e-6) / rate
            self.frames = round(self._seconds * rate) + 1
        except BaseException:
            self.close()
            raise

    def show(self, settings: ShowSettings, *, tell: Callable[[str], None]) -> Show:
        """Return the show that plays the range, every frame once.

        Args:
            settings: of the pictures and files.
            tell: takes one line of what happened.

        Raises:
            InputError: a file cannot be written, or a character cannot be read.
        """
        session = self.session
        settings = replace(settings, files=self._with_sound(settings.files, tell))
        drive = session.actors[0].drive if session.actors else "auto"
        match = MatchSettings(driver=drive, rehearse=False)
        characters = [self._character(actor.character) for actor in session.actors]
        stream = play(nobody_for(self._seconds, self._rate), every_frame=True)
        show = Show(
            stream, list(map(load_character, characters)), replace(settings, match=match), tell=tell
        )
        began: list[float] = []

        def cue(time: float) -> Cue:
            began[:] = began or [time]
            return Cue(
                session, self._start + time - began[0], live=False, seeks=False, recording=False
            )

        for actor, puppet in zip(session.actors, show.puppets, strict=True):
            if len(puppet.character.skeleton.names) != actor.nodes:
                show.close()
                raise InputError(
                    f"{actor.name} has {len(puppet.character.skeleton.names)} nodes, and had "
                    f"{actor.nodes} when the session was made: render it with that Bunraku"
                )
            puppet.layers = ActorLayers(actor.id, puppet, cue, frozenset)
        return show

    def _with_sound(self, files: FileSettings, warn: Callable[[str], None]) -> FileSettings:
        """The files that are written, with the sound of the range where a video is one of them."""
        heard = heard_in(self.session, Sounds(self._folder / SOUNDS, warn)) if files.video else []
        if not heard:
            return files
        mix = self._folder / "mix.wav"
        write_mix(mix, heard, self._start, self._seconds + 1.0 / self._rate)
        return replace(files, video_sound=mix)

    def close(self) -> None:
        """Delete what was unpacked; may be called twice."""
        self._unpacked.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    @property
    def _folder(self) -> Path:
        return Path(self._unpacked.name)

    def _character(self, name: str) -> str:
        return name if name in BUILTIN else str(self._folder / name)
