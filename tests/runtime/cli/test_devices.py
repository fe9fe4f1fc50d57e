"""`bunraku devices` and `bunraku doctor`: what arrives, what does not, and why, over loopback."""

from __future__ import annotations

import itertools
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from devices.errors import InputError
from devices.stream import ADAPTERS
from devices.transport.port_owner import port_owner
from devices.transport.udp import QUEUE
from runtime.cli import main
from runtime.cli.device_watch import PLACES, State, listening_ports, watch
from runtime.cli.health_checks import EXTRAS, udp_queue
from runtime.render.egl import egl_devices
from tests.devices.sender_packets import XSENS, bones, mxtp02, packed, posed, rokoko_v3
from tests.devices.vmc_sender import slime
from tests.waiting import PATIENCE

ROOT = Path(__file__).resolve().parents[3]
linux_only = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks Linux")


@pytest.fixture
def port() -> int:
    """A UDP port that was free just now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
        trial.bind(("127.0.0.1", 0))
        return int(trial.getsockname()[1])


@contextmanager
def sending(port: int, *datagrams: bytes) -> Iterator[Callable[[], float]]:
    """Somebody who sends these, one after another and again; a clock that counts them [0.01 s]."""
    stop = threading.Event()
    now = [0.0]

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for number in itertools.count():
                if stop.wait(0.01):
                    return
                sender.sendto(datagrams[number % len(datagrams)], ("127.0.0.1", port))
                now[0] = 0.01 * number

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield lambda: now[0]
    finally:
        stop.set()
        thread.join()


def test_every_kind_of_device_is_looked_for() -> None:
    assert {place.partition(":")[0] for place in PLACES} == set(ADAPTERS)
    assert len(set(listening_ports())) == len(listening_ports()) > 5


def told(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    capsys.readouterr()
    code = main(list(map(str, arguments)))
    return (code, *capsys.readouterr())


def test_what_arrives_is_measured(
    port: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "there.json"
    address = f"vmc://127.0.0.1:{port}"
    with sending(port, *(slime(k / 100) for k in range(500))):
        code, text, error = told(capsys, "devices", address, "--seconds", 1, "--json", out)
    assert (code, error) == (0, "")
    assert re.search(
        rf"arriving +{re.escape(address)} +[\d.]+ Hz, jitter [\d.]+ ms, last seen [\d.]+ s ago, "
        r"1 performer, 55 joints",
        text,
    )
    written = json.loads(out.read_text())
    (there,) = written["devices"]
    assert written["seconds"] == 1.0
    assert (there["state"], there["performers"], there["joints"]) == ("arriving", [0], 55)
    assert there["frames"] > 0
    assert there["rate"] > 0.0
    assert 0.0 <= there["last_seen_s"] < 60.0


def test_each_place_has_a_state_of_its_own() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as third,
    ):
        for one in (holder, other, third):
            one.bind(("127.0.0.1", 0))
        ports = [one.getsockname()[1] for one in (other, third)]
        other.close()
        third.close()
        actors = rokoko_v3({"Ann": bones(posed_rokoko()), "Bob": bones(posed_rokoko())})
        with (
            sending(ports[0], packed(actors)) as one_clock,
            sending(ports[1], b"noise") as other_clock,
        ):
            taken, arriving, unclear, sim, leap, webcam = watch(
                [
                    f"xsens://127.0.0.1:{holder.getsockname()[1]}",
                    f"rokoko://127.0.0.1:{ports[0]}",
                    f"xsens://127.0.0.1:{ports[1]}",
                    "sim://walk",
                    "leap://",
                    "webcam://777",
                ],
                1.5,
                clock=lambda: min(one_clock(), other_clock()),
            )
    assert taken.state is State.TAKEN
    assert "taken by" in taken.detail
    assert taken.owner is None or taken.owner.process == os.getpid()
    assert arriving.state is State.ARRIVING
    assert "2 performers, 63 joints" in arriving.detail
    assert unclear.state is State.UNCLEAR
    assert "none held a performer's frame" in unclear.detail
    assert "refused" in unclear.detail
    assert sim.state is State.READY
    assert leap.state in (State.MISSING, State.SILENT)
    assert leap.detail
    assert webcam.state is State.MISSING
    assert re.search(r"bunraku\[webcam\]|models are not here|no camera 777", webcam.detail)


def posed_rokoko() -> Any:
    from devices.suits.rokoko_bones import SKELETON

    return posed(SKELETON)


def test_silence_is_told(port: int, capsys: pytest.CaptureFixture[str]) -> None:
    code, text, _ = told(capsys, "devices", f"nimate://127.0.0.1:{port}", "--seconds", 0.1)
    assert code == 0
    assert text == f"silent     nimate://127.0.0.1:{port}  nothing came in 0.1 s\n"


@linux_only
@pytest.mark.parametrize(
    ("kind", "query"), [(socket.SOCK_DGRAM, ""), (socket.SOCK_STREAM, "?transport=tcp")]
)
def test_a_taken_port_names_who_has_it(
    kind: socket.SocketKind, query: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    with socket.socket(socket.AF_INET, kind) as holder:
        holder.bind(("127.0.0.1", 0))
        if kind is socket.SOCK_STREAM:
            holder.listen()
        address, found = f"xsens://127.0.0.1:{holder.getsockname()[1]}{query}", tmp_path / "d.json"
        code, text, _ = told(capsys, "devices", address, "--seconds", 0.1, "--json", found)
    assert code == 0
    assert f'"process": {os.getpid()}' in found.read_text(encoding="utf-8")
    assert text.startswith(f"taken      {address}")
    assert f"(process {os.getpid()})" in text


@pytest.mark.parametrize(
    ("arguments", "about"),
    [
        (["pigeon://a"], "xsens://"),
        (["sim://["], "not an address"),
        (["sim://", "--seconds", "0"], "--seconds"),
        (["sim://", "--json", "nowhere/d.json"], "nowhere"),
    ],
)
def test_bad_arguments_are_refused(
    capsys: pytest.CaptureFixture[str], arguments: list[str], about: str
) -> None:
    code, text, error = told(capsys, "devices", *arguments)
    assert (code, text) == (2, "")
    assert about in error
    assert error.count("\n") == 1


@pytest.mark.skipif(sys.platform != "linux", reason="who has a port is told by /proc")
def test_ctrl_c_ends_the_listening(port: int, tmp_path: Path) -> None:
    address = f"xsens://127.0.0.1:{port}"
    command = [sys.executable, "-m", "runtime.cli", "devices", address, "--seconds", "600"]
    process = subprocess.Popen(
        command,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    (data,) = mxtp02(posed(XSENS))
    try:
        with sending(port, data):
            while port_owner(port, "udp") is None:  # binding it to see would take it away
                assert process.poll() is None
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
        process.wait()
    assert (process.returncode, out, error) == (130, b"", b"")


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
        try:
            trial.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True


# -- The doctor -----------------------------------------------------------------------------------


def test_the_doctor_tells_of_gl_ports_queue_and_extras(
    capsys: pytest.CaptureFixture[str],
) -> None:
    port = next((port for port in listening_ports() if _is_free(port)), None)
    if port is None:
        pytest.skip("every port of the devices is taken")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("127.0.0.1", port))
        code, text, _ = told(capsys, "doctor")
    assert code in (0, 1)
    lines = {line[9:22].strip(): line for line in text.splitlines()}
    assert re.match(r"taken +UDP ports ", lines["UDP ports"])
    assert f"{port} by " in lines["UDP ports"]
    if sys.platform.startswith("linux"):
        assert f"(process {os.getpid()})" in lines["UDP ports"]
    assert "bytes" in lines["UDP queue"] or "system" in lines["UDP queue"]
    if lines["headless GL"].startswith("ok"):
        assert re.search(r"OpenGL \d.*\((software|hardware)\)$", lines["headless GL"])
        assert lines["headless GL"].count(",") >= 2  # vendor, renderer, version
    assert "EGL" in lines
    for extra, modules in EXTRAS.items():
        missing = f"pip install 'bunraku[{extra}]'"
        assert missing in text or f"{extra:<12} {', '.join(modules)}" in text


def test_the_doctor_knows_every_extra() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = set(project["optional-dependencies"]) - {"all", "dev"}
    assert set(EXTRAS) | {"spout"} == extras | {"spout"}


def test_a_short_queue_comes_with_its_cure(tmp_path: Path) -> None:
    limit = tmp_path / "rmem_max"
    limit.write_text("212992\n")
    line = udp_queue("UDP queue", limit)
    assert line.startswith("small    UDP queue")
    assert f"sysctl -w net.core.rmem_max={QUEUE}" in line
    limit.write_text(str(QUEUE))
    assert udp_queue("UDP queue", limit).startswith("ok ")
    assert udp_queue("UDP queue", tmp_path / "none").startswith("ok ")


@linux_only
def test_egl_lists_its_devices() -> None:
    with pytest.raises(InputError, match="apt-get install"):
        egl_devices("libnowhere.so.1")
    try:
        devices = egl_devices()
    except InputError as error:
        pytest.skip(str(error))
    assert all(bool(one.vendor) == bool(one.version) for one in devices)
