from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from devices.leap import websocket as leap_websocket
from devices.leap.hands import leap_frame
from devices.leap.joints import FINGERS, SIDES, chest, leap_to_world
from devices.leap.performer import HandSides
from devices.leap.websocket import open_device
from devices.leap.websocket_messages import LeapDecoder
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.transport.live_stream import LiveStream
from replay.leap.lz_string import lz_pieces
from tests.waiting import PATIENCE

ENDS = ("carp", "mcp", "pip", "dip", "btip", "tip")
HEADER = {"version": 6, "serviceVersion": "2.3.1"}


def hand(number: int, side: str | None, x: float, **more: Any) -> dict[str, Any]:
    """A level hand, palm down, 20 cm over the device, its arm towards the user."""
    axes = [[-1.0 if side == "left" else 1.0, 0, 0], [0, 1, 0], [0, 0, 1]]
    found: dict[str, Any] = {
        "id": number,
        "confidence": 0.75,
        "palmPosition": [x, 200.0, 50.0],
        "palmNormal": [0.0, -1.0, 0.0],
        "direction": [0.0, 0.0, -1.0],
        "wrist": [x, 190.0, 120.0],
        "elbow": [x, 150.0, 350.0],
        "armBasis": axes,
    }
    return found | ({"type": side} if side else {}) | more


def finger(of: int, kind: int, x: float, bend: float = 0.0, side: str = "right") -> dict[str, Any]:
    """A finger straight ahead; its distal bone bent down by `bend` [rad]."""
    ends = {f"{end}Position": [x, 200.0, 45.0 - 25.0 * i] for i, end in enumerate(ENDS)}
    turn = Rotation.from_rotvec([-bend, 0, 0]).as_matrix()
    first = -1.0 if side == "left" else 1.0
    straight = [[first, 0, 0], [0, 1, 0], [0, 0, 1]]
    bent = (turn @ np.diag([first, 1.0, 1.0])).T.tolist()
    bases = [straight, straight, straight, bent]
    return {"id": 10 * of + kind, "handId": of, "type": kind, "tool": False, "bases": bases} | ends


def fingers(of: int, x: float, **more: Any) -> list[dict[str, Any]]:
    return [finger(of, kind, x + 20.0 * (kind - 2), **more) for kind in range(5)]


def message(index: int, hands: list[Any], pointables: list[Any]) -> dict[str, Any]:
    return {
        "id": index,
        "timestamp": 5_000_000 + 10_000 * index,
        "currentFrameRate": 100.0,
        "hands": hands,
        "pointables": pointables,
        "interactionBox": {"center": [0, 200, 0], "size": [235, 235, 147]},
        "r": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "s": 1,
        "t": [0, 0, 0],
    }


def both(index: int, x: float = 80.0) -> dict[str, Any]:
    """Both hands; which comes first in the message changes."""
    hands = [hand(1, "left", -x), hand(2, "right", x)]
    points = fingers(1, -x, side="left") + fingers(2, x)
    return message(index, hands[:: (-1) ** index], points[:: (-1) ** index])


def feed(decoder: LeapDecoder, found: Any, arrival: float = 0.0) -> SkeletonFrame:
    (frame,) = decoder.feed(json.dumps(found).encode(), arrival)
    return frame


def place(decoder: LeapDecoder, frame: SkeletonFrame, name: str) -> np.ndarray:
    return frame.positions[decoder.skeleton.index(name)]


# -- the decoder ----------------------------------------------------------------------------------


def test_hands_stand_in_the_world_as_over_the_device() -> None:
    decoder = LeapDecoder()
    frame = feed(decoder, both(0))
    np.testing.assert_allclose(place(decoder, frame, "right_palm"), leap_to_world([80, 200, 50]))
    for kind, name in enumerate(FINGERS):
        tip = leap_to_world([-80.0 + 20.0 * (kind - 2), 200.0, -80.0])
        np.testing.assert_allclose(place(decoder, frame, f"left_{name}_tip"), tip)
    np.testing.assert_allclose(place(decoder, frame, "hands"), chest())
    assert (frame.confidence == 0.75).all()
    assert place(decoder, frame, "left_palm")[0] > 0 > place(decoder, frame, "right_palm")[0]


