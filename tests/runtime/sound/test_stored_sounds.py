"""Sounds in the file of a session, and in the videos that are rendered of it."""

from __future__ import annotations

import json
import wave
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from runtime.cli.command_line import main
from runtime.output.files.video import Video
from runtime.session import edits
from runtime.session.files.store import SessionStore
from runtime.sound.sound import Sound
from tests.runtime.session.sessions import chain, session, take
from tests.runtime.sound.clicks import clicks, moments_in_video
from tests.runtime.tentacle import make_show, make_tentacle

FRAME = 1.0 / 30.0


def stored(path: Path, sound: Sound) -> SessionStore:
    """A store with one take that carries a sound."""
    store = SessionStore(path)
    store.sound = sound
    made = replace(take(0.5), sound=store.keep_sound())
    store.keep(made.performance, chain())
    store.versions.do(edits.with_take(session(), made, 0.5), "record")
    return store


def test_a_sound_is_kept_in_the_sessions_zip_as_wav(tmp_path: Path) -> None:
    path, sound = tmp_path / "s.bunraku", clicks(0.25, channels=2)
    store = stored(path, sound)
    saved = store.session
    store.close()
    name = f"sounds/{saved.takes[0].sound}"
    with zipfile.ZipFile(path) as packed, packed.open(name) as file, wave.open(file) as read:
        assert read.readframes(read.getnframes()) == sound.samples.tobytes()
    again = SessionStore(path)
    assert again.session == saved
    assert again.notes == []
    again.close()


def test_a_long_silence_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    stored(path, Sound(np.zeros((40 << 20, 1), np.int16), 48_000)).close()  # 80 MB of zeros
    again = SessionStore(path)
    assert (again.notes, bool(again.session.takes[0].sound)) == ([], True)
    again.close()


@pytest.mark.parametrize("damage", ["missing", "changed"])
def test_a_damaged_sound_leaves_its_take(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "s.bunraku"
    store = stored(path, clicks(0.25))
    file = store.folder.sounds / store.session.takes[0].sound
    store.write()
    store.folder.leave()
    if damage == "missing":
        file.unlink()
    else:
        file.write_bytes(clicks(0.5).wav)
    again = SessionStore(path)
    assert again.session.takes[0].sound == ""
    assert "the sound of take 1 (take of 0.5) is lost" in again.notes
    again.close()


def test_a_session_of_the_version_before_has_no_sound(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    store = stored(path, clicks(0.25))
    store.write()
    document = json.loads((store.folder.path / "session.json").read_text())
    del document["takes"][0]["sound"]
    (store.folder.path / "session.json").write_text(json.dumps(document | {"version": 2}))
    store.folder.leave()
    again = SessionStore(path)
    assert again.session.takes[0].sound == ""
    again.close()


@pytest.mark.parametrize("suffix", ["mp4", "mov", "mkv", "webm"])
def test_a_video_has_its_sound_in_time(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("av")
    (tmp_path / "a.wav").write_bytes(clicks(0.5, 1.25, 2.0, 2.9).wav)
    path = tmp_path / f"a.{suffix}"
    show = make_show(make_tentacle(), frames=75, size=(64, 48))
    with Video(path, rate=30.0, sound=tmp_path / "a.wav") as video:
        for frame in show:
            video.write(frame)
    heard, pictures = moments_in_video(path)
    assert heard == pytest.approx([0.5, 1.25, 2.0], abs=0.003), "what comes after it is cut"
    assert pictures == pytest.approx([frame.time for frame in show], abs=0.001)


def test_a_take_carries_a_given_sound_into_the_video(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("av")
    (tmp_path / "a.wav").write_bytes(clicks(0.2, 0.6, 1.0, channels=2, rate=44_100).wav)
    path = tmp_path / "s.bunraku"
    assert (
        main(["record", "--device", "sim://wave", "--seconds", "1", str(tmp_path / "w.mcap")]) == 0
    )
    given = ["--recording", str(tmp_path / "w.mcap"), "--take", "--headless", "--fast"]
    sound = ["--sound", str(tmp_path / "a.wav")]
    assert main(["session", str(path), "--character", "paper", *given, *sound, "--at", "0.5"]) == 0
    assert main(["session", str(path), *given]) == 0  # a take without
    capsys.readouterr()
    assert main(["info", str(path)]) == 0
    takes = [line for line in capsys.readouterr().out.splitlines() if line.startswith("take ")]
    assert [line.endswith(", with sound") for line in takes] == [True, False]
    small = ["--size", "64x48", "--rate", "30"]
    assert main(["render", str(path), *small, "--video", str(tmp_path / "a.mp4")]) == 0
    heard, _ = moments_in_video(tmp_path / "a.mp4")
    assert heard == pytest.approx([0.7, 1.1], abs=FRAME), "the take ends before the last click"
    part = ["--from", "0.6", "--video", str(tmp_path / "b.mp4")]
    assert main(["render", str(path), *small, *part]) == 0
    heard, _ = moments_in_video(tmp_path / "b.mp4")
    assert heard == pytest.approx([0.1, 0.5], abs=FRAME)
    store = SessionStore(path)
    silent = edits.muted(store.session, 1, True)
    store.versions.do(silent, "mute")
    store.close()
    assert main(["render", str(path), *small, "--video", str(tmp_path / "c.mp4")]) == 0
    import av

    with av.open(str(tmp_path / "c.mp4")) as container:
        streams = container.streams.audio
        assert not streams


def test_a_sound_that_cannot_be_read_makes_no_session(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["session", str(tmp_path / "s.bunraku"), "--character", "paper", "--headless"]
    assert main([*given, "--sound", str(tmp_path / "none.wav")]) == 2
    assert "No such file" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
