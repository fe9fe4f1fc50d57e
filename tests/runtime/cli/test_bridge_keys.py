"""A bridge's keys and addresses: who may come in, and what is refused."""

from __future__ import annotations

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from devices.bridge.keys import is_loopback, make_keys, read_publisher_keys, read_subscriber_keys
from devices.bridge.stream import open_device
from devices.errors import InputError
from devices.stream import open_stream
from runtime.cli import main
from runtime.output.live.bridge_publisher import binding
from tests.runtime.cli.loopback import (
    Told,
    bridge,
    frame,
    numbers,
    posix_only,
    take_until,
)


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
        with ThreadPoolExecutor() as pool:  # each waits for as long as it is told to
            attempts = [
                pool.submit(open_device, urlsplit(f"{url}?{keys}wait=5"))
                for keys in (f"keys={stage}&", "")
            ]
        with pytest.raises(InputError, match="no connection to the bridge"):
            attempts[0].result()
        with pytest.raises(InputError, match="one side has keys and the other has none"):
            attempts[1].result()
        told.wait_for("one side has keys and the other has none")
        assert publisher.subscribers.sent == 1, "nobody else got anything"


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
