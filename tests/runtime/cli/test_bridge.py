"""A bridge over real sockets on loopback: stages come and go, bridges die, keys are wrong."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
import zmq

from devices.bridge.keys import is_loopback, make_keys, read_publisher_keys, read_subscriber_keys
from devices.bridge.messages import (
    LATEST,
    LOSSLESS,
    VERSION,
    Call,
    OtherVersion,
    decode,
    encode_call,
)
from devices.bridge.stream import Bridge, BridgeStream, open_device
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from devices.stream import open_stream
from runtime.cli import main
from runtime.output.live.bridge_publisher import BridgePublisher, binding
from tests.waiting import PATIENCE

ROOT = Path(__file__).resolve().parents[3]
BODY = Skeleton(("hips", "hand"), np.array([-1, 0]), np.array([[0.0, 1.0, 0.0], [0.5, 1.0, 0.0]]))
ANYWHERE = "tcp://127.0.0.1:*"
posix_only = pytest.mark.skipif(os.name != "posix", reason="permissions and signals as POSIX has")


def frame(number: int, performer: int = 0, time: float = 0.0) -> SkeletonFrame:
    place = np.array([[number, 0.0, 0.0], [number, 1.0, 0.0]])
    return SkeletonFrame(time, place, None, np.ones(2), performer)


def numbers(frames: list[SkeletonFrame]) -> list[int]:
    return [int(one.positions[0, 0]) for one in frames]


class Told:
    """What the operator of a bridge is told, and a way to wait for it."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._more = threading.Condition()

    def __call__(self, line: str) -> None:
        with self._more:
            self.lines.append(line)
            self._more.notify_all()

    def wait_for(self, words: str) -> None:
        with self._more:
            assert self._more.wait_for(lambda: any(words in one for one in self.lines), PATIENCE), (
                words
            )


