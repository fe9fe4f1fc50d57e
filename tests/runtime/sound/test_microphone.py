"""What a source of samples gives while a take is recorded is the take's sound."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.cli import main
from runtime.control.actions import press
from runtime.session.files.store import SessionStore
from runtime.show.open_stream import play
from runtime.show.settings import ShowSettings
from runtime.show.show import Show
from runtime.sound.microphone import Microphone, SystemMicrophone
from runtime.sound.sound import Samples, read_sound

RATE, BLOCK, LATE = 6000, 100, 40  # samples a second, in a block at 60 Hz, and of latency


class Counting:
    """Gives the numbers of the samples, as a microphone gives sound."""

    rate = RATE
    latency = LATE / RATE

    def __init__(self) -> None:
        self.given = 0
        self.closed = False

    def start(self, give: Callable[[Samples], None]) -> None:
        self._give = give

    def close(self) -> None:
        self.closed = True

    def block(self) -> None:
        samples = np.arange(self.given, self.given + BLOCK, dtype=np.int16)[:, None]
        self.given += BLOCK
        self._give(samples)
        samples[:] = -1  # a source uses its buffer again


def test_a_take_carries_what_was_heard_while_it_was_recorded(tmp_path: Path) -> None:
    source = Counting()
    store = SessionStore(tmp_path / "s.bunraku")
    stream = play(builtin_recording("wave"), every_frame=True, loop=True)
    characters = [load_character("mannequin")]
    with (
        Microphone(source) as store.microphone,
        Show(stream, characters, ShowSettings(), session=store) as show,
    ):
        for frames in (3, 20, 5, 10):
            for _ in range(frames):
                show.tick()
                source.block()
            press("record", show.controls)
        assert show.controls.session is not None
        takes = show.controls.session.session.takes
    assert source.closed
    again = SessionStore(tmp_path / "s.bunraku")
    sounds = [read_sound(again.folder.path / "sounds" / take.sound) for take in takes]
    again.close()
    for sound, first, frames in zip(sounds, (3, 28), (20, 10), strict=True):
        assert sound.rate == RATE
        expected = np.arange(first * BLOCK + LATE, (first + frames) * BLOCK)
        np.testing.assert_array_equal(sound.samples[:, 0], expected)


def test_nothing_is_heard_before_the_beginning_and_after_the_end() -> None:
    source = Counting()
    microphone = Microphone(source)
    source.block()
    assert microphone.end() is None
    microphone.begin()
    assert microphone.end() is None
    source.block()
    assert microphone.end() is None


def test_a_machine_without_the_library_is_told_so_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    with pytest.raises(InputError, match=r"bunraku\[microphone\]"):
        SystemMicrophone("default")
    path = tmp_path / "s.bunraku"
    command = ["session", str(path), "--character", "squid", "--microphone", "default"]
    assert main([*command, "--headless"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "needs the extra" in error
    assert not path.exists()
