"""The panel over the picture: it shows the state of a show, and its buttons do the actions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest
from imgui_bundle import imgui
from numpy.typing import NDArray

from runtime.control.actions import ACTIONS
from runtime.control.keys import KEYS
from runtime.control.session_actions import SESSION_ACTIONS
from runtime.control.show_controls import ShowControls
from runtime.driving.choices import Candidate
from runtime.driving.driver import RELATIVE, DrivenPart
from runtime.panel import keys_page
from runtime.show.scene import NOTHING_TAKEN
from runtime.status.show_status import ShowStatus
from tests.runtime.panel.screen import SIZE, Screen, covered
from tests.runtime.staged import StagedShow

SMALL = (800, 600)
BESIDE = {1280: 990, 800: 740}  # [px] a column in which there is nothing above the bar
SIZES = (SMALL, SIZE, (1920, 1080), (3840, 2160))
DOUBLE = 27  # a pixel over which two cards lie is darker than this, one under a single card is not
LETTER_HEIGHT = 9  # [px] the lowest that can be read


@pytest.fixture
def small(context: moderngl.Context, show: StagedShow) -> Iterator[Screen]:
    screen = Screen(context, show, SMALL)
    yield screen
    screen.panel.close()
    screen.target.release()


@pytest.fixture
def words(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """The words on the buttons that are drawn from now on."""
    seen: set[str] = set()
    draw = imgui.button

    def button(label: str, *more: object) -> bool:
        seen.add(label.partition("##")[0])
        return bool(draw(label, *more))

    monkeypatch.setattr(imgui, "button", button)
    return seen


def test_the_panel_leaves_the_middle_of_the_stage_free(screen: Screen, show: StagedShow) -> None:
    show.match_session.accept()
    over = covered(screen.draw())
    assert 0.05 < over.mean() < 0.45
    assert not over[250:560, 400:1250].any()


def test_the_legend_of_many_characters_leaves_the_bar_free(
    screen: Screen, show: StagedShow
) -> None:
    status = show._opened.status()
    bar = slice(_top_of_bar(screen.draw()), None)
    part = DrivenPart(
        "left leg", "tentacle 4 of 8, the upper one on the left", (0,), (0,), RELATIVE
    )
    few, many = (
        [replace(status.characters[0], name=f"squid {n}", parts=parts) for n in range(count)]
        for count, parts in ((2, []), (30, [part] * 8))
    )
    screen.status = lambda: replace(status, characters=few)
    before = screen.draw()[bar, :300].copy()
    screen.status = lambda: replace(status, characters=many)
    after = screen.draw()
    np.testing.assert_array_equal(after[bar, :300], before)
    assert not covered(after)[bar.start - 4 : bar.start].any(), "something lies above the bar"
    assert covered(after)[bar.start - 60 : bar.start - 20, 20:240].all(), "the room is used"


def _top_of_bar(picture: NDArray[np.uint8]) -> int:
    """The first row [px] of the bar, where nothing else is."""
    beside = BESIDE[picture.shape[1]]
    return 300 + int(np.flatnonzero(covered(picture)[300:, beside]).min())


def _rows_of_bar(picture: NDArray[np.uint8]) -> list[float]:
    """The middle [px] of each row of buttons of the bar, the highest first."""
    height, scale = len(picture), max(round(8.0 * len(picture) / 720.0) / 8.0, 0.5)
    first, last = _top_of_bar(picture) + 27.0 * scale, height - (14.0 + 27.0) * scale
    return [first + row * 36.0 * scale for row in range(1 + round((last - first) / (36.0 * scale)))]


def test_a_hidden_panel_draws_nothing(screen: Screen, show: StagedShow) -> None:
    show.controls.view.panel = False
    screen.now += 60.0  # after all that has just happened
    show.now += 60.0
    assert not covered(screen.draw()).any()


def test_the_stage_makes_room_for_the_panel_while_it_is_shown(
    screen: Screen, show: StagedShow
) -> None:
    assert show.scene is not None
    screen.draw(5)
    left, right, top, bottom = show.scene.taken
    assert min(left, top, bottom) > 0.05
    assert right == 0.0
    over = covered(screen.draw())
    stage = over[round(720 * top) : round(720 * (1.0 - bottom)), round(1280 * left) :]
    assert not stage.any(), "nothing lies on what is framed"
    show.controls.view.sliders = True
    screen.draw(5)
    assert show.scene.taken[1] > 0.1
    show.controls.view.panel = False
    screen.draw(5)
    assert show.scene.taken == NOTHING_TAKEN


def test_the_list_of_keys_fits_the_picture(screen: Screen, show: StagedShow) -> None:
    show.controls.view.help = True
    over = covered(screen.draw())
    assert over.mean() > 0.3
    assert not over[:, :3].any()
    assert not over[:, -3:].any()


def test_buttons_of_the_bar_do_their_actions_and_clicks_beside_it_pass(
    screen: Screen, show: StagedShow
) -> None:
    """A row of clicks along the bar presses each of its buttons that lights up, at least once."""
    screen.draw()
    pressed: set[str] = set()
    lights = ("hold", "freeze", "blackout", "sliders", "help", "panel")
    rows = _rows_of_bar(screen.draw())
    for x, y in [(x, y) for y in reversed(rows) for x in range(20, 1262, 14)]:
        before = {name: _lit(show.controls, name) for name in lights}
        kept = screen.click(x, y)
        assert kept or y < rows[-1], "a bar may have fewer rows after a click"
        pressed |= {name for name in lights if _lit(show.controls, name) != before[name]}
        show.controls.view.help = show.controls.view.sliders = False
        show.controls.view.panel = True
        show.controls.leaving = False
        show.takes.stop()
    assert pressed >= {"hold", "freeze", "blackout", "help", "panel"}
    assert not screen.click(800, 400)


def test_the_last_button_of_a_full_bar_stays_in_the_picture(
    screen: Screen, show: StagedShow
) -> None:
    status = show._opened.status()
    sought = replace(
        status.characters[0],
        name="mannequin",
        candidate=Candidate(1, 21, 0.8),
        matching=True,
        performing=True,
    )
    screen.status = lambda: replace(status, characters=[sought, sought])
    bar = _rows_of_bar(screen.draw())[-1]
    for x in range(1255, 1200, -6):
        screen.click(x, bar)
        if show.controls.view.help:
            return
    pytest.fail("the last button shows the keys")


def test_a_button_says_at_once_what_it_does(screen: Screen) -> None:
    before = screen.draw()
    screen.panel.gui.cursor(1236.0, _rows_of_bar(before)[-1])
    screen.draw(1)
    screen.now -= 0.19  # hardly any time later
    changed = np.abs(screen.draw(1).astype(int) - before).max(axis=2) > 2
    assert changed.sum() > 6000, "more than the button itself"


@pytest.mark.parametrize("in_session", [True, False])
def test_the_page_of_keys_has_every_key_once(in_session: bool) -> None:
    groups = keys_page._groups(in_session=in_session)
    shown = [key for _, rows in groups for key, _, _ in rows if key != "1 to 4"] + list("1234")
    mouse = [key for key, _, _ in keys_page.MOUSE]
    idle = set() if in_session else set(SESSION_ACTIONS) - {"loop"}
    keys = [keys_page.SPELLED.get(key, key) for key, name in KEYS.items() if name not in idle]
    assert sorted(shown) == sorted([*keys, *mouse])


@pytest.mark.parametrize("size", [*SIZES, (640, 360)])
def test_the_page_of_keys_is_laid_out_to_fit(screen: Screen, size: tuple[int, int]) -> None:
    groups = keys_page._groups(in_session=True)
    gui = screen.panel.gui
    gui.begin(size, 0.1)
    margin = 2.0 * 28.0 * gui.scale
    layout = keys_page._fitting(groups, size[0] - margin, size[1] - margin - 40.0 * gui.scale)
    imgui.end_frame()
    assert layout.fits
    assert layout.height <= size[1] - margin
    assert len(layout.columns) * layout.column <= size[0]
    assert [group for column in layout.columns for group in column] == groups
    assert layout.texts is (size != SMALL), "no room for them there"


def test_sliders_leave_the_bar_free(screen: Screen, show: StagedShow) -> None:
    show.controls.view.sliders = True
    over = covered(screen.draw())
    bar = _top_of_bar(screen.draw())
    assert over[100:400, 1100].all()
    assert not over[bar - 4 : bar].any()


@pytest.mark.parametrize("size", SIZES)
def test_no_card_lies_over_another(
    context: moderngl.Context, show: StagedShow, size: tuple[int, int]
) -> None:
    show.controls.view.sliders = True
    show.controls.notices.show("a line about what has just happened, as long as such lines are")
    screen = Screen(context, show, size)
    picture = screen.draw(8)
    screen.panel.close()
    screen.target.release()
    assert picture.max(axis=2).min() > DOUBLE
    over = covered(picture)
    assert not over[:, :3].any()
    assert not over[:, -3:].any()
    assert show.scene is not None
    left, right, top, bottom = show.scene.taken
    width, height = size
    down, across = slice(round(height * top), int(height * (1.0 - bottom)) - 1), round(width * left)
    line = 60 * height // 720  # of what has just happened
    stage = over[down, across : round(width * (1.0 - right))][line:]
    assert stage.shape[0] > height // 3
    assert not stage.any(), "nothing lies on what is framed"


def test_what_has_happened_is_said_on_the_card_at_the_top(screen: Screen, show: StagedShow) -> None:
    before = screen.draw(6)
    show.controls.notices.show("the stage is dark now")
    changed = np.abs(screen.draw(2).astype(int) - before).max(axis=2) > 2
    rows = np.flatnonzero(changed.any(axis=1))
    assert len(rows) > 0
    assert rows.max() < 150


def test_the_buttons_keep_their_names_in_a_small_window(
    small: Screen, show: StagedShow, words: set[str]
) -> None:
    status = show._opened.status()
    sought = replace(
        status.characters[0], candidate=Candidate(1, 21, 0.8), matching=True, performing=True
    )
    small.status = lambda: replace(status, characters=[sought])
    small.draw()
    said = {each.split(" ", 1)[1] for each in words if " " in each}
    wanted = {"Record", "Freeze", "Blackout", "Match again", "Sliders", "Full screen"}
    assert said >= {*wanted, ACTIONS["accept"].label, ACTIONS["keep-match"].label}


def test_every_button_of_a_bar_with_two_rows_can_be_pressed(
    small: Screen, show: StagedShow
) -> None:
    rows = _rows_of_bar(small.draw())
    assert len(rows) == 2
    lights = ("freeze", "blackout", "sliders", "help", "panel", "audience")
    pressed: set[str] = set()
    for y in rows:
        for x in range(20, 790, 14):
            before = {name: _lit(show.controls, name) for name in lights}
            small.click(x, y)
            pressed |= {name for name in lights if _lit(show.controls, name) != before[name]}
            show.controls.view.help = show.controls.view.sliders = False
            show.controls.view.panel = True
            show.controls.leaving = False
            show.takes.stop()
    assert pressed == set(lights)


def _lit(controls: ShowControls, name: str) -> float:
    read = ACTIONS[name].read
    assert read is not None
    return read(controls)


def test_the_light_is_green_only_while_somebody_drives(screen: Screen, show: StagedShow) -> None:
    green = []
    character = show._opened.status().characters[0]
    for matching in (True, False):
        status = replace(show._opened.status(), characters=[replace(character, matching=matching)])
        screen.status = lambda status=status: status
        red, high, blue = np.moveaxis(screen.draw()[20:60, 20:60].astype(int), 2, 0)
        green.append(bool(((high > red + 20) & (high > blue + 20)).any()))
    assert green == [False, True]


def test_what_is_done_is_said_for_a_while(screen: Screen, show: StagedShow) -> None:
    show.controls.view.panel = False
    screen.draw()
    show.controls.notices.show("the stage is dark now")
    assert covered(screen.draw()).any()
    show.now += 60.0
    screen.now += 60.0
    assert not covered(screen.draw()).any()


def test_letters_grow_with_the_picture(context: moderngl.Context, show: StagedShow) -> None:
    """What is readable at 720 lines is readable at 2160."""
    heights = []
    for lines in (720, 2160):
        screen = Screen(context, show)
        screen.target.release()
        screen.target = context.simple_framebuffer((16 * lines // 9, lines), components=4)
        rows = covered(screen.draw())[:, lines // 2]
        heights.append(rows.sum() / lines)
        screen.panel.close()
        screen.target.release()
    assert heights[0] > LETTER_HEIGHT / 720
    assert heights[1] == pytest.approx(heights[0], rel=0.15)


def test_the_state_of_a_show_is_told_whole(show: StagedShow) -> None:
    status: ShowStatus = show._opened.status()
    assert status.playback is not None
    assert status.playback.duration == pytest.approx(show.stream.duration)
    (character,) = status.characters
    assert character.name == show.puppet.character.name
    assert not status.frozen
    (performer,) = status.performers
    assert performer.seen == performer.joints == len(show.performer.skeleton.names)
    show.takes.start()
    (take,) = show._opened.status().recording
    assert take.path.name == "out-1.mcap"


def test_a_gesture_is_asked_for_with_or_without_the_panel(screen: Screen, show: StagedShow) -> None:
    for panel in (True, False):
        show.controls.view.panel = panel
        pictures = []
        for progress in (None, 0.0, 0.9):
            asked = None if progress is None else ("Raise one hand to begin a take", progress)
            status = replace(show._opened.status(), hands_free=asked)
            screen.status = lambda status=status: status  # type: ignore[misc]  # a default binds it
            pictures.append(covered(screen.draw(8)).sum() if progress is None else screen.draw(8))
        bar = np.abs(pictures[1].astype(int) - pictures[2]).max(axis=2) > 60
        rows = np.flatnonzero(bar.any(axis=1))
        assert 0 < len(rows) < 20, "the bar alone grows"
        assert covered(pictures[1]).sum() > pictures[0] or panel
