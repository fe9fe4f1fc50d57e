"""The programs that write joints as NI mate does: Animata, OMNI, Kinect, Skelecaster."""

from __future__ import annotations

import numpy as np
import pytest

from devices.kinect.joints import KINECT_V2
from devices.osc.nimate import FORMATS, NimateDecoder
from devices.osc.openni_joints import OPENNI, joint_called
from tests.devices.osc.nimate_bodies import FAR, body, fed, joint, kinect_body, standing
from tests.devices.sender_packets import NIMATE, animata, kinect2, nimate, osceleton, skelecaster
from tests.devices.vmc_sender import bundle, message


def test_animata_s_pictures_stand_upright_whichever_way_they_run() -> None:
    for mirror in (1.0, -1.0):
        for down in (1.0, -1.0):
            said = [animata(body(k) * (mirror, down, 0.0), user=3) for k in range(4)]
            frame = fed(NimateDecoder(), said)[-1]
            wanted = standing(body(2) * (1.0, 1.0, 0.0))
            middle = frame.positions[joint("Pelvis")] - wanted[joint("Pelvis")]
            assert middle[1] == pytest.approx(0.0, abs=5e-3)
            assert frame.positions - middle == pytest.approx(wanted, abs=5e-3)
            assert (frame.positions[:, 2] == 0.0).all()


def test_omni_is_a_list_without_names() -> None:
    order = [joint(n) for n in OPENNI.names if n != "Pelvis"]
    order = [*order[2::-1], *order[3:6], *order[9:12], *order[6:9], *order[12:]]
    values = [(body(k)[order] + FAR) @ np.diag([-1.0, 1.0, -1.0]) for k in range(4)]
    frame = fed(NimateDecoder(), [[message("skeleton", *v.ravel().tolist())] for v in values])[-1]
    assert frame.positions == pytest.approx(standing(body(3) + FAR), abs=2e-3)
    names = [OPENNI.names[j] for j in order[::-1]]
    omni = tuple(j for name in names if (j := joint_called(name)) is not None)
    told = NimateDecoder("nimate", omni=omni)
    frame = fed(told, [[message("/skeleton", *v[::-1].ravel().tolist())] for v in values])[-1]
    assert frame.positions == pytest.approx(standing(body(3) + FAR), abs=2e-3)
    assert NimateDecoder().feed(message("skeleton", *[0.5] * 7).dgram, 1.0) == []


def test_a_given_scale_is_believed() -> None:
    said = [nimate(100.0 * (body(k) + FAR), what="place") for k in range(3)]
    frame = fed(NimateDecoder(scale=0.01), said)[-1]
    places = body(2) + FAR
    wanted = places - (0.0, places[:, 1].min(), 0.0)
    assert frame.positions == pytest.approx(wanted, abs=2e-3)


@pytest.mark.parametrize("bundled", [True, False], ids=["bundles", "bare"])
def test_kinect_s_joints_are_metres(bundled: bool) -> None:
    said = [kinect2(kinect_body(k)) for k in range(6)]
    full = fed(NimateDecoder("kinect2"), said, bundled=bundled)
    lowest = kinect_body()[:, 1].min()
    assert len(full) >= 5
    for k, frame in enumerate(full):
        wanted = kinect_body(k) - (0.0, lowest, 0.0)
        assert frame.positions == pytest.approx(wanted, abs=1e-5)
    some = fed(NimateDecoder(), said, bundled=bundled)[-1]
    last = len(full) - 1
    for ours, theirs in (("LeftHand", "HandLeft"), ("RightFoot", "AnkleRight")):
        wanted = kinect_body(last)[KINECT_V2.index(theirs)] - (0.0, lowest, 0.0)
        assert some.positions[joint(ours)] == pytest.approx(wanted, abs=1e-5)


def test_hands_of_kinect_are_no_joints() -> None:
    decoder = NimateDecoder()
    assert decoder.feed(message("/bodies/7/hands/Left", "Open", "High").dgram, 1.0) == []
    assert decoder.refused == 0


def test_skelecaster_s_bodies_come_at_once() -> None:
    decoder = NimateDecoder("skelecaster")
    one, two = kinect_body(), kinect_body(5) + np.array([1.5, 0.0, 0.0])
    states = (2, 1, 0, *[2] * 22)
    frames = decoder.feed(skelecaster({2**63 + 5: one, 17: two}, states), 3.0)
    assert [frame.performer for frame in frames] == [0, 1]
    assert frames[0].confidence.tolist() == [1.0, 0.5, 0.0, *[1.0] * 22]
    assert np.isnan(frames[0].positions[2]).all()
    lowest = np.delete(one[:, 1], 2).min()
    assert frames[0].positions[3] == pytest.approx(one[3] - (0.0, lowest, 0.0), abs=1e-5)
    again = decoder.feed(skelecaster({17: two, 3: one}, states), 3.5)
    assert [frame.performer for frame in again] == [1, 0]
    (told,) = NimateDecoder().feed(skelecaster({1: one}), 3.0)
    assert told.positions.shape == (16, 3)
    assert NimateDecoder().feed(skelecaster({}), 3.0) == []


@pytest.mark.parametrize("data", [skelecaster({1: kinect_body()})[:-1], b"\1\1\2", b"\1\1\2\xff"])
def test_a_skelecaster_that_is_too_short_is_refused(data: bytes) -> None:
    decoder = NimateDecoder()
    assert decoder.feed(data, 1.0) == []
    assert decoder.refused == 1


def test_one_format_hears_only_itself() -> None:
    told: dict[str, bytes] = {
        "nimate": bundle(nimate(body() + FAR)),
        "osceleton": bundle(osceleton(body() + FAR)),
        "animata": bundle(animata(body())),
        "kinect2": bundle(kinect2(kinect_body())),
        "skelecaster": skelecaster({1: kinect_body()}),
    }
    assert set(told) == set(FORMATS)
    for format in FORMATS:
        for other, data in told.items():
            decoder = NimateDecoder(format)
            frames = [f for k in range(3) for f in decoder.feed(data, 1.0 + 0.02 * k)]
            heard = other == format or (format == "nimate" and other in ("osceleton", "animata"))
            assert bool(frames) == heard, (format, other)


def test_nimate_may_write_as_osceleton_does_in_its_own_axes() -> None:
    places = body() + FAR
    said = [
        message("/joint", name, 1, *(places[joint(ours)] * (-1.0, 1.0, -1.0)).tolist())
        for ours, name in NIMATE.items()
    ]
    frame = fed(NimateDecoder("nimate"), [said] * 3)[-1]
    assert frame.positions == pytest.approx(standing(places), abs=2e-3)
