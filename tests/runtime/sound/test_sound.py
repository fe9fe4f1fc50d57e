"""Sounds come back from WAV and other files; what is no sound is refused in one line."""

from __future__ import annotations

import io
import wave
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from runtime.sound.mix import for_mixing
from runtime.sound.sound import LONGEST, Sound, read_sound
from tests.runtime.sound.clicks import clicks, moments_of


def written(path: Path, sound: Sound) -> Path:
    path.write_bytes(sound.wav)
    return path


@pytest.mark.parametrize("channels", [1, 2])
def test_a_wav_comes_back_to_the_bit(tmp_path: Path, channels: int) -> None:
    random = np.random.default_rng(0)
    sound = Sound(random.integers(-(1 << 15), 1 << 15, (1000, channels)).astype(np.int16), 44_100)
    read = read_sound(written(tmp_path / "a.wav", sound))
    np.testing.assert_array_equal(read.samples, sound.samples)
    assert (read.rate, read.key) == (sound.rate, sound.key)
    with wave.open(io.BytesIO(sound.wav)) as file:
        assert (file.getnchannels(), file.getframerate()) == (channels, 44_100)


@pytest.mark.parametrize(("suffix", "codec"), [("flac", "flac"), ("wav", "pcm_s24le")])
def test_other_files_are_decoded(tmp_path: Path, suffix: str, codec: str) -> None:
    av = pytest.importorskip("av")
    path, sound = tmp_path / f"a.{suffix}", clicks(0.5, 1.25, rate=44_100, channels=2)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=44_100, layout="stereo")
        frame = av.AudioFrame.from_ndarray(sound.samples.reshape(1, -1), format="s16")
        frame.sample_rate = 44_100
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    read = read_sound(path)
    np.testing.assert_array_equal(read.samples, sound.samples)


def test_a_sound_of_another_rate_keeps_its_moments() -> None:
    samples = for_mixing(clicks(0.5, 1.25, rate=44_100))
    assert samples.shape == (3 * 48_000, 2)
    assert moments_of(samples[:, 1] / 32768.0) == pytest.approx([0.5, 1.25], abs=0.001)


def test_what_is_no_sound_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("av")
    (tmp_path / "a.wav").write_bytes(b"RIFF, but no sound")
    with pytest.raises(InputError, match=r"cannot read .*a\.wav: it is no sound"):
        read_sound(tmp_path / "a.wav")
    with pytest.raises(InputError, match="No such file"):
        read_sound(tmp_path / "b.wav")
    with pytest.raises(InputError, match="holds no sound"):
        read_sound(written(tmp_path / "c.wav", clicks(seconds=0.0)))
    long = np.zeros((round((LONGEST + 1.0) * 4000), 1), np.int16)
    with pytest.raises(InputError, match="longer than 60 minutes"):
        read_sound(written(tmp_path / "d.wav", Sound(long, 4000)))
