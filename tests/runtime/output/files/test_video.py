"""Videos: pictures at their times, and encoders that fail."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.output.files.video import Video
from runtime.output.output import PerformedFrame
from tests.runtime.tentacle import disk_of, make_show, make_tentacle

av = pytest.importorskip("av")

SIZE = (128, 96)


def record(path: Path, show: Iterable[PerformedFrame], rate: float = 30.0) -> None:
    with Video(path, rate=rate) as video:
        for frame in show:
            video.write(frame)


def decode(path: Path) -> tuple[list[float], list[NDArray[np.uint8]], float]:
    """Times [s] and pictures (H, W, 3) of all frames, and the duration [s] that the file tells."""
    with av.open(str(path)) as container:
        decoded = list(container.decode(video=0))
        pictures = [frame.to_ndarray(format="rgb24") for frame in decoded]
        told = (container.duration or 0) / av.time_base  # 0 where the file was never finished
        return [frame.time for frame in decoded], pictures, told


@pytest.mark.parametrize("name", ["a.mp4", "a.mov", "a.mkv", "a.webm", "A.MP4"])
def test_every_frame_is_shown_at_its_own_time(tmp_path: Path, name: str) -> None:
    steps = np.random.default_rng(1).uniform(0.01, 0.05, 45)
    steps[20] = 1.5  # the sensor lost the performer
    times = 1000.0 + np.cumsum(steps)
    show = make_show(make_tentacle(), frames=45, size=SIZE)
    show = [replace(frame, time=float(time)) for frame, time in zip(show, times, strict=True)]
    record(tmp_path / name, show)
    shown, pictures, duration = decode(tmp_path / name)
    np.testing.assert_allclose(shown, times - times[0], atol=1e-3)
    assert duration == pytest.approx(times[-1] - times[0], abs=0.05)
    for picture, frame in zip(pictures, show, strict=True):
        error = np.abs(picture.astype(float) - frame.picture[..., :3]).mean()
        assert error < 4.0  # of 255; chroma at half resolution blurs the edges


def test_colours_are_those_of_the_picture(tmp_path: Path) -> None:
    record(tmp_path / "a.mp4", make_show(make_tentacle(), frames=3, size=SIZE))
    with av.open(str(tmp_path / "a.mp4")) as container:
        context = container.streams.video[0].codec_context
        assert (context.color_primaries, context.color_trc, context.colorspace) == (1, 1, 1)
    picture = decode(tmp_path / "a.mp4")[1][-1]
    np.testing.assert_allclose(picture[60, 40], (200, 30, 30), atol=6)
    np.testing.assert_allclose(picture[60, 90], (30, 30, 200), atol=6)


@pytest.mark.parametrize("size", [(127, 95), (1, 1), (64, 33)])
def test_odd_sizes_grow_by_one(tmp_path: Path, size: tuple[int, int]) -> None:
    record(tmp_path / "a.mp4", make_show(make_tentacle(), frames=3, size=size))
    pictures = decode(tmp_path / "a.mp4")[1]
    assert pictures[0].shape == (size[1] + size[1] % 2, size[0] + size[0] % 2, 3)


def test_a_window_that_changes_its_size_keeps_the_first(tmp_path: Path) -> None:
    character = make_tentacle()
    show = make_show(character, frames=2, size=SIZE) + make_show(character, 4, size=(200, 60))[2:]
    record(tmp_path / "a.mp4", show)
    assert {picture.shape for picture in decode(tmp_path / "a.mp4")[1]} == {(96, 128, 3)}


def test_what_is_transparent_is_black(tmp_path: Path) -> None:
    frame = make_show(make_tentacle(), frames=1, size=SIZE)[0]
    picture = frame.picture.copy()
    picture[:, :, 3] = 0
    record(tmp_path / "a.mp4", [replace(frame, picture=picture)])
    assert decode(tmp_path / "a.mp4")[1][0].max() < 8


def test_frames_of_one_time_are_all_kept(tmp_path: Path) -> None:
    show = make_show(make_tentacle(), frames=5, size=SIZE)
    record(tmp_path / "a.mkv", [replace(frame, time=3.0) for frame in show])
    times = decode(tmp_path / "a.mkv")[0]
    np.testing.assert_allclose(times, 0.001 * np.arange(5), atol=1e-6)


def test_a_single_frame_lasts_as_long_as_the_rate_says(tmp_path: Path) -> None:
    record(tmp_path / "a.mp4", make_show(make_tentacle(), frames=1, size=SIZE), rate=25.0)
    times, _, duration = decode(tmp_path / "a.mp4")
    assert len(times) == 1
    assert duration == pytest.approx(0.04, abs=1e-3)


def test_a_show_without_frames_leaves_no_file(tmp_path: Path) -> None:
    Video(tmp_path / "a.mp4").close()
    assert not list(tmp_path.iterdir())


def test_an_interrupted_show_plays_up_to_there(tmp_path: Path) -> None:
    show = make_show(make_tentacle(), frames=20, size=SIZE)

    def interrupted() -> Iterator[PerformedFrame]:
        yield from show[:13]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record(tmp_path / "a.mp4", interrupted())
    assert len(decode(tmp_path / "a.mp4")[0]) == 13


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
@pytest.mark.parametrize("name", ["a.mp4", "a.mkv"])
def test_a_killed_show_plays_but_for_its_last_seconds(tmp_path: Path, name: str) -> None:
    program = """
        import os, signal, sys
        from pathlib import Path
        from runtime.output.files.video import Video
        from tests.runtime.tentacle import make_show, make_tentacle
        video = Video(Path(sys.argv[1]), rate=30.0)
        for frame in make_show(make_tentacle(), frames=240, size=(64, 64)):
            video.write(frame)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    command = [sys.executable, "-c", textwrap.dedent(program), str(tmp_path / name)]
    root = Path(__file__).resolve().parents[4]
    assert subprocess.run(command, cwd=root, check=False).returncode == -signal.SIGKILL
    with av.open(str(tmp_path / name)) as container:
        assert len(list(container.decode(video=0))) >= 120


def test_what_cannot_be_written_is_refused_before_the_show(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.mp4, \.m4v, \.mov, \.mkv, \.webm"):
        Video(tmp_path / "a.avi")
    with pytest.raises(InputError, match="there is no folder"):
        Video(tmp_path / "missing" / "a.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux's /dev/full")
def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").symlink_to("/dev/full")
    with pytest.raises(InputError, match=r"a\.mp4: No space left on device"):
        record(tmp_path / "a.mp4", make_show(make_tentacle(), frames=90, size=SIZE))


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv"])
@pytest.mark.parametrize("missing", [20, 500, 2_000, 30_000])  # in the trailer, in a piece
def test_a_disk_that_fills_leaves_what_plays(tmp_path: Path, name: str, missing: int) -> None:
    frame = make_show(make_tentacle(), frames=1, size=(64, 48))[0]
    noise = np.random.default_rng(0).integers(0, 256, (70, 48, 64, 4)).astype(np.uint8)
    noise[..., 3] = 255
    show = [replace(frame, time=index / 30, picture=picture) for index, picture in enumerate(noise)]
    record(tmp_path / name, show)
    size = (tmp_path / name).stat().st_size
    with disk_of(size - missing), pytest.raises(InputError, match="File too large"):
        record(tmp_path / name, show)
    assert 30 <= len(decode(tmp_path / name)[0]) <= 70
