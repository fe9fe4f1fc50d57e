"""Sessions whose program is killed, or that two programs want at once."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from devices.errors import InputError
from replay.formats import read_recording
from replay.mcap.reader import McapReader
from runtime.cli.command_line import main
from runtime.control.actions import press
from runtime.session import edits
from runtime.session.files.archive import unpack
from runtime.session.files.folder import SessionFolder
from runtime.session.files.store import SessionStore
from runtime.session.versions import Versions
from tests.runtime.session.sessions import chain, session, take
from tests.runtime.session.test_live_session import open_show, record, ticks
from tests.thorough import THOROUGH

SEEDS = 30 if THOROUGH else 10
ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.skipif(sys.platform == "win32", reason="needs processes that fork")
def test_a_killed_show_loses_at_most_its_last_action(tmp_path: Path) -> None:
    """Half are killed between two operations on the disk, half in a frame."""
    from tests.runtime.session.dying_show import digest  # not on Windows

    program = [sys.executable, "-m", "tests.runtime.session.dying_show"]
    ran = subprocess.run(
        [*program, str(tmp_path), str(SEEDS)],
        cwd=ROOT,
        env=os.environ | {"NUMBA_THREADING_LAYER": "workqueue", "NUMBA_NUM_THREADS": "1"},
        capture_output=True,  # OpenMP, the usual layer, ends every process that forks
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    lives = [json.loads(line) for line in ran.stdout.splitlines()]
    running = 0
    for seed, said in enumerate(lives):
        store = SessionStore(tmp_path / str(seed) / "show.bunraku")
        wills = [digest for what, *digest in said if what == "will"]
        dids = [digest for what, *digest in said if what == "did"]
        possible = [*dids[-1:], *wills[-1:]]
        assert not possible or [digest(store.session)] in possible, f"show {seed}"
        assert not any("lost" in note for note in store.notes), store.notes
        states = [what for what, *_ in said if what not in ("will", "did")]
        if states[-1:] == ["recording"]:
            running += 1
            (note,) = [note for note in store.notes if "a take was running" in note]
            with McapReader(tmp_path / str(seed) / "show-unfinished.mcap") as left:
                assert left.skeleton.names
            assert "show-unfinished.mcap" in note
        store.close()
        again = SessionStore(store.path)
        assert again.session == store.session
        assert again.notes == []
        again.close()
    assert len(lives) == SEEDS
    assert running > SEEDS // 10


def test_the_frames_of_a_take_that_never_ended_become_a_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "show.bunraku"
    show = open_show(path)
    record(show, 20)
    begun = show.controls.session
    assert begun is not None
    begun.transport.go_to(0.25)
    press("record", show.controls)
    ticks(show, 50)
    show.controls.takes.close()  # its frames are on the disk
    begun.store.folder.leave()  # and here the process dies
    store = SessionStore(path)
    (note,) = [note for note in store.notes if "a take was running" in note]
    assert "from 0.25 s on" in note
    kept = tmp_path / "show-unfinished.mcap"
    assert len(read_recording(kept).times) == 50
    store.close()
    assert kept.is_file()
    command = note[note.index("bunraku session") :].split()[1:]
    assert main(command) == 0
    capsys.readouterr()
    store = SessionStore(path)
    recorded = store.session.clips[-1]
    assert recorded.start == pytest.approx(0.25)
    assert recorded.length == pytest.approx(49 / 60, abs=0.05)
    store.close()


def test_a_second_program_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    store = SessionStore(path)
    with pytest.raises(InputError, match="another program has this session open"):
        SessionStore(path)
    store.versions.do(session(take(0.5)), "begin")
    store.keep(store.session.takes[0].performance, chain())
    store.close()
    other = SessionStore(path)
    assert other.session == store.session
    other.close()
    assert [each.name for each in tmp_path.iterdir()] == ["show.bunraku"]


def test_a_program_that_dies_leaves_no_lock(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    program = (
        "import os, pathlib, sys; from runtime.session.files.store import SessionStore\n"
        "store = SessionStore(pathlib.Path(sys.argv[1])); print('open', flush=True)\n"
        "sys.stdin.read()"
    )
    command = [sys.executable, "-c", program, str(path)]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"open\n"
        with pytest.raises(InputError, match="another program"):
            SessionStore(path)
        process.kill()
        process.wait()
    SessionStore(path).close()


def test_a_program_that_is_killed_while_it_opens_or_closes_loses_no_take(tmp_path: Path) -> None:
    """The folder then lacks files that the JSON names; the whole file counts."""
    path = tmp_path / "show.bunraku"
    store = SessionStore(path)
    made = edits.with_take(session(), take(1.0), 0.0)
    store.keep(made.takes[0].performance, chain())
    store.versions = Versions(made)
    store.close()
    beside = tmp_path / "show.bunraku.unsaved"
    folder = SessionFolder(beside)
    unpack(path, beside)
    for each in (beside / "performances").iterdir():
        each.unlink()
    (beside / "session.json").rename(beside / ".session.json")  # comes last, goes first
    folder.leave()
    again = SessionStore(path)
    assert again.session == made
    assert again.notes == []
    again.close()
