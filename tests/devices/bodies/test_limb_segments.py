"""Limbs without names: where they are taken to bend."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from devices.bodies.limb_segments import arm_segments, bend_between, leg_segments


def polyline(corners: list[tuple[float, float, float]], bones: int) -> np.ndarray:
    """Nodes (bones + 1, 3) at equal distances along a polyline, and thus near its corners only."""
    points = np.array(corners)
    along = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    wanted = np.linspace(0.0, along[-1], bones + 1)
    return np.column_stack([np.interp(wanted, along, points[:, axis]) for axis in range(3)])


def ends(segments: tuple[tuple[int, ...], ...]) -> list[int]:
    return [segment[-1] for segment in segments]


def test_a_straight_arm_is_divided_where_a_human_arm_is() -> None:
    arm = polyline([(0, 0, 0), (1, 0, 0)], 100)
    elbow, wrist, tip = ends(arm_segments(range(101), arm))
    assert (elbow, wrist, tip) == pytest.approx((40, 77, 100), abs=3)


def test_a_straight_leg_is_divided_where_a_human_leg_is() -> None:
    leg = polyline([(0, 1, 0), (0.1, 0, 0)], 10)
    assert ends(leg_segments(range(11), leg)) == [5, 9, 10]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("elbow", [0.3, 0.5, 0.6])
def test_an_arm_bends_where_its_rest_pose_does(elbow: float, scale: float) -> None:
    reach = (elbow, elbow + (0.8 - elbow) * 0.5, (0.8 - elbow) * 0.8)
    arm = scale * polyline([(0, 0, 0), (elbow, 0, 0), (reach[1], reach[2], 0), (0.6, 0.6, 0)], 20)
    corner = int(np.abs(np.linalg.norm(arm - scale * np.array([elbow, 0, 0]), axis=1)).argmin())
    assert ends(arm_segments(range(21), arm))[0] == pytest.approx(corner, abs=1)


@pytest.mark.parametrize("foot", [0.1, 0.2, 0.3])
def test_a_foot_begins_where_the_leg_turns_forward(foot: float) -> None:
    leg = polyline([(0, 1, 0), (0, 0.5, 0.05), (0, 0.0, 0), (0, -0.02, foot)], 24)
    thigh, shin, end = leg_segments(range(25), leg)
    assert leg[shin[-1], 1] < 0.06
    assert abs(leg[shin[-1], 2]) < 0.06
    assert leg[thigh[-1], 1] == pytest.approx(0.5, abs=0.1)
    assert end[-1] == 24


def test_few_nodes_make_fewer_parts() -> None:
    line = polyline([(0, 1, 0), (0, 0, 0)], 3)
    assert arm_segments([2], line) == leg_segments([2], line) == bend_between([2], line) == ()
    assert arm_segments([0, 2], line) == bend_between([0, 2], line) == ((0, 2),)
    assert leg_segments([0, 1, 2], line) == bend_between([0, 1, 2], line) == ((0, 1), (1, 2))
    assert len(arm_segments(range(4), line)) == 3


def test_a_chain_of_a_thousand_nodes_is_divided_too() -> None:
    arm = polyline([(0, 0, 0), (1, 0, 0)], 1000)
    assert ends(arm_segments(range(1001), arm))[0] == pytest.approx(400, abs=30)


PLACES = st.sampled_from([0, 1, 5])


@given(arrays(np.float64, st.tuples(st.integers(0, 7), st.just(3)), elements=PLACES))
def test_any_chain_is_covered_from_its_start_piece_by_piece(points: np.ndarray) -> None:
    chain = list(range(len(points)))
    for divide in (arm_segments, leg_segments, bend_between):
        pieces = divide(chain, points)
        joined = [node for piece in pieces for node in piece[1:]]
        assert joined == chain[1 : 1 + len(joined)]
        assert all(len(piece) > 1 for piece in pieces)
        assert len(pieces) <= 3
        left_out = points[len(joined) :]
        assert not len(left_out) or (left_out == left_out[0]).all()
