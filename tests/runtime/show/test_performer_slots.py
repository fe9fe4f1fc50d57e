"""Which performer drives when several are in view."""

from __future__ import annotations

import numpy as np
import pytest

from devices.skeleton import SkeletonFrame
from runtime.show.performer_slots import PATIENCE, PerformerSlots


def frame(performer: int, time: float) -> SkeletonFrame:
    return SkeletonFrame(time, np.zeros((1, 3)), None, np.ones(1), performer)


def leads(*frames: tuple[int, float]) -> list[bool]:
    slots = PerformerSlots()
    return [slots.slot(frame(performer, time)) == 0 for performer, time in frames]


def test_the_first_seen_leads_whoever_else_comes() -> None:
    assert leads((7, 0.0), (3, 0.0), (7, 0.1), (3, 0.1), (3, 0.2)) == [1, 0, 1, 0, 0]


def test_a_lost_lead_is_waited_for_and_then_replaced() -> None:
    soon, late = PATIENCE * 0.9, PATIENCE * 1.1
    assert leads((1, 0.0), (2, soon), (1, soon + 0.01)) == [True, False, True]
    assert leads((1, 0.0), (2, soon), (2, late), (1, late)) == [True, False, True, False]


def test_one_who_comes_back_alone_leads_however_long_it_took() -> None:
    assert leads((1, 0.0), (1, 60.0), (2, 60.1)) == [True, True, False]


@pytest.mark.parametrize("late", [1e-6, 0.02, 0.3])
def test_a_bystander_whose_clock_is_behind_does_not_take_over(late: float) -> None:
    assert leads((1, 5.0), (2, 5.0 - late), (1, 5.03), (2, 5.03 - late)) == [1, 0, 1, 0]


def test_a_clock_that_is_set_back_far_begins_anew() -> None:
    assert leads((1, 100.0), (2, 0.0), (2, 0.1)) == [True, True, True]
    assert leads((1, 100.0), (1, 0.0), (2, 0.1)) == [True, True, False]


def parts(count: int, *frames: tuple[int, float]) -> list[int | None]:
    slots = PerformerSlots(count)
    return [slots.slot(frame(performer, time)) for performer, time in frames]


def test_parts_are_given_in_the_order_of_arrival_and_stay() -> None:
    everybody = [(7, 0.0), (3, 0.0), (5, 0.0), (5, 0.1), (3, 0.1), (7, 0.1)]
    assert parts(2, *everybody) == [0, 1, None, None, 1, 0]
    assert parts(3, *everybody) == [0, 1, 2, 2, 1, 0]


def test_the_part_of_one_who_left_goes_to_who_comes_next() -> None:
    late = PATIENCE * 1.1
    assert parts(2, (7, 0.0), (3, 0.0), (3, late), (5, late), (7, late)) == [0, 1, 1, 0, None]
