"""VMC and OSC with programs of other people's on loopback, each in a process of its own."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_server import BlockingOSCUDPServer
from pythonosc.udp_client import SimpleUDPClient

from devices.bodies.humanoid import humanoid_skeleton
from devices.osc.messages import write_bundles, write_message
from devices.osc.vmc_decoder import VmcDecoder
from devices.skeleton import SkeletonFrame
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport
from tests.waiting import PATIENCE

HUMAN = humanoid_skeleton()
POSE = "sfffffff"


def listening() -> tuple[LiveStream, int]:
    transport = UdpTransport("127.0.0.1", 0, scheme="vmc")
    return LiveStream(transport, VmcDecoder), transport.port


def frame_when(stream: LiveStream, send: Callable[[int], None]) -> SkeletonFrame:
    """The newest frame once there are three, sending until then."""
    frames: list[SkeletonFrame] = []
    until = time.monotonic() + PATIENCE
    number = 0
    while len(frames) < 3 and time.monotonic() < until:
        send(number)
        number += 1
        threading.Event().wait(0.01)
        frames += stream.poll()
    assert len(frames) >= 3, stream.traffic
    return frames[-1]


def test_python_oscs_client_is_heard() -> None:
    stream, port = listening()
    client = SimpleUDPClient("127.0.0.1", port)

    def send(number: int) -> None:
        client.send_message("/VMC/Ext/Root/Pos", ["root", *[0.0] * 6, 1.0])
        for name in ("Hips", "Spine", "LeftUpperLeg"):
            client.send_message("/VMC/Ext/Bone/Pos", [name, *"9000001"])  # texts
            client.send_message("/VMC/Ext/Bone/Pos", [name, -0.5, 1.0, 0.25, 0.0, 0.0, 0.0, 1.0])
        client.send_message("/VMC/Ext/OK", 1)
        client.send_message("/VMC/Ext/T", number / 60)

    with stream, client:
        frame = frame_when(stream, send)
    assert frame.positions[HUMAN.index("Hips")] == pytest.approx((0.5, 1.0, 0.25), abs=1e-6)
    assert stream.traffic.refused > 0


def test_python_oscs_server_understands_what_we_write() -> None:
    heard: list[tuple[object, ...]] = []
    dispatcher = Dispatcher(strict_timing=False)
    dispatcher.set_default_handler(lambda *said: heard.append(said))
    bones = [
        write_message("/VMC/Ext/Bone/Pos", POSE, name, 0.5, 1.0, 0.25, 0.0, 0.0, 0.0, 1.0)
        for name in HUMAN.names
    ]
    bundles = list(write_bundles([*bones, write_message("/VMC/Ext/T", "f", 1.5)], 1472))
    with BlockingOSCUDPServer(("127.0.0.1", 0), dispatcher) as server:
        server.timeout = PATIENCE
        for bundle in bundles:
            posted(bundle, server.server_address[1])
            server.handle_request()
    assert [said[1] for said in heard[:-1]] == list(HUMAN.names)
    assert heard[-1] == ("/VMC/Ext/T", 1.5)
    assert heard[0][2:] == (0.5, 1.0, 0.25, 0.0, 0.0, 0.0, 1.0)


def posted(data: bytes, port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.sendto(data, ("127.0.0.1", port))


NODE = """
import { createSocket } from "node:dgram";
import { fromBuffer, toBuffer } from "osc-min";
const [role, port] = [process.argv[2], Number(process.argv[3])];
const udp = createSocket("udp4");
const f = (value) => ({ type: "float", value });
const pose = [-0.5, 1, 0.25, 0, 0, 0, 1].map(f);
const bone = (name) => ({
  address: "/VMC/Ext/Bone/Pos", args: [{ type: "string", value: name }, ...pose] });