def test_left_and_right_hands_have_rotations_that_mirror_each_other() -> None:
    decoder = LeapDecoder()
    points = fingers(1, -80.0, bend=0.5, side="left") + fingers(2, 80.0, bend=0.5)
    frame = feed(decoder, message(0, [hand(1, "left", -80.0), hand(2, "right", 80.0)], points))
    assert frame.rotations is not None
    turn = 1e3 * leap_to_world(np.eye(3)).T
    for side in SIDES:
        straight = frame.rotations[decoder.skeleton.index(f"{side}_index_pip")]
        bent = frame.rotations[decoder.skeleton.index(f"{side}_index_dip")]
        np.testing.assert_allclose(Rotation.from_quat(straight).as_matrix(), turn, atol=1e-9)
        relative = Rotation.from_quat(straight).inv() * Rotation.from_quat(bent)
        # The flexion axis is the bone's own x, of both hands, as the left hand's was turned round.
        np.testing.assert_allclose(relative.as_rotvec(), [-0.5, 0, 0], atol=1e-9)
        for joint in ("palm", "wrist", "elbow"):
            found = frame.rotations[decoder.skeleton.index(f"{side}_{joint}")]
            np.testing.assert_allclose(Rotation.from_quat(found).as_matrix(), turn, atol=1e-9)


def test_one_hand_alone_is_followed_when_asked_for() -> None:
    decoder = LeapDecoder("left")
    frame = feed(decoder, both(0))
    np.testing.assert_allclose(place(decoder, frame, "palm"), leap_to_world([-80, 200, 50]))
    assert decoder.skeleton.rest_positions[decoder.skeleton.index("thumb_tip")][0] < 0
    assert LeapDecoder("right").skeleton.rest_positions[decoder.skeleton.index("thumb_tip")][0] > 0


@pytest.mark.parametrize("lost", [1, 10, 300])
def test_a_hand_that_was_lost_is_unseen_and_comes_back_on_its_side(lost: int) -> None:
    decoder = LeapDecoder()
    feed(decoder, both(0), 0.0)
    for index in range(lost):
        gone = feed(decoder, message(index + 1, [hand(2, "right", 80.0)], fingers(2, 80.0)))
        assert np.isnan(place(decoder, gone, "left_palm")).all()
        assert np.isfinite(place(decoder, gone, "right_palm")).all()
    back = [hand(2, "right", 80.0), hand(9, "left", -60.0)]
    frame = feed(decoder, message(lost + 1, back, fingers(9, -60.0) + fingers(2, 80.0)))
    np.testing.assert_allclose(place(decoder, frame, "left_palm"), leap_to_world([-60, 200, 50]))
    np.testing.assert_allclose(place(decoder, frame, "right_palm"), leap_to_world([80, 200, 50]))


def test_no_hand_is_a_frame_with_nothing_seen() -> None:
    frame = feed(LeapDecoder(), message(0, [], []))
    assert np.isnan(frame.positions).all()
    assert not frame.confidence.any()


def sides_of(follow: HandSides, *hands: dict[str, Any]) -> dict[str, int]:
    frame = leap_frame(message(0, list(hands), []))
    return {side: found.id for side, found in follow(frame.hands).items()}


def test_hands_without_a_side_keep_the_one_they_have_and_come_back_by_place() -> None:
    follow = HandSides()
    assert sides_of(follow, hand(4, None, 80.0), hand(5, None, -80.0)) == {"right": 4, "left": 5}
    crossed = hand(4, None, -90.0), hand(5, None, 90.0)
    assert sides_of(follow, *crossed) == {"right": 4, "left": 5}
    assert sides_of(follow, hand(5, None, 90.0)) == {"left": 5}
    # The right hand was lost on the left side of the device, and comes back there.
    assert sides_of(follow, hand(5, None, 90.0), hand(6, None, -100.0)) == {"left": 5, "right": 6}


def test_of_two_hands_of_one_side_the_one_that_was_there_is_taken_else_the_nearest() -> None:
    follow = HandSides()
    assert sides_of(follow, hand(1, "right", 50.0)) == {"right": 1}
    ghost = hand(2, "right", 10.0, confidence=1.0)
    assert sides_of(follow, ghost, hand(1, "right", 60.0)) == {"right": 1}
    assert sides_of(follow, hand(8, "right", 400.0), hand(7, "right", 70.0)) == {"right": 7}