@contextmanager
def bridge(
    bind: str = ANYWHERE,
    *,
    keys: Path | None = None,
    told: Told | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> Iterator[BridgePublisher]:
    where = binding(bind, keys, option="--keys DIR")
    with BridgePublisher(where, BODY, tell=told or Told(), clock=clock) as publisher:
        yield publisher


def take(stream: BridgeStream, enough: Callable[[list[SkeletonFrame]], bool]) -> list:
    """Frames of a stream until they are enough."""
    frames: list[SkeletonFrame] = []
    deadline = time.monotonic() + PATIENCE
    while not enough(frames):
        assert time.monotonic() < deadline, f"only {len(frames)} frames came: {stream.traffic}"
        stream.wait(0.05)
        frames += stream.poll()
    return frames


def take_until(stream: BridgeStream, last: int) -> list[SkeletonFrame]:
    return take(stream, lambda frames: bool(frames) and numbers(frames)[-1] >= last)


def publish_until_heard(publisher: BridgePublisher, stream: BridgeStream) -> list[SkeletonFrame]:
    """Frames written one by one until one comes out of the other end."""
    deadline = time.monotonic() + PATIENCE
    number = 0
    while time.monotonic() < deadline:
        number += 1
        publisher.write(frame(number, time=time.monotonic()))
        if stream.wait(0.02):
            return list(stream.poll())
    raise AssertionError(f"nothing came: {stream.traffic}")


def test_lossless_loses_nothing_past_a_reader_that_stands_still() -> None:
    with bridge() as publisher, BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as stream:
        for number in range(1, 5001):
            publisher.write(frame(number))
        early = take_until(stream, 100)  # then it stands still while twice as many come
        for number in range(5001, 10_001):
            publisher.write(frame(number))
        frames = early + take_until(stream, 10_000)
        assert numbers(frames) == list(range(1, 10_001))
        assert stream.traffic.dropped == publisher.lost == 0


def test_latest_wins_past_a_reader_that_stands_still() -> None:
    with bridge() as publisher, BridgeStream(Bridge(publisher.endpoint, LATEST)) as stream:
        tapped = threading.Event()
        stream.tap(lambda one: tapped.set() if int(one.positions[0, 0]) >= 2999 else None)
        for number in range(1, 3001):
            publisher.write(frame(number, performer=number % 3))
        assert tapped.wait(PATIENCE)
        frames = take_until(stream, 3000)
        newest = {
            one.performer: number for one, number in zip(frames, numbers(frames), strict=True)
        }
        assert newest == {1: 2998, 2: 2999, 0: 3000}, "the newest of each performer"
        assert len(frames) <= 6, "and hardly more"
        assert stream.traffic.dropped >= 3000 - 6
        assert stream.traffic.frames + stream._receiver.lost == 3000


def test_who_comes_late_gets_the_skeleton_and_goes_on_from_there() -> None:
    with bridge() as publisher, BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as first:
        for number in range(1, 101):
            publisher.write(frame(number))
        assert numbers(take_until(first, 100)) == list(range(1, 101))
        with BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as late:
            np.testing.assert_array_equal(late.skeleton.rest_positions, BODY.rest_positions)
            publisher.write(frame(101))
            assert numbers(take_until(late, 101)) == [101]
            assert late.traffic.dropped == 0
        assert numbers(take_until(first, 101)) == [101]


def test_a_bridge_that_dies_and_comes_back_is_found_again() -> None:
    with bridge() as publisher:
        endpoint = publisher.endpoint
        stream = BridgeStream(Bridge(endpoint, LOSSLESS))
        assert publish_until_heard(publisher, stream)
    with stream:
        with bridge(endpoint) as again:
            assert publish_until_heard(again, stream)
            assert stream.traffic.trouble == ""
        assert stream._receiver.strange is False


def test_a_stage_that_starts_before_the_bridge_waits_for_it() -> None:
    with bridge() as publisher:
        endpoint = publisher.endpoint  # free again when this one is gone
    opened: list[BridgeStream] = []

    def open_it() -> None:
        opened.append(BridgeStream(Bridge(endpoint, patience=PATIENCE)))

    opening = threading.Thread(target=open_it)
    opening.start()
    with bridge(endpoint) as publisher:
        opening.join(PATIENCE)
        with opened[0] as stream:
            assert publish_until_heard(publisher, stream)


def test_the_clock_of_the_other_machine_is_taken_out() -> None:
    """The bridge's clock is an hour and more ahead; the bound is what the line allows."""
    ahead = 4000.25
    with (
        bridge(clock=lambda: time.monotonic() + ahead) as publisher,
        BridgeStream(Bridge(publisher.endpoint)) as stream,
    ):
        now = time.monotonic()
        publisher.write(frame(1, time=now + ahead))
        (heard,) = take_until(stream, 1)
        clock = stream._receiver.clock
        assert abs(clock.seconds - ahead) <= clock.bound
        assert abs(heard.time - now) <= clock.bound
        assert heard.time <= heard.arrival


def test_the_right_keys_open_and_the_wrong_ones_get_nothing(tmp_path: Path) -> None:
    make_keys(tmp_path / "keys")
    make_keys(tmp_path / "other")
    stage, strange = tmp_path / "keys/stage", tmp_path / "other/stage"
    told = Told()
    with bridge(keys=tmp_path / "keys/capture", told=told) as publisher:
        port = urlsplit(publisher.endpoint).port
        url = f"zmq+tcp://127.0.0.1:{port}"
        with open_device(urlsplit(f"{url}?keys={stage}&mode=lossless")) as stream:
            publisher.write(frame(1))
            assert numbers(take_until(stream, 1)) == [1]
        # A key that the bridge does not know, though it belongs to somebody who knows the bridge.
        (strange / "bridge.key").write_bytes((stage / "bridge.key").read_bytes())
        with pytest.raises(InputError, match="refused our key"):
            open_device(urlsplit(f"{url}?keys={strange}"))
        told.wait_for("whose key is not allowed")
        # Somebody else's bridge.
        (stage / "bridge.key").write_bytes(
            (tmp_path / "other/capture/bridge.key_secret").read_bytes()
        )
        with pytest.raises(InputError, match="no connection to the bridge"):
            open_device(urlsplit(f"{url}?keys={stage}&wait=5"))
        with pytest.raises(InputError, match="one side has keys and the other has none"):
            open_device(urlsplit(f"{url}?wait=5"))
        told.wait_for("one side has keys and the other has none")
        assert publisher.audience.sent == 1, "nobody else got anything"


def test_nothing_leaves_this_machine_without_keys(tmp_path: Path) -> None:
    for host in ("0.0.0.0", "*", "192.168.1.7", "stage.local", "[::]"):
        with pytest.raises(InputError, match=r"beyond this machine.*--make-keys DIR.*--keys DIR"):
            binding(f"tcp://{host}:5570", None, option="--keys DIR")
    for host in ("192.168.1.7", "capture", "[2001:db8::1]"):
        with pytest.raises(InputError, match=r"beyond this machine.*--make-keys DIR.*keys=DIR"):
            open_stream(f"zmq+tcp://{host}:5570")
    for host in ("127.0.0.1", "127.9.9.9", "::1", "[::1]", "localhost", "LocalHost"):
        assert is_loopback(host)
    for host in ("", "0.0.0.0", "localhost.example", "128.0.0.1", "::2", "127.0.0.1.example"):
        assert not is_loopback(host)
    make_keys(tmp_path / "keys")
    guarded = binding("tcp://0.0.0.0:0", tmp_path / "keys/capture", option="--keys DIR")
    assert guarded.endpoint == "tcp://*:*"
    assert guarded.keys is not None


@posix_only
def test_keys_belong_to_their_owner_and_are_never_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    before = os.umask(0)
    try:
        assert main(["bridge", "--make-keys", "keys"]) == 0
    finally:
        os.umask(before)
    assert "keys/stage" in capsys.readouterr().out
    files = [path for path in (tmp_path / "keys").rglob("*") if path.is_file()]
    assert len(files) == 4
    for path in files:
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    secrets = [path.read_bytes() for path in files]
    assert main(["bridge", "--make-keys", "keys"]) == 2
    assert "keys are not replaced" in capsys.readouterr().err
    assert [path.read_bytes() for path in files] == secrets
    capture, stage = (
        read_publisher_keys(tmp_path / "keys/capture"),
        read_subscriber_keys(tmp_path / "keys/stage"),
    )
    assert stage.bridge == capture.public
    assert capture.allowed == {stage.public}
    assert len({capture.secret, stage.secret, capture.public, stage.public}) == 4
    (tmp_path / "keys/stage/stage.key_secret").chmod(0o644)
    with pytest.raises(
        InputError, match=r"stage\.key_secret can be read by other users.*chmod 600"
    ):
        read_subscriber_keys(tmp_path / "keys/stage")


def test_keys_that_are_none_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is missing.*--make-keys DIR"):
        read_subscriber_keys(tmp_path)
    make_keys(tmp_path / "keys")
    secret = tmp_path / "keys/stage/stage.key_secret"
    public = (tmp_path / "keys/capture/allowed/stage.key").read_bytes()
    for damaged in (
        b"",
        b"\xff\xfe",
        b"public-key = 7",
        public.replace(b'"', b'"~~', 1),
        b"x" * 99,
    ):
        secret.write_bytes(damaged)
        with pytest.raises(InputError, match="is not a key"):
            read_subscriber_keys(tmp_path / "keys/stage")
    secret.write_bytes(public)
    with pytest.raises(InputError, match="holds no secret key"):
        read_subscriber_keys(tmp_path / "keys/stage")
    (tmp_path / "keys/capture/allowed/stage.key").unlink()
    with pytest.raises(InputError, match="no show could connect"):
        read_publisher_keys(tmp_path / "keys/capture")


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("zmq+tcp://127.0.0.1:0", "port"),
        ("zmq+tcp://127.0.0.1:99999", "65535"),
        ("zmq+tcp://127.0.0.1:5570?mode=fast", "latest or lossless"),
        ("zmq+tcp://127.0.0.1:5570?speed=2", "mode, keys, wait"),
        ("zmq+tcp://127.0.0.1:5570?wait=-1", "above 0"),
        ("zmq+tcp://127.0.0.1:5570/path", "HOST:PORT"),
        ("zmq+tcp://127.0.0.1:9?wait=0.05", "is `bunraku bridge` running there"),
    ],
)
def test_addresses_that_cannot_be_opened_are_told(url: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        open_stream(url)


@pytest.mark.parametrize(
    "bind",
    [
        "",
        "udp://127.0.0.1:1",
        "tcp://127.0.0.1",
        "tcp://127.0.0.1:x",
        "tcp://[::1:5",
        "tcp://h:1/a",
    ],
)
def test_addresses_that_cannot_be_bound_are_told(bind: str) -> None:
    with pytest.raises(InputError, match=r"expected tcp://HOST:PORT"):
        binding(bind, None, option="--keys DIR")


def test_a_port_that_is_taken_is_told() -> None:
    with (
        bridge() as publisher,
        pytest.raises(InputError, match=r"cannot bind tcp://127.*in use"),
        bridge(publisher.endpoint),
    ):
        pass


@contextmanager
def raw(kind: int, endpoint: str | None = None) -> Iterator[tuple[zmq.Socket, str]]:
    """A plain ZeroMQ socket, as any other program has one."""
    with zmq.Context() as context, context.socket(kind) as socket:
        socket.linger = 0
        if endpoint is None:
            endpoint = f"tcp://127.0.0.1:{socket.bind_to_random_port('tcp://127.0.0.1')}"
        else:
            socket.connect(endpoint)
        yield socket, endpoint


def test_a_bridge_of_another_version_is_told_in_one_line() -> None:
    def answer(socket: zmq.Socket) -> None:
        route, said = socket.recv_multipart()
        assert isinstance(decode(said), Call)
        socket.send_multipart((route, b"BNRK\x07\x02\0\0 words of a later age"))

    with raw(zmq.ROUTER) as (socket, endpoint):
        answering = threading.Thread(target=answer, args=(socket,))
        answering.start()
        with pytest.raises(InputError, match=f"speaks version 7 and we speak {VERSION}"):
            BridgeStream(Bridge(endpoint, patience=PATIENCE))
        answering.join(PATIENCE)


def test_a_stage_of_another_version_is_told_and_tells() -> None:
    told = Told()
    with bridge(told=told) as publisher, raw(zmq.DEALER, publisher.endpoint) as (socket, _):
        said = bytearray(encode_call(Call(1, 0, 0, 0.0, 8, LATEST)))
        said[4] = 9
        socket.send(said)
        assert socket.poll(int(PATIENCE * 1000))
        reply = bytearray(socket.recv())
        assert reply[4] == VERSION, "so that the other side can name us"
        told.wait_for("speaks version 9")
    reply[4] = 9
    assert decode(bytes(reply)) == OtherVersion(9)


def test_a_flood_from_a_stranger_leaves_the_bridge_serving() -> None:
    stop, served = threading.Event(), threading.Event()

    def flood(socket: zmq.Socket) -> None:
        noise = [os.urandom(size) for size in (0, 1, 46, 300)]
        call = encode_call(Call(1, 2, 3, 4.0, 5, LATEST))
        while not stop.is_set():
            for data in (*noise, call):
                with_room = socket.poll(10, zmq.POLLOUT)
                if with_room:
                    socket.send(data, zmq.NOBLOCK)
            if publisher.audience.stages == 2:
                served.set()

    with (
        bridge() as publisher,
        BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as stream,
        raw(zmq.DEALER, publisher.endpoint) as (socket, _),
    ):
        flooding = threading.Thread(target=flood, args=(socket,))
        flooding.start()
        try:
            assert served.wait(PATIENCE), "its own call is one like any other"
            for number in range(1, 301):
                publisher.write(frame(number))
            assert numbers(take_until(stream, 300)) == list(range(1, 301))
        finally:
            stop.set()
            flooding.join(PATIENCE)
        assert publisher.audience.refused > 0
        assert publisher.audience.stages == 2


def test_closing_is_quick_quiet_and_may_come_twice() -> None:
    with bridge() as publisher:
        stream = BridgeStream(Bridge(publisher.endpoint))
        before = threading.active_count()
        stream.close()
        stream.close()
        assert stream.ended
        assert list(stream.poll()) == []
        assert threading.active_count() == before - 1
        publisher.close()


def test_what_was_handed_over_last_still_arrives() -> None:
    with bridge() as publisher:
        stream = BridgeStream(Bridge(publisher.endpoint, LOSSLESS))
        for number in range(1, 2001):
            publisher.write(frame(number))
        closing = threading.Thread(target=publisher.close)
        closing.start()
        with stream:
            assert numbers(take_until(stream, 2000)) == list(range(1, 2001))
        closing.join(PATIENCE)


# -- As a user meets it ----------------------------------------------------------------------------


def bunraku(*arguments: object, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "runtime.cli", *map(str, arguments)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def endpoint_of(process: subprocess.Popen[str]) -> str:
    """The address that a bridge tells of on its first line."""
    assert process.stderr is not None
    line = process.stderr.readline()
    assert "zmq+tcp://" in line, line + process.stderr.read()
    return line.split()[-1]


@posix_only
def test_ctrl_c_ends_a_bridge_with_a_word_on_what_it_did(tmp_path: Path) -> None:
    process = bunraku("bridge", "--device", "sim://walk", "--bind", ANYWHERE, folder=tmp_path)
    try:
        with open_stream(f"{endpoint_of(process)}?mode=lossless") as stream:
            assert isinstance(stream, BridgeStream)
            frames = take(stream, lambda frames: len(frames) >= 30)
        # Each correction of the clock's offset shifts one step: most are as they were sent.
        steps = np.diff([one.time for one in frames])
        assert np.median(steps) == pytest.approx(1.0 / 60.0, abs=0.002)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130, said
    assert "frames came" in said.splitlines()[-1]
    assert "went to stages" in said.splitlines()[-1]
    assert "Traceback" not in said


def test_a_show_publishes_its_performers_to_another(tmp_path: Path) -> None:
    show = bunraku(
        *("live", "--device", "sim://walk?performers=2", "--performers", "2", "--headless"),
        *("--character", "paper", "--character", "paper", "--publish", ANYWHERE),
        folder=tmp_path,
    )
    try:
        with open_stream(f"{endpoint_of(show)}?mode=lossless") as stream:
            assert isinstance(stream, BridgeStream)
            heard = take(stream, lambda frames: {one.performer for one in frames} >= {0, 1})
            assert "HandLeft" in stream.skeleton.names
    finally:
        show.kill()
        show.communicate()
    assert {one.performer for one in heard} == {0, 1}
    assert all(np.isfinite(one.positions).all() for one in heard)


def test_the_command_refuses_in_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for arguments, words in (
        (["bridge"], "--device URL"),
        (["bridge", "--device", "sim://walk", "--bind", "tcp://0.0.0.0:5570"], "--keys DIR"),
        (["demo", "--headless", "--publish", "tcp://0.0.0.0:5570"], "--publish-keys DIR"),
        (["bridge", "--make-keys", str(tmp_path / "file" / "keys")], "cannot write keys"),
    ):
        (tmp_path / "file").touch()
        assert main(arguments) == 2
        said = capsys.readouterr().err
        assert words in said
        assert said.count("\n") == 1
