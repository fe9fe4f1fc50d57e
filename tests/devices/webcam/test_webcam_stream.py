"""Webcams and films as devices: addresses, the tracker's process and its ends."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from devices.errors import InputError
from devices.mediapipe.landmark_messages import LandmarkDecoder
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.transport.live_stream import LiveStream
from devices.webcam import stream as webcam
from devices.webcam.messages import LANDMARKS, MOST_BYTES, read_message, write_message
from devices.webcam.stream import FilmClock, FilmStream, model_folder
from devices.webcam.tracker_process import CameraTransport, FilmTransport, TrackerProcess
from runtime.cli.live import for_performers, is_camera
from tests.waiting import PATIENCE

LOOPBACK = str(Path(__file__).with_name("loopback_tracker.py"))


def tracker(*steps: str) -> TrackerProcess:
    return TrackerProcess([LOOPBACK, *steps])


def wait_until(true: Callable[[], bool]) -> None:
    end, pause = time.monotonic() + PATIENCE, threading.Event()
    while not true():
        assert time.monotonic() < end
        pause.wait(0.005)


def frames_of(stream: LiveStream, count: int) -> list[SkeletonFrame]:
    frames: list[SkeletonFrame] = []

    def enough() -> bool:
        frames.extend(stream.poll())
        return len(frames) >= count

    wait_until(enough)
    return frames


# -- addresses ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("webcam://", "expected webcam://0"),
        ("webcam://front", "expected webcam://0"),
        ("webcam://films/film.mp4", "webcam:///path/film.mp4"),
        ("webcam:///no/such/film.mp4", "no file /no/such/film.mp4"),
        ("webcam:///a#b.mp4", "%23"),
        ("webcam://0?people=5", "from 1 to 4"),
        ("webcam://0?people=0", "from 1 to 4"),
        ("webcam://0?view=5", "from 10 to 170"),
        ("webcam://0?hands=left", "on or off"),
    ],
)
def test_an_address_that_makes_no_sense_is_one_line(url: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as refused:
        open_stream(url)
    assert "\n" not in str(refused.value)


def test_a_film_may_have_blanks_and_signs_in_its_name(tmp_path: Path) -> None:
    for name in ("my film.mp4", "50%.mp4"):
        (tmp_path / name).touch()
        assert webcam._film(urlsplit(f"webcam://{tmp_path}/{name}")) == tmp_path / name
    coded = f"webcam://{tmp_path}/my%20film.mp4".replace(" ", "%20")
    assert webcam._film(urlsplit(coded)) == tmp_path / "my film.mp4"
    assert webcam._film(urlsplit("webcam://2")) is None


def test_what_is_missing_or_of_another_release_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(webcam, "find_spec", lambda _name: None)
    with pytest.raises(InputError, match=r"pip install 'bunraku\[webcam\]'"):
        open_stream("webcam://0")
    monkeypatch.setattr(webcam, "find_spec", lambda name: name)
    for release in ("1.2.3", "0.10.21", "0.10.35"):
        monkeypatch.setattr(webcam, "version", lambda _name, release=release: release)
        with pytest.raises(InputError, match=rf"found {release} .*bunraku\[webcam\]"):
            open_stream("webcam://0")


def test_models_are_kept_in_the_user_s_cache() -> None:
    assert model_folder().parent.name == "bunraku"


def test_who_stands_before_a_camera_sees_a_mirror_and_a_film_is_none() -> None:
    assert is_camera("webcam://0?hands=off")
    assert not is_camera("webcam:///film.mp4")
    assert not is_camera("kinect://v2")


def test_as_many_people_are_looked_for_as_performers_are_wanted() -> None:
    assert for_performers("webcam://0", 1) == "webcam://0"
    assert for_performers("webcam://0", 2) == "webcam://0?people=2"
    assert for_performers("webcam:///f.mp4?hands=off", 3) == "webcam:///f.mp4?hands=off&people=3"
    assert for_performers("webcam://0?people=4", 2) == "webcam://0?people=4"
    assert for_performers("kinect://v2", 2) == "kinect://v2"


# -- messages -------------------------------------------------------------------------------------


def test_messages_come_out_as_they_went_in() -> None:
    pipe = io.BytesIO()
    write_message(pipe, LANDMARKS, b"one")
    write_message(pipe, LANDMARKS)
    pipe.seek(0)
    assert [read_message(pipe) for _ in range(3)] == [(LANDMARKS, b"one"), (LANDMARKS, b""), None]


@pytest.mark.parametrize("data", [b"L", b"L\x05\x00\x00\x00abc", b"L\xff\xff\xff\xff" + b"a" * 10])
def test_a_message_that_is_cut_or_too_long_is_the_end(data: bytes) -> None:
    assert MOST_BYTES < 1 << 24
    assert read_message(io.BytesIO(data)) is None


# -- the tracker's process ------------------------------------------------------------------------


def test_a_camera_gives_frames_and_says_its_troubles() -> None:
    steps = ("ready", "landmarks:3", "trouble:camera 0 gives no more pictures", "stay")
    with LiveStream(CameraTransport(lambda: tracker(*steps)), LandmarkDecoder) as stream:
        (first, *_) = frames_of(stream, 3)
        assert np.isfinite(first.positions[stream.skeleton.index("nose")]).all()
        wait_until(lambda: "no more pictures" in stream.traffic.trouble)
        assert not stream.ended
    assert stream.ended


@pytest.mark.parametrize("last", ["noise", "landmarks:1"])
def test_a_tracker_that_ends_is_started_again(last: str) -> None:
    started: list[int] = []

    def start() -> TrackerProcess:
        started.append(1)
        return tracker("ready", "landmarks:2", last if len(started) == 1 else "stay")

    with LiveStream(CameraTransport(start), LandmarkDecoder) as stream:
        frames_of(stream, 4 if last == "noise" else 5)
    assert len(started) == 2


def test_a_tracker_that_cannot_begin_says_why_in_one_line() -> None:
    with pytest.raises(InputError) as refused:
        tracker("fail:no camera 0,\nthere is none here")
    assert str(refused.value) == "cannot open webcam://: no camera 0, there is none here"
    with pytest.raises(InputError, match=r"the tracker has ended \(exit code 0\)"):
        tracker()


def test_closing_ends_the_process_also_while_it_is_waited_for() -> None:
    transport = CameraTransport(lambda: tracker("ready", "stay"))
    process = transport._tracker._process
    stream = LiveStream(transport, LandmarkDecoder)
    stream.close()
    assert process.poll() is not None
    stream.close()


def test_a_film_begins_with_the_first_poll_and_ends_after_its_last_frame() -> None:
    film = tracker("ready", "begin", "landmarks:5", "over")
    with FilmStream(FilmTransport(film), hands=False, view=60.0) as stream:
        assert not stream.ended
        frames: list[SkeletonFrame] = []

        def over() -> bool:
            frames.extend(stream.poll())
            return stream.ended

        wait_until(over)
    assert len(frames) == 5
    assert all(frame.time <= frame.arrival for frame in frames)


def test_a_film_whose_tracker_ends_is_over_and_says_so() -> None:
    film = tracker("ready", "begin", "landmarks:1")
    with FilmStream(FilmTransport(film), hands=False, view=60.0) as stream:
        wait_until(lambda: (stream.poll(), stream.ended)[1])
        assert "the tracker has ended" in stream.traffic.trouble


def test_a_film_keeps_its_own_time_however_late_its_pictures_are() -> None:
    clock = FilmClock()
    arrivals = (100.0, 100.04, 100.9, 103.0, 103.05)
    times = [clock.host_time(0.04 * row, arrival) for row, arrival in enumerate(arrivals)]
    np.testing.assert_allclose(np.diff(times), 0.04)