def test_a_header_of_an_older_protocol_and_its_frames_are_taken() -> None:
    decoder = LeapDecoder()
    assert decoder.feed(b'{"version": 1}', 0.0) == []
    assert decoder.version == 1
    spread = {77: (-75.0, 35.0), 5: (-35.0, 90.0), 40: (-5.0, 100.0), 8: (25.0, 92.0), 61: (60, 70)}
    tips = [
        {"id": one, "handId": 3, "tool": False, "tipPosition": [80 + x, 200.0, 50.0 - forward]}
        for one, (x, forward) in spread.items()
    ]
    for order in (1, -1):
        frame = feed(decoder, message(0, [hand(3, None, 80.0)], tips[::order]))
        for name, (x, forward) in zip(FINGERS, spread.values(), strict=True):
            tip = leap_to_world([80 + x, 200.0, 50.0 - forward])
            np.testing.assert_allclose(place(decoder, frame, f"right_{name}_tip"), tip)


def test_an_arm_that_is_not_told_is_put_behind_the_palm_and_less_sure() -> None:
    decoder = LeapDecoder()
    bare = hand(2, "right", 80.0)
    del bare["wrist"], bare["elbow"]
    frame = feed(decoder, message(0, [bare], fingers(2, 80.0)))
    for name, z in (("wrist", 115.0), ("elbow", 365.0)):
        expected = leap_to_world([80, 200, z])
        np.testing.assert_allclose(place(decoder, frame, f"right_{name}"), expected)
        assert frame.confidence[decoder.skeleton.index(f"right_{name}")] == 0.375
    bare["direction"] = [0.0, 0.0, 0.0]
    frame = feed(decoder, message(1, [bare], fingers(2, 80.0)))
    assert np.isnan(place(decoder, frame, "right_wrist")).all()


def device_event(attached: bool, streaming: bool, name: str = "L1") -> bytes:
    state = {"attached": attached, "streaming": streaming, "id": name, "type": "peripheral"}
    return json.dumps({"event": {"type": "deviceEvent", "state": state}}).encode()


def test_device_events_say_what_is_wrong() -> None:
    decoder = LeapDecoder()
    assert decoder.feed(json.dumps(HEADER).encode(), 0.0) == []
    assert decoder.trouble == ""
    for attached, streaming, says in (
        (True, True, ""),
        (True, False, "plugged in but paused"),
        (False, False, "not plugged in"),
        (True, True, ""),
    ):
        assert decoder.feed(device_event(attached, streaming), 0.0) == []
        assert says in decoder.trouble
        assert bool(says) == bool(decoder.trouble)
    for number in range(100):
        decoder.feed(device_event(True, True, str(number)), 0.0)
    assert len(decoder.devices) <= 16
    decoder.feed(json.dumps(HEADER).encode(), 0.0)
    assert not decoder.devices
    assert decoder.refused == 0


HOSTILE = [
    b"",
    b"\xff\xfe{}",
    b"[]",
    b"null",
    b"{",
    b'{"hands": 3}',
    b'{"version": true}',
    b'{"version": "6"}',
    b'{"event": 3}',
    b'{"event": {"state": {}}}',
    b"[" * 100_000,
    b'{"a":' * 100_000,
    b'{"hands": [' + b"1," * 600_000 + b"1]}",
    b'{"timestamp": ' + b"9" * 100_000 + b', "hands": 1}',
]


