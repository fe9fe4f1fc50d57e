"""Real recordings: bones of one length, and the same as leapjs, the maker's own client."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.leap.joints import FINGERS, SIDES, leap_to_world
from devices.leap.websocket_messages import LeapDecoder
from tests.devices.leap.leap_messages import HEADER, feed
from tests.devices.leap.leap_service import Service, opened, serving
from tests.devices.leap.leapjs_recordings import playbacks, recorded
from tests.waiting import PATIENCE, frames_of


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
            frames, skeleton = frames_of(stream, len(messages)), stream.skeleton
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
