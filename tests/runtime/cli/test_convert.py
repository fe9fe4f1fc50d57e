"""`bunraku convert` and `info` as a user meets them: files in, files out, one line when refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.builtin.gestures import RATE
from devices.builtin.motions import motion_clip
from devices.skeleton import SkeletonFrame
from replay.formats import read_recording
from replay.joint_table import read_joint_table
from replay.mcap.writer import McapWriter
from replay.recording import Recording
from runtime.cli import main
from runtime.show.provenance import provenance

FRAMES = 40


def recorded(path: Path, performers: int = 1, rotations: bool = True) -> Path:
    """A native recording of the built-in performers, one joint of whom hides for a while."""
    act = motion_clip("show")
    with McapWriter(path, act.skeleton, source=provenance("sim://show")) as writer:
        for number in range(FRAMES):
            for performer in range(performers):
                positions = act.positions[number] + [1.5 * performer, 0.0, 0.0]
                confidence = np.ones(len(positions))
                if 10 <= number < 15:
                    positions[7], confidence[7] = np.nan, 0.0
                time = number / RATE
                turns = act.rotations[number] if rotations else None
                writer.write(
                    SkeletonFrame(time, positions, turns, confidence, performer, time + 0.01)
                )
    return path


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert main(["convert", *map(str, arguments)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    (line,) = said.err.splitlines()
    assert line.startswith("bunraku: error: ")
    return line


def assert_same(one: Recording, other: Recording) -> None:
    assert one.skeleton.names == other.skeleton.names
    for field in ("times", "positions", "rotations", "confidence", "performers", "arrivals"):
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field), err_msg=field)


@pytest.mark.parametrize("rotations", [True, False])
def test_mcap_and_table_give_each_other_back_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rotations: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    recorded(Path("a.mcap"), performers=3, rotations=rotations)
    assert main(["convert", "a.mcap", "b.csv"]) == 0
    assert main(["convert", "b.csv", "c.mcap"]) == 0
    first, again = read_recording(Path("a.mcap")), read_recording(Path("c.mcap"))
    if rotations:
        assert_same(first, again)
        assert_same(first, read_joint_table(Path("b.csv")))
    else:
        assert again.rotations is None
        np.testing.assert_array_equal(first.positions, again.positions)
    assert again.source["converted_from"] == "b.csv (Bunraku table (CSV))"


def test_bvh_to_mcap_and_back_is_the_same_motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    recorded(Path("a.mcap"))
    for step in (["a.mcap", "b.bvh"], ["b.bvh", "c.mcap"], ["c.mcap", "d.bvh"]):
        assert main(["convert", *step]) == 0
    assert "0.00 cm from the recording (median)" in capsys.readouterr().out
    first, last = read_recording(Path("b.bvh")), read_recording(Path("d.bvh"))
    assert first.skeleton.names == last.skeleton.names
    assert len(first) == len(last) == FRAMES
    assert np.abs(first.positions - last.positions).max() < 1e-5
    turned = np.abs(np.sum(first.rotations * last.rotations, axis=2))
    assert turned.min() > 1 - 1e-9


def test_each_of_several_performers_has_a_bvh_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    recorded(Path("a.mcap"), performers=3)
    assert main(["convert", "a.mcap", "b.bvh", "--unit", "m"]) == 0
    assert sorted(path.name for path in tmp_path.glob("*.bvh")) == [
        "b-0.bvh", "b-1.bvh", "b-2.bvh",
    ]  # fmt: skip
    assert main(["convert", "a.mcap", "b.bvh", "--performer", "1"]) == 0
    one = Path("b-1.bvh").read_text()
    assert len(one.splitlines()) == len(Path("b.bvh").read_text().splitlines())
    assert 0.5 < float(one.splitlines()[-1].split()[0]) < 2.5  # metres, 1.5 m aside
    assert main(["convert", "a.mcap", "c.mcap", "--performer", "2"]) == 0
    assert set(read_recording(Path("c.mcap")).performers) == {2}
    capsys.readouterr()
    assert "known performers: 0, 1, 2" in refused(capsys, "a.mcap", "d.mcap", "--performer", "3")


def test_nothing_is_overwritten_silently(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    recorded(Path("a.mcap"), performers=2)
    Path("b-1.bvh").write_text("mine")
    assert "b-1.bvh is there already" in refused(capsys, "a.mcap", "b.bvh")
    assert not Path("b-0.bvh").exists()
    assert Path("b-1.bvh").read_text() == "mine"
    assert main(["convert", "a.mcap", "b.bvh", "--force"]) == 0
    assert Path("b-1.bvh").read_text().startswith("HIERARCHY")
    capsys.readouterr()
    before = Path("a.mcap").read_bytes()
    assert "is the recording itself" in refused(capsys, "a.mcap", "./a.mcap", "--force")
    assert Path("a.mcap").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a.mcap", "b.fbx"], ".mcap, .bvh, .csv"),
        (["a.mcap", "b"], ".mcap, .bvh, .csv"),
        (["a.mcap", "nowhere/b.bvh"], "no folder nowhere"),
        (["none.mcap", "b.bvh"], "cannot read none.mcap"),
        (["notes.txt", "b.bvh"], "notes.txt is not a recording"),
        (["a.mcap", "b.mcap", "--unit", "cm"], "--unit says nothing about a .mcap file"),
        (["a.mcap", "b.csv", "--rate", "30"], "--rate says nothing about a .csv file"),
        (["a.mcap", "b.bvh", "--rate", "1e7"], "too many; give a lower rate"),
        (["a.mcap", "b.bvh", "--unit", "parsec"], "--unit"),
        (["a.mcap", "b.bvh", "--performer", "-1"], "--performer"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    recorded(Path("a.mcap"))
    Path("notes.txt").write_text("remember the milk")
    assert words in refused(capsys, *arguments)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "notes.txt"]


def test_a_cut_recording_is_mended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    whole = recorded(Path("a.mcap")).read_bytes()
    Path("cut.mcap").write_bytes(whole[: len(whole) * 3 // 4])
    assert main(["convert", "cut.mcap", "mended.mcap"]) == 0
    assert "not finished" in capsys.readouterr().out
    cut, mended = read_recording(Path("cut.mcap")), read_recording(Path("mended.mcap"))
    assert 0 < len(cut) < FRAMES
    assert_same(cut, mended)
    assert mended.notes == ()
    assert "not finished" in mended.source["notes"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "performer,time,arrival\n0,0,0\n",
        "performer,time,arrival,a.x\n0,0,0,1\n",
        "h\n0,0,nan,1,2\n",
        "h\n0,zero,nan,1,2,3,1\n",
        "h\nnan,0,nan,1,2,3,1\n",
        "h\n0,inf,nan,1,2,3,1\n",
        "h\n0,0,nan,1,2,3,1\n0,0,nan\n",
    ],
)
def test_a_damaged_table_is_one_clear_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    path = tmp_path / "a.csv"
    skeleton = '{"names": ["a"], "parents": [-1], "rest_positions": [[0, 0, 0]]}'
    path.write_text(f"# bunraku.skeleton {skeleton}\n{text}")
    assert str(path) in refused(capsys, path, tmp_path / "b.mcap")
    path.write_text(f"# bunraku.skeleton nonsense\n{text}")
    assert str(path) in refused(capsys, path, tmp_path / "b.mcap")


def test_a_table_that_was_edited_is_put_in_order(tmp_path: Path) -> None:
    skeleton = '{"names": ["a"], "parents": [-1], "rest_positions": [[0, 0, 0]]}'
    rows = "h\n0,7.5,nan,1,2,3,9\n0,7.0,7.25,nan,2,3,1\n"
    path = tmp_path / "a.csv"
    path.write_text(f"# bunraku.skeleton {skeleton}\n{rows}")
    table = read_joint_table(path)
    assert table.times.tolist() == [0.0, 0.5]
    assert table.arrivals.tolist()[0] == 0.25
    assert np.isnan(table.positions[0]).all()
    assert table.confidence.tolist() == [[0.0], [1.0]]


@pytest.mark.parametrize(
    "name",
    [
        "kinect/azure_gymtrainer/26_07_15_56_53.csv",
        "kinect/v1_msraction3d/a01_s01_e01_skeleton3D.txt",
        "kinect/v2_laban/Ges01_wavehand.csv",
        "kinect/v2_ntu/S001C001P001R001A001.skeleton",
        "leap/leap_view_v1/sample.ldj",
        "mediapipe/derived_pose33_world.csv",
    ],
)
def test_every_sensors_files_become_every_kind(name: str, shared: Path, tmp_path: Path) -> None:
    first = read_recording(shared / name)
    for suffix in (".mcap", ".csv"):
        out = tmp_path / f"out{suffix}"
        assert main(["convert", str(shared / name), str(out)]) == 0
        again = read_recording(out)
        np.testing.assert_array_equal(again.positions, first.positions)
        np.testing.assert_array_equal(again.performers, first.performers)
    assert main(["convert", str(shared / name), str(tmp_path / "out.bvh")]) == 0
    for path in tmp_path.glob("*.bvh"):
        there = read_recording(path)
        assert set(first.skeleton.names) <= set(there.skeleton.names)
        assert there.seconds == pytest.approx(first.seconds, rel=0.2, abs=0.1)


def test_a_recording_says_where_it_came_from(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    facts = provenance("zmq+tcp://me:secret@stage:5570?mode=lossless")
    assert facts["origin"] == "zmq+tcp://stage:5570?mode=lossless"
    assert provenance("C:\\take.mcap")["origin"] == "C:\\take.mcap"
    assert provenance("http://[")["origin"] == "http://["
    path = recorded(tmp_path / "a.mcap", performers=2)
    assert main(["info", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "origin      sim://show" in lines
    assert any(line.startswith("began       20") for line in lines)
    assert sum(f"{FRAMES} frames, 0.000 to 0.650 s" in line for line in lines) == 2
