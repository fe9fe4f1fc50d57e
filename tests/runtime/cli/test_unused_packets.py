"""A device that sends nothing usable: the reason is said, and `record` exits with 2."""

from __future__ import annotations

import socket
import threading
from pathlib import Path

import pytest

from devices.transport.traffic import Traffic
from runtime.cli import main


def test_packets_that_hold_no_frame_are_told_with_their_number() -> None:
    assert Traffic(packets=3, frames=1).unused("vmc://a:1") == ""
    assert "7 packets came from vmc://a:1" in Traffic(packets=7, refused=2).unused("vmc://a:1")
    assert "2 of their parts were refused" in Traffic(packets=7, refused=2).unused("vmc://a:1")
    assert (
        Traffic(trouble="no answer").unused("leap://a") == "nothing came from leap://a: no answer"
    )


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.mark.parametrize("sent", [b"", b"no OSC at all"])
def test_recording_nothing_is_refused_with_the_reason(
    sent: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port, done = free_port(), threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not done.wait(0.02):
                sender.sendto(sent or b"\0", ("127.0.0.1", port if sent else free_port()))

    sending = threading.Thread(target=send)
    sending.start()
    try:
        device = f"vmc://127.0.0.1:{port}"
        code = main(["record", "--device", device, "--seconds", "0.5", str(tmp_path / "a.mcap")])
    finally:
        done.set()
        sending.join()
    told = capsys.readouterr().err
    assert code == 2
    assert "nothing was recorded" in told
    assert ("none held a performer's frame" in told) == bool(sent)
