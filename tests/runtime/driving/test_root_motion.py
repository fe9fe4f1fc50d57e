"""The whole character goes along with the whole performer when both legs drive, and only then."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from devices.skeleton import Skeleton
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.root_motion import RootMotion, legs_of, root_motion
from tests.runtime.stick_figures import ARMS, BODY, LEGS, drive, make_figure


def test_legs_are_known_where_there_are_any() -> None:
    legs = legs_of(BODY)
    for leg, side in zip(legs, ("Left", "Right"), strict=True):
        assert {BODY.index(f"{joint}{side}") for joint in ("Hip", "Knee", "Ankle", "Foot")} <= leg
    assert not legs[0] & legs[1]
    finger = Skeleton(("a", "b", "c"), np.array([-1, 0, 1]), np.eye(3))
    assert legs_of(finger) == []


def test_the_body_goes_along_when_every_leg_drives() -> None:
    legs = legs_of(BODY)
    target = make_figure().skeleton.rest_positions

    def body(drives: Sequence[Drive], performers: list[frozenset[int]] = legs) -> RootMotion:
        return root_motion(Mapping(tuple(drives)), performers, BODY.rest_positions, target)

    assert body((*ARMS, *LEGS)).turns
    shin = np.linalg.norm([0.025, 0.405, 0.025])
    thigh = np.linalg.norm([0.035, 0.415, 0.015])
    assert body(LEGS).lift == pytest.approx(0.68 / (shin + thigh))
    assert body((*ARMS, LEGS[0])) == RootMotion(), "one leg"
    halves = (
        Drive(LEGS[0].source[:2], LEGS[0].target[:2]),
        Drive(LEGS[0].source[1:], LEGS[0].target[1:]),
    )
    assert body(halves) == RootMotion(), "one leg in two pieces"
    assert body((drive("ArmLeft", ("hip.L", "knee.L")), LEGS[1])) == RootMotion()
    assert body((*ARMS, *LEGS), []) == RootMotion(), "a hand has no legs"
    assert body(LEGS, legs[:1]) == RootMotion()