@pytest.mark.parametrize("data", HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_no_message_is_refused_and_counted(data: bytes) -> None:
    decoder = LeapDecoder()
    assert decoder.feed(data, 0.0) == []
    assert decoder.refused == 1


@pytest.mark.parametrize(
    "change",
    [
        {"palmPosition": [1e9, 0, 0]},
        {"palmPosition": [float("nan")] * 3},
        {"palmPosition": "here"},
        {"id": [1]},
        {"confidence": float("inf")},
        {"type": ["left"]},
        {"armBasis": [[0, 0, 0]] * 3, "direction": [0, 0, 0]},
        {"armBasis": [[float("nan")] * 3] * 3, "palmNormal": None},
        {"direction": [1e300, 1e300, 1e300]},
    ],
)
def test_odd_values_in_a_hand_are_unseen(change: dict[str, Any]) -> None:
    found = both(0)
    found["hands"][0] |= change
    frame = feed(LeapDecoder(), found)
    seen = frame.confidence > 0
    assert np.isfinite(frame.positions[seen]).all()
    assert np.isnan(frame.positions[~seen]).all()
    assert ((frame.confidence >= 0) & (frame.confidence <= 1)).all()


def test_the_device_s_clock_paces_frames_and_may_begin_anew() -> None:
    decoder = LeapDecoder()
    times = [feed(decoder, both(index), 3.0 + 0.01 * index).time for index in range(50)]
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-9)
    restarted = feed(decoder, both(0), 4.0)
    assert restarted.time == 4.0
    missing = both(1)
    del missing["timestamp"]
    assert feed(decoder, missing, 4.5).time == 4.5


# -- real recordings ------------------------------------------------------------------------------


def unpacked(scheme: list[Any], values: list[Any]) -> dict[str, Any]:
    """An object of LeapJS Playback's packed form."""
    found: dict[str, Any] = {}
    for key, value in zip(scheme, values, strict=False):
        if isinstance(key, str):
            found[key] = value
        else:
            ((name, inner),) = key.items()
            rows = (
                [unpacked(inner[0], row) for row in value] if isinstance(inner[0], list) else None
            )
            found[name] = unpacked(inner, value) if rows is None else rows
    return found


def recorded(path: Path) -> list[dict[str, Any]]:
    """The messages of a LeapJS Playback recording."""
    frames = json.loads("".join(lz_pieces(path.read_bytes().strip())))["frames"]
    if isinstance(frames[0], list):
        frames = [unpacked(frames[0], frame) for frame in frames[1:]]
        for frame in frames:
            for pointable in frame["pointables"]:
                pointable["type"] = pointable["id"] % 10
    return [frame | {"currentFrameRate": 100.0} for frame in frames]


def playbacks(shared: Path) -> list[Path]:
    return sorted((shared / "leap").rglob("*.lz"))


def test_recorded_messages_are_frames_of_hands_with_bones_of_one_length(shared: Path) -> None:
    for path in playbacks(shared):
        decoder = LeapDecoder()
        frames = [feed(decoder, found, 0.01 * i) for i, found in enumerate(recorded(path)[:120])]
        assert decoder.refused == 0
        positions = np.array([frame.positions for frame in frames])
        skeleton = decoder.skeleton
        bones = [
            joint
            for joint, name in enumerate(skeleton.names)
            if name.endswith(("_dip", "_tip")) and np.isfinite(positions[:, joint]).all()
        ]
        assert len(bones) >= 8
        ends = positions[:, bones] - positions[:, skeleton.parents[bones]]
        lengths = np.linalg.norm(ends, axis=2)
        assert np.median(np.ptp(lengths, axis=0) / lengths.mean(axis=0)) < 0.25


def test_recorded_bases_point_along_their_bones(shared: Path) -> None:
    path = next(path for path in playbacks(shared) if "pinch" in path.name)
    decoder = LeapDecoder()
    checked = 0
    for index, found in enumerate(recorded(path)):
        frame = feed(decoder, found, 0.01 * index)
        assert frame.rotations is not None
        for side in SIDES:
            for name in FINGERS:
                start, end = (decoder.skeleton.index(f"{side}_{name}_{e}") for e in ("dip", "tip"))
                along = frame.positions[end] - frame.positions[start]
                if np.isfinite(along).all() and np.isfinite(frame.rotations[start]).all():
                    axis = Rotation.from_quat(frame.rotations[start]).apply([0, 0, -1])
                    assert axis @ along / np.linalg.norm(along) > 0.98
                    checked += 1
    assert checked > 500


# -- the service on loopback ----------------------------------------------------------------------


class Service:
    """A Leap service as its clients see it: paths asked for, settings sent, what it answers."""

    def __init__(self, serve: Callable[[Service, Any], None]) -> None:
        self.paths: list[str] = []
        self.settings: list[dict[str, Any]] = []
        self.released = threading.Event()
        self._serve = serve

    def __call__(self, connection: Any) -> None:
        self.paths.append(urlsplit(connection.request.path).path)
        self._serve(self, connection)

    def greet(self, connection: Any, header: dict[str, Any], settings: int = 3) -> None:
        connection.send(json.dumps(header))
        for _ in range(settings):
            self.settings.append(json.loads(connection.recv(timeout=PATIENCE)))


