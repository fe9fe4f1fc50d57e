"""`bunraku edit`: changes a session by a list of edits, without a window."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from devices.errors import InputError

if TYPE_CHECKING:
    from runtime.session.document import Session

HELP = "change a session by a list of edits"
USAGE = "SESSION.bunraku [--script EDITS.json] [--out OTHER.bunraku]"
MOST_BYTES = 16 << 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    needed = parser.add_argument_group("needed")
    needed.add_argument("session", type=Path, metavar="SESSION.bunraku", help="the session's file")
    edits = parser.add_argument_group("what is changed")
    edits.add_argument(
        "--script",
        type=Path,
        metavar="EDITS.json",
        help='edits such as [{"edit": "move", "clip": 2, "start": 1.5}]; docs/session.md lists all '
        "(default: only print what the session contains)",
    )
    edits.add_argument(
        "--out",
        type=Path,
        metavar="OTHER.bunraku",
        help="write the changed session to this new file (default: change SESSION.bunraku)",
    )


def run(options: argparse.Namespace) -> int:
    """Do the edits, all or none; print what the session holds then."""
    from runtime.cli.sessions.contents import lines_of
    from runtime.session.files.archive import SUFFIX
    from runtime.session.files.folder import Opened

    path: Path = options.session
    if not path.is_file():
        raise InputError(f"there is no session {path}; `bunraku session` makes one")
    if path.suffix.lower() != SUFFIX:
        raise InputError(f"{path} is no session: its name does not end in {SUFFIX}")
    edits = [] if options.script is None else _read(options.script)
    where = [f"edit {number} of {options.script}" for number in range(1, len(edits) + 1)]
    if options.out is None:
        session, notes = _edit(path, edits, where)
    else:
        path = options.out
        _copy(options.session, path)
        try:
            session, notes = _edit(path, edits, where)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
    print("\n".join(lines_of(path, Opened(session, tuple(notes)))))
    return 0


def _copy(path: Path, out: Path) -> None:
    """Copy a session to a file that is not there yet.

    Raises:
        InputError: it is there, cannot be written, or is no name of a session.
    """
    import shutil

    from runtime.output.files.whole_file import check_suffix, whole_file
    from runtime.session.files.archive import SUFFIX

    check_suffix(out, (SUFFIX,))
    if out.exists():
        raise InputError(f"{out} is there already; give --out another name")
    with whole_file(out) as partial:
        shutil.copyfile(path, partial)


def _edit(path: Path, edits: list[dict[str, Any]], where: list[str]) -> tuple[Session, list[str]]:
    """Edit a session's file; return the session, and what was lost or recovered."""
    from runtime.cli.sessions.edit_script import edited
    from runtime.session.files.store import SessionStore

    store = SessionStore(path)
    try:
        session = store.session
        for edit, place in zip(edits, where, strict=True):
            session = edited(session, edit, place)
        store.versions.do(session, "edit")
        store.close()
    except BaseException:
        store.abandon()
        raise
    return session, store.notes


def _read(path: Path) -> list[dict[str, Any]]:
    from devices.bounded_json import parse_json
    from replay.text_file import file_bytes

    try:
        edits = parse_json(file_bytes(path, MOST_BYTES))
    except ValueError as error:
        raise InputError(f"{path} is no list of edits: {error}") from error
    if not isinstance(edits, list) or not all(isinstance(edit, dict) for edit in edits):
        raise InputError(f'{path} is no list of edits such as [{{"edit": "mute", "clip": 1}}]')
    return edits
