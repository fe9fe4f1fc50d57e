"""The small pictures of the best matches: what they show, and what a click and a key take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from runtime.control.actions import press
from runtime.panel.gui import GOLD
from runtime.panel.match_pictures import SIZE as PICTURE
from runtime.render.tubes import PAIR_COLOURS
from tests.runtime.panel.screen import SIZE, Screen, covered
from tests.runtime.staged import StagedShow
from tests.runtime.stick_figures import frame, pose

GAP, PADDING = 8.0, 12.0 + 14.0  # [px] between pictures, and below them to the bar
BESIDE = 296  # [px] a column of the picture between the legend and the card


def bar_begins(picture: NDArray[np.uint8]) -> int:
    """The first row of the bar [px]."""
    return 300 + int(np.flatnonzero(covered(picture)[300:, BESIDE]).min())


def pictures(picture: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """The four pictures of matches, cut out."""
    bottom = round(bar_begins(picture) - PADDING)
    lefts = [round(SIZE[0] / 2.0 + (n - 2) * (PICTURE[0] + GAP) + GAP / 2.0) for n in range(4)]
    rows = slice(round(bottom - PICTURE[1]), bottom)
    return [picture[rows, left : left + round(PICTURE[0])] for left in lefts]


def middles(picture: NDArray[np.uint8]) -> list[tuple[float, float]]:
    """The middles of the pictures of matches [px]."""
    bottom = bar_begins(picture) - PADDING
    return [
        (SIZE[0] / 2.0 + (n - 1.5) * (PICTURE[0] + GAP), bottom - PICTURE[1] / 2.0)
        for n in range(4)
    ]


def shares(picture: NDArray[np.uint8]) -> tuple[list[int], list[int]]:
    """The numbers of the pair colours at the left of a picture, and at the right."""
    encoded = 255.0 * PAIR_COLOURS ** (1.0 / 2.2)
    near = np.abs(picture[:, :, None].astype(float) - encoded).max(axis=3) < 6.0
    half = round(0.44 * PICTURE[0])
    left, right = (
        np.flatnonzero(side.sum(axis=(0, 1)) > 5).tolist()
        for side in np.split(near, [half], axis=1)
    )
    return left, right


def framed(picture: NDArray[np.uint8]) -> list[bool]:
    """Which of the pictures has a golden frame."""
    gold = 255.0 * np.array(GOLD)
    return [
        bool((np.abs(one[20:60, :3] - gold).max(axis=2) < 12.0).any(axis=1).all())
        for one in pictures(picture)
    ]


def test_each_shows_what_drives_what_in_one_colour(screen: Screen, show: StagedShow) -> None:
    show.strike()
    match = show.match_session.matches[0]
    assert len(match.best) == 4
    picture = screen.draw(12)
    for one, mapping in zip(pictures(picture), match.best, strict=True):
        of_performer, of_character = shares(one)
        assert of_performer == of_character
        assert len(of_performer) == len(mapping.drives)
    assert framed(picture) == [True, False, False, False]


def test_a_click_or_a_key_takes_one(screen: Screen, show: StagedShow) -> None:
    show.strike()
    (match,) = show.match_session.matches
    offered = [mapping.drives for mapping in match.best]
    assert screen.click(*middles(screen.draw(4))[2])
    show.strike(0.1)
    assert match.mapping.drives == offered[2]
    assert framed(screen.draw(4)) == [False, False, True, False]
    press("match-2", show.controls)
    show.strike(0.2)
    assert match.mapping.drives == offered[1]


def test_they_are_there_only_while_a_match_is_looked_for(screen: Screen, show: StagedShow) -> None:
    show.strike()
    left = screen.panel._matches
    screen.draw(4)
    assert left.left < SIZE[0]
    show.match_session.accept()
    picture = screen.draw(4)
    assert left.left > SIZE[0]
    assert not covered(picture)[400 : bar_begins(picture), BESIDE:].any()


def test_all_of_them_follow_the_performer_however_often_the_show_is_looked_at(
    screen: Screen, show: StagedShow
) -> None:
    show.strike()
    moments = []
    for angle in (0.0, 0.6):
        show.performer.follow(frame(pose({"HipLeft": (-angle, 0.0, angle)}), 0.1 + angle))
        for _ in range(8):
            screen.now += 0.1  # so that every picture of the window looks at the show
            picture = screen.draw(1)
        moments.append(pictures(picture))
    half = round(0.44 * PICTURE[0])
    for one, other in zip(*moments, strict=True):
        assert (one[:, :half] != other[:, :half]).any()