@contextmanager
def serving(serve: Callable[[Service, Any], None], port: int = 0) -> Iterator[tuple[Service, int]]:
    server_module = pytest.importorskip("websockets.sync.server", reason="needs the extra leap")
    service = Service(serve)
    server = server_module.serve(service, "127.0.0.1", port)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield service, server.socket.getsockname()[1]
    finally:
        service.released.set()
        server.shutdown()
        thread.join(PATIENCE)


def opened(port: int, options: str = "") -> LiveStream:
    return open_device(urlsplit(f"leap+ws://127.0.0.1:{port}{options}"))


def take(stream: LiveStream, count: int) -> list[SkeletonFrame]:
    frames: list[SkeletonFrame] = []
    end, pause = time.monotonic() + PATIENCE, threading.Event()
    while len(frames) < count and time.monotonic() < end:
        frames += stream.poll()
        pause.wait(0.002)
    assert len(frames) >= count, stream.traffic
    return frames


def until(condition: Callable[[], bool]) -> bool:
    end, pause = time.monotonic() + PATIENCE, threading.Event()
    while not condition() and time.monotonic() < end:
        pause.wait(0.002)
    return condition()


@pytest.fixture(autouse=True)
def _try_again_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leap_websocket, "RETRY", 0.02)


def test_frames_come_from_a_service_that_is_asked_for_them() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(device_event(True, True).decode())
        for index in range(20):
            connection.send(json.dumps(both(index)))
        service.released.wait(PATIENCE)

    with serving(serve) as (service, port), opened(port) as stream:
        frames = take(stream, 20)
        assert len(frames) == 20
        assert stream.traffic.packets == 22
        assert stream.traffic.refused == 0
        assert stream.traffic.trouble == ""
    assert service.paths == ["/v6.json"]
    assert service.settings == [{"background": True}, {"focused": True}, {"optimizeHMD": False}]
    gaps = np.diff([frame.time for frame in frames])
    assert gaps.min() >= 0.0


def test_a_service_that_goes_away_is_found_again_and_told_everything_again() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(json.dumps(both(len(service.paths))))
        if len(service.paths) < 3:
            connection.close(1001)
        else:
            service.released.wait(PATIENCE)

    with serving(serve) as (service, port), opened(port) as stream:
        take(stream, 3)
    assert service.paths == ["/v6.json"] * 3  # 1001 after frames is no matter of the version
    assert len(service.settings) == 9


def test_a_service_that_does_not_know_the_version_is_asked_for_a_lower_one() -> None:
    def serve(service: Service, connection: Any) -> None:
        if service.paths[-1] != "/v4.json":
            connection.close(1001)
            return
        service.greet(connection, {"version": 3})
        connection.send(json.dumps(both(0)))
        service.released.wait(PATIENCE)

    with serving(serve) as (service, port), opened(port) as stream:
        take(stream, 1)
    assert service.paths == ["/v6.json", "/v5.json", "/v4.json"]


def test_a_service_that_starts_later_is_found() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(json.dumps(both(0)))
        service.released.wait(PATIENCE)

    with serving(serve) as (_, port):
        pass  # a port that was free a moment ago, and is again
    with opened(port) as stream:
        assert until(lambda: "no answer" in stream.traffic.trouble)
        assert "\n" not in stream.traffic.trouble
        with serving(serve, port):
            take(stream, 1)
            assert stream.traffic.trouble == ""


def test_hostile_messages_and_a_device_that_is_unplugged_leave_the_stream_running() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        for data in HOSTILE:
            if len(data) < 1 << 20:
                connection.send(data)
        connection.send(device_event(False, False).decode())
        connection.send(json.dumps(both(0)))
        service.released.wait(PATIENCE)

    with serving(serve) as (_, port), opened(port) as stream:
        take(stream, 1)
        assert stream.traffic.trouble == "the Leap is not plugged in; plug it in"
        assert stream.traffic.refused == sum(len(data) < 1 << 20 for data in HOSTILE)


