"""Blend shapes at the door: bounded names and weights, and the names of the other side."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from devices.blend_shapes import (
    LONGEST_NAME,
    MOST_BLENDS,
    blend_weight,
    checked_blends,
    mirrored_blends,
)
from devices.mediapipe.joints import POSE_LANDMARKS
from devices.mediapipe.landmark_messages import LandmarkDecoder
from devices.osc.vmc_decoder import VmcDecoder
from devices.suits.rokoko import RokokoDecoder
from tests.devices.sender_packets import ROKOKO, bones, plain, posed, rokoko_v3
from tests.devices.vmc_sender import bones as vmc_bones
from tests.devices.vmc_sender import bundle, message, ok

STEP = 1 / 60


@pytest.mark.parametrize(
    ("value", "weight"),
    [(0.25, 0.25), (1, 1.0), (-3.0, 0.0), (7.5, 1.0), (10**400, None), (True, None)]
    + [(bad, None) for bad in (math.nan, math.inf, -math.inf, "1", None, [1.0])],
)
def test_weights_are_finite_and_clipped(value: object, weight: float | None) -> None:
    assert blend_weight("jawOpen", value) == weight


@pytest.mark.parametrize("name", ["", "a" * (LONGEST_NAME + 1), "a\n", "\ud800", 3, None])
def test_names_are_short_printable_texts(name: object) -> None:
    assert blend_weight(name, 0.5) is None


def test_a_face_is_bounded_and_an_empty_one_is_none() -> None:
    many = checked_blends((f"shape {k}", 0.5) for k in range(10 * MOST_BLENDS))
    assert many is not None
    assert len(many) == MOST_BLENDS
    assert checked_blends([]) is None
    assert checked_blends([("a", math.nan)]) is None


def test_mirroring_exchanges_sides_and_twice_is_nothing() -> None:
    face = {"eyeBlinkLeft": 0.1, "eyeBlinkRight": 0.2, "Blink_L": 0.3, "jawOpen": 0.4}
    other = mirrored_blends(face)
    assert other == {"eyeBlinkRight": 0.1, "eyeBlinkLeft": 0.2, "Blink_R": 0.3, "jawOpen": 0.4}
    assert mirrored_blends(other) == face


def test_vmc_frames_hold_the_face_that_was_applied_last() -> None:
    decoder = VmcDecoder()
    faces = []
    for k in range(8):
        said = [*vmc_bones(), ok(1)]
        if k == 2:
            said += [message("/VMC/Ext/Blend/Val", "Joy", 0.5)]  # not applied yet
        if k == 4:
            said += [
                message("/VMC/Ext/Blend/Val", "A", 3.0),
                message("/VMC/Ext/Blend/Val", "B", math.nan),
                message("/VMC/Ext/Blend/Apply"),
            ]
        faces += [frame.blends for frame in decoder.feed(bundle(said), 5.0 + k * STEP)]
    assert faces[0] is None
    assert faces[-1] == {"Joy": 0.5, "A": 1.0}
    assert None in faces
    assert faces[-1] is faces[-2], "a face that is held takes no room"
    assert decoder.refused == 1
    decoder.feed(bundle([message("/VMC/Ext/Blend/Val", "A", 0.25)]), 6.0)
    decoder.feed(bundle([message("/VMC/Ext/Blend/Apply")]), 6.0)
    assert decoder.expressions == {"Joy": 0.5, "A": 0.25}


def test_mediapipe_gives_the_shapes_of_each_face_and_holds_them() -> None:
    decoder = LandmarkDecoder()
    body = np.random.default_rng(0).uniform(-0.5, 0.5, (len(POSE_LANDMARKS), 3)).tolist()
    shapes = [
        {"category_name": "_neutral", "score": 0.0},
        {"category_name": "jawOpen", "score": 0.75},
        {"categoryName": "eyeBlinkLeft", "score": 0.5},
        {"category_name": 7, "score": 0.5},
        "damage",
    ]

    def fed(**more: object) -> list[object]:
        data = json.dumps({"pose_world_landmarks": [body], **more}).encode()
        return [frame.blends for frame in decoder.feed(data, 1.0)]

    assert fed() == [None]
    assert fed(face_blendshapes=[shapes]) == [{"jawOpen": 0.75, "eyeBlinkLeft": 0.5}]
    assert fed() == [{"jawOpen": 0.75, "eyeBlinkLeft": 0.5}]
    assert fed(face_blendshapes=shapes) == [{"jawOpen": 0.75, "eyeBlinkLeft": 0.5}]
    assert fed(face_blendshapes=[{"jawOpen": 0.25}]) == [{"jawOpen": 0.25}]
    for damage in (3, "face", [3], [[3]], {"x": "y"}, None):
        assert fed(face_blendshapes=damage) == [{"jawOpen": 0.25}]


def test_rokoko_gives_the_face_of_an_actor_in_percent() -> None:
    scene = rokoko_v3({"Ann": bones(posed(ROKOKO))}, 1.0)
    actor = scene["scene"]["actors"][0]
    actor["face"] = {"faceId": "abc", "jawOpen": 40, "eyeBlinkLeft": 250.0, "bad": None}
    (frame,) = RokokoDecoder().feed(plain(scene), 1.0)
    assert frame.blends == {"jawOpen": 0.4, "eyeBlinkLeft": 1.0}
    del actor["face"]
    (frame,) = RokokoDecoder().feed(plain(scene), 1.0)
    assert frame.blends is None
