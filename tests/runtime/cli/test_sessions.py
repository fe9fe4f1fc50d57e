"""The commands of a session, one after the other: session, info, edit and render."""

from __future__ import annotations

import json
import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from pygltflib import GLTF2

from replay.builtin import builtin_recording
from replay.joint_table import write_joint_table
from replay.recorder import Recorder
from runtime.characters.open_character import load_character
from runtime.cli.command_line import main
from runtime.session.files.store import SessionStore
from runtime.session.nobody import nobody_for
from tests.runtime.output.files.bvh_player import BvhPlayer
from tests.runtime.output.files.glb_player import Player
from tests.runtime.output.files.test_point_cache import read_pc2

CUBE = """mtllib look.mtl
v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 4 -1\nv 1 4 -1\nv 1 4 1\nv -1 4 1
usemtl a
f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1
"""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built-in wave, as a table."""
    wave = builtin_recording("wave")
    path = tmp_path_factory.mktemp("wave") / "wave.csv"
    with path.open("w", newline="") as file:
        write_joint_table(file, wave)
    return path


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory, recording: Path) -> Path:
    """A session of the squid with two takes."""
    path = tmp_path_factory.mktemp("saved") / "s.bunraku"
    performed(path, recording, "--character", "squid")
    performed(path, recording)
    return path


def performed(path: Path, recording: Path, *options: str) -> None:
    given = ["session", str(path), "--recording", str(recording), "--take", "--headless", "--fast"]
    assert main([*given, *options]) == 0


def edited(path: Path, out: Path, *edits: dict[str, object]) -> int:
    script = out.with_suffix(".json")
    script.write_text(json.dumps(edits))
    return main(["edit", str(path), "--script", str(script), "--out", str(out)])


def cached(path: Path, out: Path, *options: str) -> np.ndarray:
    assert main(["render", str(path), "--cache", str(out), *options]) == 0
    return read_pc2(out)[1]


def test_info_lists_takes_and_clips(saved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(saved)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith("take ") for line in lines) == 2
    assert any(line.startswith("clip        2: 0.00 to") for line in lines)


def test_edits_are_done_in_order_and_written_elsewhere(saved: Path, tmp_path: Path) -> None:
    before, out = saved.read_bytes(), tmp_path / "t.bunraku"
    assert (
        edited(
            saved,
            out,
            {"edit": "move", "clip": 2, "start": 1.0},
            {"edit": "speed", "clip": 2, "speed": 2.0},
            {"edit": "mark", "time": 1.0, "name": "second"},
        )
        == 0
    )
    store = SessionStore(out)
    clip = store.session.clip(2)
    assert (clip.start, clip.speed) == (1.0, 2.0)
    assert store.session.marks[0].name == "second"
    store.close()
    assert saved.read_bytes() == before


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        ({"edit": "fly"}, 'no edit is called "fly"'),
        ({"clip": 1}, 'it has no "edit"; there are: move,'),
        ({"edit": "mute", "clip": 1}, '"mute" takes clip, on; it has clip'),
        ({"edit": "move", "clip": 9, "start": 0.0}, "no clip 9"),
        (
            {"edit": "move", "clip": 1, "start": -5},
            '"start" of "move" is seconds, 0 or more, not -5',
        ),
        ({"edit": "move", "clip": 1, "start": True}, "is seconds, 0 or more, not true"),
        ({"edit": "move", "clip": 1, "start": None}, "is seconds, 0 or more, not null"),
        (
            {"edit": "move", "clip": [1], "start": 0.0},
            '"clip" of "move" is a whole number, not [1]',
        ),
        ({"edit": "weight", "clip": 1, "weight": 7.0}, "weight is 7.0"),
        ({"edit": "speed", "clip": 1, "speed": "fast"}, 'is a number, not "fast"'),
        ({"edit": "rename", "take": 1, "name": "  "}, "needs a name"),
        ({"edit": "rename", "take": 1, "name": 3}, "is a text, not 3"),
        ({"edit": "mute", "clip": 1, "on": 7}, "is true or false, not 7"),
        ({"edit": "mute", "clip": 1, "on": "yes"}, 'is true or false, not "yes"'),
        ({"edit": "mark", "time": float("nan"), "name": "here"}, "is seconds, 0 or more, not NaN"),
        ({"edit": "mark", "time": 1.0, "name": ""}, "the mark at 1 s needs a name"),
        ({"edit": "unmark", "time": 1.0}, "there is no mark"),
        ({"edit": "limit", "clip": 1, "nodes": "abc"}, 'or null for all, not "abc"'),
        ({"edit": "limit", "clip": 1, "nodes": ["tail"]}, 'or null for all, not ["tail"]'),
        ({"edit": "limit", "clip": 1, "nodes": []}, "would move nothing"),
        ({"edit": "limit", "clip": 1, "nodes": [1, 999]}, "squid has no node 999: its nodes are 0"),
        ({"edit": "ease", "clip": 1, "ease_in": 50, "ease_out": 0}, "cannot come and go within 50"),
        ({"edit": "trim", "clip": 1, "start": 1.5, "end": 0.5}, "the end comes first"),
        ({"edit": "trim", "clip": 1, "start": 1e3, "end": 2e3}, "nothing of it is there; it lasts"),
        ({"edit": "punch", "start": "a", "end": None}, 'seconds, 0 or more, or null, not "a"'),
        ({"edit": "raise", "clip": 1, "layers": 0.5}, "is a whole number, not 0.5"),
    ],
)
def test_a_wrong_edit_is_refused_in_one_line(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], edit: dict, says: str
) -> None:
    assert edited(saved, tmp_path / "t.bunraku", edit) == 2
    error = capsys.readouterr().err.strip().splitlines()
    assert len(error) == 1
    assert says in error[0]
    assert not (tmp_path / "t.bunraku").exists()
    assert main(["info", str(saved)]) == 0


def test_an_edited_session_replaces_no_file(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "t.bunraku"
    out.write_bytes(b"somebody's")
    assert edited(saved, out, {"edit": "mute", "clip": 1, "on": True}) == 2
    assert "is there already" in capsys.readouterr().err
    assert out.read_bytes() == b"somebody's"


def test_render_gives_the_same_bytes_from_any_moment_on(saved: Path, tmp_path: Path) -> None:
    whole = cached(saved, tmp_path / "a.pc2", "--rate", "30")
    again = cached(saved, tmp_path / "b.pc2", "--rate", "30", "--from", "0.5")
    np.testing.assert_array_equal(whole[15:], again)
    assert np.ptp(whole, axis=0).max() > 0.1


def test_exports_of_layers_show_in_other_programs_what_the_program_shows(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layered = tmp_path / "t.bunraku"
    adds = {"edit": "additive", "clip": 2, "on": True}
    assert edited(saved, layered, adds, {"edit": "move", "clip": 2, "start": 0.4}) == 0
    options = ["--rate", "10", "--to", "1.5"]
    performed = cached(layered, tmp_path / "a.pc2", *options)
    character = load_character("squid")
    to_stage = character.file_to_stage
    height = np.ptp(character.vertices[:, 1])
    assert main(["render", str(layered), *options, "--export", str(tmp_path / "a.glb")]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert re.search(r"a\.glb: 16 frames, .* MB, within [\d.]+ mm of .* corrective shapes$", said)
    player = Player(tmp_path / "a.glb")
    for number in (0, 3, 8, 15):
        expected = performed[number] @ to_stage[:3, :3].T + to_stage[:3, 3]
        off = np.linalg.norm(player.vertices(0.1 * number) - expected, axis=1)
        assert off.max() < 1e-4 * height
    assert main(["render", str(layered), *options, "--export", str(tmp_path / "a.bvh")]) == 0
    joints = BvhPlayer(tmp_path / "a.bvh")
    for number in (0, 3, 8, 15):
        nodes = player.node_matrices(0.1 * number)[:, :3, 3]
        places = joints.positions(number)
        for name, node in zip(character.skeleton.names, nodes, strict=False):
            if (written := name.replace(" ", "_")) in places:
                assert np.linalg.norm(0.01 * places[written] - node) < 1e-4 * height


def test_a_timeline_is_written_without_a_show(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("opentimelineio")
    out = tmp_path / "a.otio"
    assert main(["render", str(saved), "--timeline", str(out), "--rate", "25"]) == 0
    said = capsys.readouterr()
    assert re.search(r"a\.otio: 2 tracks, 2 clips, 0 marks, [\d.]+ kB$", said.out.strip())
    assert json.loads(out.read_text())["OTIO_SCHEMA"].startswith("Timeline")
    assert main(["render", str(saved)]) == 2
    assert "--timeline or --report" in capsys.readouterr().err
    assert main(["render", str(saved), "--timeline", str(tmp_path / "a.edl")]) == 2


def test_a_plain_skin_can_be_chosen(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--rate", "5", "--to", "1.0", "--export", str(tmp_path / "a.glb")]
    assert main(["render", str(saved), *options, "--export-within", "rigid"]) == 0
    assert ", skinned " in capsys.readouterr().out.splitlines()[-1]
    assert not GLTF2().load(str(tmp_path / "a.glb")).meshes[0].primitives[0].targets
    assert main(["render", str(saved), *options, "--export-within", "0"]) == 2
    assert "from 1e-06 to 1, got '0'" in capsys.readouterr().err


def test_a_session_holds_the_files_of_its_characters(tmp_path: Path, recording: Path) -> None:
    mesh = tmp_path / "in" / "cube.obj"
    mesh.parent.mkdir()
    mesh.write_text(CUBE)
    (mesh.parent / "look.mtl").write_text("newmtl a\nKd 1 0 0\nmap_Kd -s 1 1 1 no picture.png\n")
    path = tmp_path / "s.bunraku"
    performed(path, recording, "--character", str(mesh))
    for file in mesh.parent.iterdir():
        file.unlink()
    mesh.parent.rmdir()
    vertices = cached(path, tmp_path / "a.pc2", "--rate", "10", "--to", "0.5")
    assert vertices.shape[1] == 8
    performed(path, recording)
    assert len(SessionStore(path).session.takes) == 2


def test_a_session_ends_with_what_it_holds(
    tmp_path: Path, recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "s.bunraku"
    performed(path, recording, "--character", "squid")
    said = capsys.readouterr()
    lines = (said.out + said.err).splitlines()
    assert any(line.endswith(": 1 take, 1 clip, " + line.split(", ")[-1]) for line in lines)
    assert not any(".mcap: " in line for line in lines)


def test_a_new_session_needs_a_character(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], recording: Path
) -> None:
    options = ["--recording", str(recording), "--headless", "--fast"]
    assert main(["session", str(tmp_path / "s.bunraku"), *options]) == 2
    assert "give it a --character" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_kiosk_plays_the_session_while_nobody_is_there(saved: Path, tmp_path: Path) -> None:
    nobody = nobody_for(1.0, 30.0)
    alone = tmp_path / "nobody.mcap"
    with Recorder(alone, nobody.skeleton, tell=print) as recorder:
        for number in range(len(nobody)):
            recorder.write(nobody.frame(number))
    moved = []
    for number, options in enumerate(([], ["--kiosk", "0.2"])):
        path, cache = tmp_path / f"{number}.bunraku", tmp_path / f"{number}.pc2"
        path.write_bytes(saved.read_bytes())
        given = ["--recording", str(alone), "--headless", "--fast", "--cache", str(cache)]
        assert main(["session", str(path), *given, *options]) == 0
        moved.append(float(np.ptp(read_pc2(cache)[1], axis=0).max()))
    assert moved[0] == 0.0
    assert moved[1] > 0.05


@pytest.mark.parametrize(
    ("given", "message"), [(["--pin", "1234"], "add --kiosk"), (["--pin", "12a"], "digits")]
)
def test_a_pin_locks_a_kiosk_only(
    saved: Path, given: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with suppress(SystemExit):
        assert main(["session", str(saved), "--headless", *given]) == 2
    assert message in capsys.readouterr().err
