"""Sessions on the disk: nothing lost by a kill, what is whole read from a damaged file."""

from __future__ import annotations

import json
import random
import shutil
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.errors import InputError
from runtime.session import edits
from runtime.session.files.codec import VERSION, as_json
from runtime.session.files.performance_file import read_performance, save_performance
from runtime.session.files.store import SessionStore
from runtime.session.versions import Versions
from tests.runtime.session.sessions import chain, performance, random_edit, session, take


def filled(store: SessionStore, *angles: float) -> None:
    """Give a store's session one take for each angle, an edit each."""
    store.versions.do(session(), "begin")
    for angle in angles:
        made = take(angle)
        store.keep(made.performance, chain())
        store.versions.do(edits.with_take(store.session, made, 0.5), "record")
        store.write()


def test_a_session_comes_back_to_the_bit(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    store = SessionStore(path)
    filled(store, 1.0, -0.5)
    store.versions.do(edits.marked(store.session, 1.0, "clap"), "mark")
    saved = store.session
    store.close()
    assert [each.name for each in tmp_path.iterdir()] == ["show.bunraku"]
    again = SessionStore(path)
    assert again.session == saved
    assert again.notes == []
    again.close()


def test_a_killed_session_comes_back_with_its_last_edit(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    store = SessionStore(path)
    filled(store, 1.0, -0.5)
    store.folder.leave()  # as the end of its process does
    again = SessionStore(path)  # the first was never closed
    assert again.session == store.session
    assert "not closed" in again.notes[0]


def test_the_arrays_are_a_gltf_animation_that_others_read(tmp_path: Path) -> None:
    made = performance(1.0)
    save_performance(tmp_path / "take.glb", made, chain())
    assert read_performance(tmp_path / "take.glb").key == made.key
    other = pygltflib.GLTF2().load(str(tmp_path / "take.glb"))
    moved = {(each.target.node, each.target.path) for each in other.animations[0].channels}
    assert {(2, "rotation"), (3, "rotation"), (0, "translation")} <= moved
    assert [node.name for node in other.nodes[1:]] == list(chain().names)


def test_a_damaged_take_is_lost_alone_and_told(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    store = SessionStore(path)
    filled(store, 1.0, -0.5)
    first, second = store.session.takes
    store.close()
    whole = path.read_bytes()
    with zipfile.ZipFile(path) as packed:
        entry = packed.getinfo(f"performances/{second.performance.key}.glb")
    damaged = bytearray(whole)
    damaged[entry.header_offset + 120] ^= 0xFF
    path.write_bytes(bytes(damaged))
    again = SessionStore(path)
    assert again.session.takes == (first,)
    assert [clip.take for clip in again.session.clips] == [first.id]
    assert any("take of -0.5" in note and "lost" in note for note in again.notes)
    assert path.with_name("show-damaged.bunraku").read_bytes() == bytes(damaged)


def test_a_file_that_was_cut_short_gives_what_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    store = SessionStore(path)
    filled(store, 1.0, -0.5)
    first, second = store.session.takes
    store.close()
    with zipfile.ZipFile(path) as packed:
        entry = packed.getinfo(f"performances/{second.performance.key}.glb")
    path.write_bytes(path.read_bytes()[: entry.header_offset + 200])
    again = SessionStore(path)
    assert again.session.takes == (first,)
    assert any("cut short" in note for note in again.notes)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_damage_ends_in_more_than_one_line(
    seed: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    path = folder / "show.bunraku"
    store = SessionStore(path)
    filled(store, 1.0, -0.5)
    store.close()
    content, dice = bytearray(path.read_bytes()), random.Random(seed)
    for _ in range(dice.randint(1, 20)):
        content[dice.randrange(len(content))] = dice.randrange(256)
    path.write_bytes(bytes(content[: dice.randint(1, len(content))]))
    with suppress(InputError):  # anything else is a traceback for the user
        SessionStore(path).close()
    shutil.rmtree(folder)


def test_a_newer_version_is_refused_with_the_version_it_has(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    with zipfile.ZipFile(path, "w") as packed:
        newer = as_json(session()) | {"version": VERSION + 1}
        packed.writestr("session.json", json.dumps(newer))
    before = path.read_bytes()
    with pytest.raises(InputError, match=f"version {VERSION + 1}.*newer Bunraku"):
        SessionStore(path)
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["show.bunraku"]


@pytest.mark.parametrize("name", ["../out.glb", "performances/../../out.glb", "/tmp/out", "a:b"])
def test_no_file_leaves_the_folder(tmp_path: Path, name: str) -> None:
    path = tmp_path / "in" / "show.bunraku"
    path.parent.mkdir()
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("session.json", json.dumps(as_json(session())))
        packed.writestr(name, b"x")
    SessionStore(path)
    assert [each.name for each in tmp_path.iterdir()] == ["in"]


def test_a_bomb_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "show.bunraku"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("session.json", json.dumps(as_json(session())))
        packed.writestr("performances/a.glb", bytes(100 << 20))
    with pytest.raises(InputError, match="far more than its size"):
        SessionStore(path)


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_thousand_actions_with_undo_and_redo_give_the_same_bytes(seed: int) -> None:
    dice, versions = random.Random(seed), Versions(session(take(1.0)))
    begun = json.dumps(as_json(versions.session))
    for _ in range(1000):
        if dice.random() < 0.25:
            dice.choice([versions.undo, versions.redo])()
        else:
            made = random_edit(versions.session, dice)
            dice.choice([versions.do, versions.drag])(made, dice.choice(["a", "b"]))
    while versions.redo():
        pass
    last = json.dumps(as_json(versions.session))
    steps = 0
    while versions.undo():
        steps += 1
    assert json.dumps(as_json(versions.session)) == begun
    for _ in range(steps):
        assert versions.redo()
    assert json.dumps(as_json(versions.session)) == last
    assert not versions.redo()


def test_a_drag_is_one_step() -> None:
    versions = Versions(session(take(1.0)))
    for start in np.linspace(0.1, 2.0, 30).tolist():
        versions.drag(edits.moved(versions.session, 1, start), "move")
    versions.drop()
    versions.drag(edits.moved(versions.session, 1, 5.0), "move")
    assert versions.undo()
    assert versions.session.clip(1).start == 2.0
    assert versions.undo()
    assert versions.session.clip(1).start == 0.0
    assert not versions.undo()
    assert versions.redo()
    assert versions.redone == "move"
