"""The folder of an open session: every edit is on the disk before the next one begins.

What is large never changes: a performance is a file with the name of its content, a recording is
written once. An edit only replaces the JSON, in one step, so a session that is killed at any moment
comes back with all edits but perhaps the last.
"""

from __future__ import annotations

import json
import os
import shutil
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.text_file import file_bytes
from runtime.output.files.whole_file import whole_file, writing
from runtime.session.document import Session
from runtime.session.files import codec
from runtime.session.files.lock import FolderLock
from runtime.session.files.performance_file import read_performance, save_performance
from runtime.session.performance import Performance
from runtime.sound.sound import Sound, read_sound

DOCUMENT = "session.json"
PERFORMANCES, RECORDINGS, CHARACTERS = "performances", "recordings", "characters"
SOUNDS = "sounds"
FOLDERS = (PERFORMANCES, RECORDINGS, CHARACTERS, SOUNDS)
MOST_DOCUMENT = 64 << 20  # bytes


@dataclass(frozen=True, slots=True)
class Opened:
    """A session as it was read.

    Attributes:
        session: all that is whole.
        lost: what is not, a line each.
    """

    session: Session
    lost: tuple[str, ...] = ()


class SessionFolder:
    """Reads and writes the files of one session.

    No other program can open the folder until it is left, removed, or this one ends.

    Args:
        path: the folder; made if it is not there.

    Raises:
        InputError: it cannot be made, or another program works in it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = FolderLock(path)
        with writing(path):
            if not self.exists:
                self._clear()  # of a program that was killed before it had written the session
            for name in FOLDERS:
                (path / name).mkdir(exist_ok=True)
        self._performances: dict[str, Performance] = {}

    @property
    def recordings(self) -> Path:
        """Where the recordings of takes are."""
        return self.path / RECORDINGS

    @property
    def sounds(self) -> Path:
        """Where the sounds of takes are."""
        return self.path / SOUNDS

    @property
    def exists(self) -> bool:
        """Whether a session was written here."""
        return (self.path / DOCUMENT).is_file()

    def keep(self, performance: Performance, skeleton: Skeleton) -> None:
        """Write a performance, unless it is there.

        Args:
            performance: what the character did.
            skeleton: its nodes at rest, rooted as the performance has them.

        Raises:
            InputError: the disk fails.
        """
        self._performances[performance.key] = performance
        path = self._file_of(performance.key)
        if not path.is_file():
            save_performance(path, performance, skeleton)

    def keep_sound(self, sound: Sound) -> str:
        """Write a sound, unless it is there; return the name of its file.

        Raises:
            InputError: the disk fails.
        """
        path = self.sounds / f"{sound.key}.wav"
        if not path.is_file():
            with whole_file(path) as partial:
                partial.write_bytes(sound.wav)
        return path.name

    def write(self, session: Session) -> None:
        """Write the session; its performances have been kept before.

        Raises:
            InputError: the disk fails; what was written before stays.
        """
        text = json.dumps(codec.as_json(session), indent=1, allow_nan=False).encode()
        with whole_file(self.path / DOCUMENT) as partial, partial.open("wb") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())

    def read(self) -> Opened:
        """Read the session that was written last, without the takes that are damaged.

        Raises:
            InputError: the JSON cannot be read, or is of a newer version.
        """
        path = self.path / DOCUMENT
        try:
            document = parse_json(file_bytes(path, MOST_DOCUMENT))
            return self._read(document)
        except ValueError as error:
            raise InputError(f"cannot read {path}: it is damaged ({error})") from error

    def leave(self) -> None:
        """Let other programs open the folder, as it is."""
        self._lock.release()

    def remove(self) -> None:
        """Delete the folder and all that is in it."""
        self._clear()
        self._lock.remove()

    def _clear(self) -> None:
        """Delete all files, the JSON first: a session that has lost only some is never read."""
        with suppress(OSError):
            (self.path / DOCUMENT).unlink(missing_ok=True)
        for name in FOLDERS:
            shutil.rmtree(self.path / name, ignore_errors=True)
        for partial in self.path.glob(".*"):
            partial.unlink(missing_ok=True)

    def _read(self, document: object) -> Opened:
        lost: dict[str, str] = {}
        for name in codec.performances_in(document):
            try:
                self._performances[name] = self._whole(name)
            except InputError as error:
                lost[name] = str(error)
        left = codec.without_takes(document, set(lost))
        session = codec.from_json(left, self._performances.__getitem__)
        silent = [take for take in session.takes if take.sound and not self._is_heard(take.sound)]
        session = replace(
            session,
            takes=tuple(
                replace(take, sound="") if take in silent else take for take in session.takes
            ),
        )
        gone = [
            f"take {take.get('id')} ({take.get('name')}) is lost: {lost[take['performance']]}"
            for take in codec.takes_in(document)
            if take.get("performance") in lost
        ]
        gone += [f"the sound of take {take.id} ({take.name}) is lost" for take in silent]
        return Opened(session, tuple(gone))

    def _is_heard(self, name: str) -> bool:
        """Whether the sound of a name is there, with the content that the name says."""
        try:
            return f"{read_sound(self.sounds / name).key}.wav" == name
        except InputError:
            return False

    def _whole(self, name: str) -> Performance:
        """The performance of a name, which its content must have.

        Raises:
            InputError: it is not there, or was damaged.
        """
        performance = read_performance(self._file_of(name))
        if performance.key != name:
            raise InputError(f"{self._file_of(name)} was changed or damaged")
        return performance

    def _file_of(self, name: str) -> Path:
        return self.path / PERFORMANCES / f"{name}.glb"
