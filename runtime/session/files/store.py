"""Where a session is kept: in one file, and in a folder beside it while the session is open."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.builtin import BUILTIN
from runtime.characters.side_files import files_of
from runtime.output.files.whole_file import check_suffix, check_writable, writing
from runtime.session.document import Session
from runtime.session.files.archive import SUFFIX, pack, unpack
from runtime.session.files.folder import (
    CHARACTERS,
    DOCUMENT,
    PERFORMANCES,
    RECORDINGS,
    SOUNDS,
    SessionFolder,
)
from runtime.session.files.unfinished import rescue
from runtime.session.performance import Performance
from runtime.session.versions import Versions
from runtime.sound.microphone import Microphone
from runtime.sound.sound import Sound

UNSAVED = ".unsaved"


class SessionStore:
    """Opens a session, writes each version of it to the disk, and saves it as one file.

    Args:
        path: of the file, which need not be there; ends in .bunraku.

    Attributes:
        path: as given.
        folder: the files of the open session.
        versions: the session with undo and redo.
        notes: what was lost or recovered, a line each.
        characters: for each actor of a new session its character: a built-in one, or a file in the
            session; empty where nobody has said.
        sound: that the takes to come carry; None for none.
        microphone: whose sound each take carries in its place; None for none.

    Raises:
        InputError: it cannot be read or written, is of a newer version, or is open elsewhere.
    """

    def __init__(self, path: Path) -> None:
        check_suffix(path, (SUFFIX,))
        check_writable(path)
        self.path = path
        beside = path.with_name(path.name + UNSAVED)
        self.notes: list[str] = []
        self.characters: list[str] = []
        self.sound: Sound | None = None
        self.microphone: Microphone | None = None
        recovered = (beside / DOCUMENT).is_file()
        self.folder = SessionFolder(beside)
        session = Session()
        if recovered:
            self.notes.append(f"{path} was not closed the last time: all its edits are back")
        elif path.is_file() and path.stat().st_size > 0:
            try:
                self.notes += unpack(path, beside)
            except InputError:
                self.folder.remove()
                raise
        if self.folder.exists:
            try:
                opened = self.folder.read()
            except InputError as error:
                if not recovered:
                    self.folder.remove()
                raise InputError(f"{path}: {error}") from error
            session = opened.session
            self.notes += opened.lost
        damaged = len(self.notes) > int(recovered)
        if recovered:
            finished = {take.recording for take in session.takes}
            self.notes += rescue(self.folder.recordings, finished, path)
        self.versions = Versions(session)
        if damaged and path.is_file():
            kept = path.with_name(f"{path.stem}-damaged{path.suffix}")
            kept.write_bytes(path.read_bytes())
            self.notes.append(f"the damaged file is kept as {kept}")
        self._begun, self._recovered = False, recovered
        self._written: Session | None = session if self.folder.exists else None

    @property
    def session(self) -> Session:
        """The present version of the session."""
        return self.versions.session

    def adopt(self, characters: Sequence[str]) -> list[str]:
        """Take the files of characters into a new session; return what to load in their place.

        An older session keeps its own characters.

        Args:
            characters: built-in ones, or paths; of an older session they may be left out.

        Raises:
            InputError: a new session gets no character, or a file cannot be copied.
        """
        actors = self.session.actors
        if actors and not characters:
            return [self._loaded(actor.character) for actor in actors]
        if not characters:
            raise InputError(f"{self.path} is a new session: give it a --character")
        if actors:
            return list(characters)
        self.characters = [self._adopted(number, name) for number, name in enumerate(characters, 1)]
        return list(map(self._loaded, self.characters))

    def _adopted(self, number: int, name: str) -> str:
        """Copy the files of a character; the name of the first in the session."""
        if name in BUILTIN:
            return name
        files = files_of(Path(name))
        folder = self.folder.path / CHARACTERS / str(number)
        for file, inside in files.items():
            target = folder / inside
            with writing(target):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, target)
        return f"{CHARACTERS}/{number}/{Path(name).name}"

    def _loaded(self, character: str) -> str:
        """What loads a character of the session: its name, or its path."""
        return character if character in BUILTIN else str(self.folder.path / character)

    def keep(self, performance: Performance, skeleton: Skeleton) -> None:
        """Write a performance that the session will mention: see `SessionFolder.keep`."""
        self.folder.keep(performance, skeleton)

    def keep_sound(self) -> str:
        """Write the sound that a take carries; return the name of its file, empty for no sound.

        Raises:
            InputError: the disk fails.
        """
        return "" if self.sound is None else self.folder.keep_sound(self.sound)

    def write(self) -> None:
        """Write the present version to the disk, if it is not the one written last.

        Raises:
            InputError: the disk fails; what was written before stays.
        """
        if self._written != self.session:
            self._begun = True
            self.folder.write(self.session)
            self._written = self.session

    def save(self) -> None:
        """Write the whole session as one file.

        Raises:
            InputError: the disk fails; the older file and the folder stay.
        """
        self.write()
        if self._written is not None:
            pack(self.folder.path, self._files(), self.path)

    def close(self) -> None:
        """Save, and delete the folder.

        Raises:
            InputError: the disk fails; the folder stays and is found when the session is opened.
        """
        self.save()
        self.folder.remove()

    def abandon(self) -> None:
        """Delete the folder of a session that was never worked on; else leave all as it is."""
        if not self._begun and not self._recovered:
            self.folder.remove()
        self.folder.leave()

    def _files(self) -> list[str]:
        """The files that the version that counts is made of; the JSON first."""
        session, folder = self.session, self.folder.path
        named = [f"{PERFORMANCES}/{take.performance.key}.glb" for take in session.takes]
        named += [f"{RECORDINGS}/{take.recording}" for take in session.takes if take.recording]
        named += [f"{SOUNDS}/{take.sound}" for take in session.takes if take.sound]
        characters = sorted(path for path in (folder / CHARACTERS).rglob("*") if path.is_file())
        named += [path.relative_to(folder).as_posix() for path in characters]
        there = [name for name in dict.fromkeys(named) if (folder / name).is_file()]
        return [DOCUMENT, *there]