def test_a_message_beyond_all_bounds_ends_the_connection_not_the_stream() -> None:
    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        connection.send(" " * (2 << 20) if len(service.paths) == 1 else json.dumps(both(0)))
        service.released.wait(PATIENCE if len(service.paths) > 1 else 0.2)

    with serving(serve) as (service, port), opened(port) as stream:
        take(stream, 1)
    assert len(service.paths) == 2


def test_closing_while_nobody_answers_takes_no_time() -> None:
    stream = opened(1)
    stream.close()
    stream.close()
    assert stream.ended
    assert not [thread for thread in threading.enumerate() if thread.name == "device"]


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("leap+ws://127.0.0.1:99999", "not a number from 0 to 65535"),
        ("leap+ws://127.0.0.1:6437/v6.json", "HOST:PORT only"),
        ("leap+ws://127.0.0.1?hands=three", "both or left or right"),
        ("leap+ws://127.0.0.1?version=5", "'version' is unknown"),
    ],
)
def test_an_address_that_cannot_be_opened_is_one_clear_line(url: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        open_stream(url)


def test_a_missing_library_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "websockets.sync.client", None)
    with pytest.raises(InputError, match=r"pip install 'bunraku\[leap\]'"):
        open_stream("leap+ws://127.0.0.1")


# -- leapjs, the maker's own client ---------------------------------------------------------------

LEAPJS = """
const Leap = require('leapjs');
const [port, count] = process.argv.slice(2).map(Number);
const controller = new Leap.Controller({host: '127.0.0.1', port, enableGestures: false,
  loopWhileDisconnected: false, frameEventName: 'deviceFrame'});
const seen = [];
controller.on('deviceFrame', frame => {
  seen.push({hands: frame.hands.map(hand => ({type: hand.type, palm: Array.from(hand.palmPosition),
    tips: hand.fingers.map(f => ({type: f.type, tip: Array.from(f.tipPosition)}))}))});
  if (seen.length === count) { console.log(JSON.stringify(seen)); process.exit(0); }
});
setTimeout(() => { console.error('no frames: ' + seen.length); process.exit(3); }, 300000);
controller.connect();
"""


@pytest.fixture(scope="module")
def leapjs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with leapjs in it and a script that prints what it sees."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        pytest.skip("needs npm and node, to run leapjs")
    folder = tmp_path_factory.mktemp("leapjs")
    (folder / "watch.js").write_text(LEAPJS)
    command = [npm, "install", "--no-audit", "--no-fund", "--silent", "leapjs@1.1.1"]
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        pytest.skip("npm does not answer within a minute, so there is no leapjs")
    if done.returncode:
        pytest.skip("npm cannot install leapjs here")
    return folder


def test_leapjs_and_this_adapter_see_the_same_in_a_recording(leapjs: Path, shared: Path) -> None:
    messages = recorded(next(path for path in playbacks(shared) if "claps" in path.name))[:100]

    def serve(service: Service, connection: Any) -> None:
        service.greet(connection, HEADER)
        for found in messages:
            connection.send(json.dumps(found))
        service.released.wait(PATIENCE)

    with serving(serve) as (service, port):
        with opened(port) as stream:
            frames, skeleton = take(stream, len(messages)), stream.skeleton
        done = subprocess.run(
            [str(shutil.which("node")), "watch.js", str(port), str(len(messages))],
            cwd=leapjs,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    theirs = json.loads(done.stdout.splitlines()[-1])  # after words of its own
    assert len(theirs) == len(frames)
    assert {tuple(one) for one in service.settings} == {
        ("background",),
        ("focused",),
        ("optimizeHMD",),
    }
    compared = 0
    for other, frame in zip(theirs, frames, strict=True):
        for one in other["hands"]:
            ours = frame.positions[skeleton.index(f"{one['type']}_palm")]
            np.testing.assert_allclose(ours, leap_to_world(one["palm"]), atol=1e-6)
            for point in one["tips"]:
                joint = skeleton.index(f"{one['type']}_{FINGERS[point['type']]}_tip")
                ours = frame.positions[joint]
                np.testing.assert_allclose(ours, leap_to_world(point["tip"]), atol=1e-6)
                compared += 1
    assert compared > 500
