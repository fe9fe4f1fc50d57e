"""VRChat's trackers: told apart by where they are, in our space, nothing guessed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pythonosc.osc_message import OscMessage
from scipy.spatial.transform import Rotation

from devices.bodies.tracker_joints import HEAD, JOINTS, assign_trackers, tracker_skeleton
from devices.errors import InputError
from devices.osc.vrchat import GONE, VrchatDecoder
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from tests.devices.vmc_sender import bundle, message, unity

REST = tracker_skeleton().rest_positions
STEP = 1 / 60
PLACES = [place for place in range(len(JOINTS)) if place != HEAD]


def tracker(which: object, place: np.ndarray, turn: Rotation | None = None) -> list[OscMessage]:
    """A tracker at a place of ours, written in Unity's space and Euler angles."""
    said = [message(f"/tracking/trackers/{which}/position", -place[0], *place[1:].tolist())]
    if turn is not None:
        z, x, y = Rotation.from_quat(unity(turn)).as_euler("zxy", degrees=True)
        said.append(message(f"/tracking/trackers/{which}/rotation", x, y, z))
    return said


def body(
    places: dict[object, int], *, scale: float = 1.0, turn: Rotation | None = None
) -> list[OscMessage]:
    said: list[OscMessage] = []
    turn = turn or Rotation.identity()
    for which, place in places.items():
        said += tracker(which, turn.apply(scale * REST[place]), turn)
    return said


def shown(decoder: VrchatDecoder, said: list[OscMessage], frames: int = 4) -> list[SkeletonFrame]:
    return [f for k in range(frames) for f in decoder.feed(bundle(said), 20.0 + k * STEP)]


@pytest.mark.parametrize("scale", [0.6, 1.0, 1.2])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_trackers_are_told_by_where_they_are(scale: float, yaw: float) -> None:
    order = np.random.default_rng(1).permutation(PLACES)
    places: dict[object, int] = {str(k + 1): int(place) for k, place in enumerate(order)}
    places["head"] = HEAD
    turn = Rotation.from_euler("y", yaw)
    frame = shown(VrchatDecoder(), body(places, scale=scale, turn=turn))[-1]
    assert frame.positions == pytest.approx(turn.apply(scale * REST), abs=1e-5)
    assert frame.rotations is not None
    assert (Rotation.from_quat(frame.rotations) * turn.inv()).magnitude().max() < 1e-5
    assert (frame.confidence == 1.0).all()


@pytest.mark.parametrize(
    "worn",
    [
        ("Hips", "LeftFoot", "RightFoot"),
        ("RightFoot", "Hips", "Chest", "LeftFoot"),
        ("LeftLowerLeg", "RightLowerLeg", "Hips", "LeftFoot", "RightFoot"),
    ],
)
def test_few_trackers_without_a_head_are_told_apart(worn: tuple[str, ...]) -> None:
    places: dict[object, int] = {k + 1: JOINTS.index(name) for k, name in enumerate(worn)}
    frame = shown(VrchatDecoder(), body(places))[-1]
    seen = sorted(places.values())
    assert frame.positions[seen] == pytest.approx(REST[seen], abs=1e-5)
    assert np.count_nonzero(~np.isnan(frame.positions[:, 0])) == len(seen)


def test_known_trackers_stay_where_they_are_when_another_comes_or_goes() -> None:
    decoder = VrchatDecoder()
    first: dict[object, int] = {1: JOINTS.index("Hips"), 2: JOINTS.index("LeftFoot")}
    shown(decoder, body(first))
    swapped = [*tracker(1, REST[JOINTS.index("LeftFoot")]), *tracker(2, REST[0])]
    late = [*swapped, *tracker(5, REST[JOINTS.index("RightFoot")])]
    frames = [f for k in range(100) for f in decoder.feed(bundle(late), 25.0 + k * STEP)]
    assert frames[-1].positions[0] == pytest.approx(REST[JOINTS.index("LeftFoot")], abs=1e-5)
    assert frames[-1].positions[JOINTS.index("RightFoot")] == pytest.approx(
        REST[JOINTS.index("RightFoot")], abs=1e-5
    )
    gone = [f for k in range(200) for f in decoder.feed(bundle(swapped), 27.0 + k * STEP)]
    assert gone[-1].arrival - 27.0 > GONE
    assert np.isnan(gone[-1].positions[JOINTS.index("RightFoot")]).all()
    assert gone[-1].confidence[JOINTS.index("RightFoot")] == 0.0


def test_bare_messages_make_frames_too() -> None:
    decoder = VrchatDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(20):
        said = [one for n in (1, 2, 3) for one in tracker(n, np.array([0.1 * n, 1.0, 0.01 * k]))]
        for number, one in enumerate(said):
            frames += decoder.feed(one.dgram, k * STEP + number * 1e-5)
    assert len(frames) == 20
    for k, frame in enumerate(frames):
        there = ~np.isnan(frame.positions[:, 0])
        assert frame.positions[there, 2] == pytest.approx(0.01 * k, abs=1e-6)


def test_places_can_be_given() -> None:
    with open_stream("vrchat://127.0.0.1:0?trackers=1:Chest,2:LeftFoot") as stream:
        assert stream.skeleton.names == JOINTS
    decoder = VrchatDecoder({1: JOINTS.index("Chest")})
    frame = shown(decoder, [*tracker(1, REST[0]), *tracker(2, REST[1])])[-1]
    assert frame.positions[JOINTS.index("Chest")] == pytest.approx(REST[0], abs=1e-6)
    assert np.count_nonzero(frame.confidence) == 1
    for wrong in ("9:Chest", "1:Tail", "1", "1:Chest,2:Chest"):
        with pytest.raises(InputError, match="NUMBER:JOINT"):
            open_stream(f"vrchat://127.0.0.1:0?trackers={wrong}")


@pytest.mark.parametrize(
    "bad",
    [
        message("/tracking/trackers/1/position", 1.0, 2.0),
        message("/tracking/trackers/1/position", "1", "2", "3"),
        message("/tracking/trackers/1/position", math.nan, 0.0, 0.0),
        message("/tracking/trackers/1/position", 1e30, 0.0, 0.0),
        message("/tracking/trackers/head/rotation", math.inf, 0.0, 0.0),
    ],
)
def test_what_is_wrong_is_counted_and_left_out(bad: OscMessage) -> None:
    decoder = VrchatDecoder()
    frames = shown(decoder, [bad, *tracker(2, REST[0])])
    assert decoder.refused == 4
    assert np.count_nonzero(frames[-1].confidence) == 1


@pytest.mark.parametrize("which", ["0", "9", "12", "HEAD", "١", "1/extra"])
def test_other_addresses_are_no_fault(which: str) -> None:
    decoder = VrchatDecoder()
    assert shown(decoder, tracker(which, REST[0])) == []
    assert decoder.refused == 0


def test_a_place_is_never_given_twice() -> None:
    places = assign_trackers(np.zeros((8, 3)), None, None)
    assert sorted(places) == PLACES
    more = assign_trackers(
        np.zeros((3, 3)), REST[HEAD], np.array([0.0, 0.0, 1.0, 0.0]), taken=[0, 1, 3]
    )
    assert not {0, 1, 3, HEAD} & set(more.tolist())