if (role === "send") {
  let time = 0;
  setInterval(() => {
    const elements = [
      { address: "/VMC/Ext/T", args: [f(time += 0.016)] },
      { address: "/VMC/Ext/OK", args: [{ type: "integer", value: 1 }] },
      bone("Hips"), bone("Spine"), bone("\\u9aa8")];
    const data = toBuffer({ timetag: [0, 1], elements });
    udp.send(new Uint8Array(data.buffer, data.byteOffset, data.byteLength), port, "127.0.0.1");
  }, 16);
} else {
  udp.on("message", (data) => {
    const read = fromBuffer(data);
    for (const one of read.elements ?? [read])
      console.log(JSON.stringify([one.address, one.args.map((a) => a.value)]));
    process.exit(0);
  });
  udp.bind(0, "127.0.0.1", () => console.log(udp.address().port));
}
"""


@pytest.fixture(scope="module")
def node(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A script of Node's with osc-min (Zlib licence) from npm beside it."""
    if shutil.which("node") is None or shutil.which("npm") is None:
        pytest.skip("needs node and npm for a VMC client of another kind")
    folder = tmp_path_factory.mktemp("node")
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "vmc.js").write_text(NODE)
    fetch = ["npm", "install", "--no-audit", "--no-fund", "--ignore-scripts", "osc-min@2.1.2"]
    try:
        done = subprocess.run(fetch, cwd=folder, capture_output=True, check=False, timeout=60)
    except subprocess.TimeoutExpired:
        pytest.skip("needs osc-min from npm, which takes too long to come")
    if done.returncode != 0:
        pytest.skip("needs osc-min from npm, which cannot be reached here")
    return folder / "vmc.js"


def test_a_sender_in_javascript_is_heard(node: Path) -> None:
    stream, port = listening()
    process = subprocess.Popen(["node", str(node), "send", str(port)])
    try:
        with stream:
            frame = frame_when(stream, lambda _: None)
            assert stream.traffic.refused == 0
    finally:
        process.kill()
        process.wait(PATIENCE)
    assert frame.positions[HUMAN.index("Hips")] == pytest.approx((0.5, 1.0, 0.25), abs=1e-6)
    assert not np.isnan(frame.positions[HUMAN.index("Spine")]).any()


def test_a_receiver_in_javascript_understands_what_we_write(node: Path) -> None:
    with subprocess.Popen(
        ["node", str(node), "receive", "0"], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        port = int(process.stdout.readline())
        messages = [
            write_message("/VMC/Ext/Bone/Pos", POSE, "Hips", 0.5, 1.0, 0.25, 0.0, 0.0, 0.0, 1.0),
            write_message("/VMC/Ext/OK", "iii", 1, 3, 0),
        ]
        (bundle,) = write_bundles(messages, 1472)
        posted(bundle, port)
        lines, _ = process.communicate(timeout=PATIENCE)
    assert [json.loads(line) for line in lines.splitlines()] == [
        ["/VMC/Ext/Bone/Pos", ["Hips", 0.5, 1, 0.25, 0, 0, 0, 1]],
        ["/VMC/Ext/OK", [1, 3, 0]],
    ]


VMCP = """
import sys, time
from vmcp.osc import OSC
from vmcp.osc.typing import Message
from vmcp.osc.backend.osc4py3 import as_eventloop as backend
from vmcp.typing import Bone, CoordinateVector, ModelState, Quaternion, Timestamp
from vmcp.protocol import bone_transform, root_transform, state
from vmcp.protocol import time as relative_time
osc = OSC(backend)
turn = Quaternion.identity()
with osc.open():
    out = osc.create_sender("127.0.0.1", int(sys.argv[1]), "sender").open()
    for number in range(1000):
        out.send((
            Message(*root_transform(CoordinateVector.identity(), turn)),
            *(Message(*bone_transform(bone, CoordinateVector(-0.5, 1.0, 0.25), turn))
              for bone in (Bone.HIPS, Bone.SPINE)),
            Message(*state(ModelState.LOADED)),
            Message(*relative_time(Timestamp(number / 60))),
        ))
        osc.run()
        time.sleep(1 / 60)
"""


def test_the_vmcp_package_is_heard() -> None:
    """Under the AGPL: it runs in a process of its own, and is no dependency of ours."""
    folder = os.environ.get("BUNRAKU_VMCP")
    if folder is None:
        pytest.skip("needs BUNRAKU_VMCP=DIR after `pip install --target DIR vmcp osc4py3` (AGPL)")
    stream, port = listening()
    process = subprocess.Popen(
        [sys.executable, "-c", VMCP, str(port)], env={**os.environ, "PYTHONPATH": folder}
    )
    try:
        with stream:
            frame = frame_when(stream, lambda _: None)
            assert stream.traffic.refused == 0
    finally:
        process.kill()
        process.wait(PATIENCE)
    assert frame.positions[HUMAN.index("Hips")] == pytest.approx((0.5, 1.0, 0.25), abs=1e-6)
