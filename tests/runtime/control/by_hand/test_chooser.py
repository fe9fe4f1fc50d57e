"""Mapping by hand in a show: clicked pairs drive, and the texts say what to do next."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from runtime.control.actions import ACTIONS
from runtime.control.by_hand.choosing_actions import CHOOSING_ACTIONS
from runtime.output.output import Screen
from runtime.status.prompts import advice, headline
from tests.runtime.control.by_hand.hand_show import HandShow

SIDEWAYS = 1.4  # [rad]


@pytest.fixture
def show(context: moderngl.Context) -> Iterator[HandShow]:
    with HandShow(context) as show:
        yield show


def told(show: HandShow) -> tuple[str, str]:
    status = show._opened.status()
    return headline(status), advice(status)


def test_a_click_on_either_side_and_one_on_the_other_make_a_pair_that_drives(
    show: HandShow,
) -> None:
    show.press("map-by-hand")
    assert show.pairs == show.driven, "from what drives now"
    show.press("clear-pairs")
    show.pair("left arm", "tentacle 3")
    show.chooser.click(show.of_character("mantle", share=0.9))
    show.chooser.click(show.of_performer("right arm"))
    assert show.pairs == [("left arm", "tentacle 3"), ("right arm", "mantle")]
    assert show.driven != show.pairs, "nothing drives before it is accepted"
    wanted = show.pairs
    rest = show.acts[0].match_session.rests[0]
    show.press("accept")
    assert not show.chooser.on
    assert show.driven == wanted
    assert show.acts[0].match_session.rests[0] is rest
    assert show.said == "squid follows 2 pairs by hand"
    assert show.perform(2).shape


def test_the_same_pair_again_is_taken_away_and_escape_leaves_all_as_it_was(show: HandShow) -> None:
    before = show.driven
    show.press("map-by-hand", "clear-pairs")
    show.pair("left leg", "tentacle 2")
    show.pair("left leg", "tentacle 2")
    assert show.pairs == []
    show.pair("left leg", "tentacle 2")
    show.press("leave")
    assert not show.chooser.on
    assert not show.controls.leaving, "Escape leaves the choosing first"
    assert show.driven == before
    show.press("leave")
    assert show.controls.leaving


def test_without_pairs_a_match_is_looked_for_again(show: HandShow) -> None:
    show.press("map-by-hand", "clear-pairs", "accept")
    assert show.said == "squid is matched again"
    assert show.controls.match_controls.matching


def test_what_is_accepted_unchanged_changes_nothing(show: HandShow) -> None:
    (match,) = show.controls.match_controls.matches
    driver = show.puppets[0].driver
    show.press("map-by-hand", "accept")
    assert show.said == "nothing was changed"
    assert show.puppets[0].driver is driver
    assert not match.setup.by_hand


def test_the_window_says_what_to_click_next(show: HandShow) -> None:
    show.press("map-by-hand")
    assert told(show) == (
        "Mapping by hand",
        "Click a part of the performer in the small picture, or a part of squid. "
        "Escape leaves all as it was.",
    )
    show.chooser.click(show.of_performer("left arm"))
    assert told(show) == (
        "What moves with the left arm?",
        "Click the part of squid that the left arm moves.",
    )
    show.chooser.click(show.of_character("tentacle 3"))
    assert "Enter uses these 6 pairs." in told(show)[1]
    show.chooser.click(show.of_character("mantle"))
    assert told(show) == (
        "What moves the mantle?",
        "Click the part of the performer, in the small picture, that moves the mantle of squid.",
    )


def test_parts_that_are_alike_are_taken_together_one_after_the_other(show: HandShow) -> None:
    show.press("map-by-hand", "clear-pairs", "together")
    show.pair("right arm", "tentacle 6")
    assert len(show.pairs) == 8
    assert {source for source, _ in show.pairs} == {"right arm"}
    show.put("phase", 0.2)
    show.press("accept")
    (match,) = show.controls.match_controls.matches
    delays = [drive.delay for drive in match.mapping.drives]
    np.testing.assert_allclose(delays, 0.2 * np.arange(8))
    assert ACTIONS["phase"].read(show.controls) == pytest.approx(0.2)
    show.press("phase-up")
    assert show.said == "One after the other: 0.25 s"
    assert match.mapping.drives[1].delay == pytest.approx(0.25)
    tips = [match.mapping.drives[k].target[-1] for k in range(3)]
    rest = show.puppets[0].bound_skeleton.tree.positions[tips]
    show.perform(30)
    moved = []
    for _ in range(90):
        show.perform(1)
        moved.append(np.linalg.norm(show.puppets[0].places[tips] - rest, axis=1))
    first, *others = (np.array(moved) - np.mean(moved, axis=0)).T
    for place, other in enumerate(others, 1):
        lag = int(np.argmax(np.correlate(other, first, "full"))) - (len(first) - 1)
        assert lag == pytest.approx(place * 0.25 * 60.0, abs=4.0)


def test_what_is_pointed_at_lights_up_on_both_sides(show: HandShow) -> None:
    show.press("map-by-hand")
    source, target = show.pairs[0]
    lights = show.scene.lights
    assert lights is not None
    for at in (show.of_performer(source), show.of_character(target, share=0.8)):
        show.chooser.point((1.0, show.scene.stage.size[1] - 1.0))
        show.chooser.look()
        dark = [chain.width for chain in lights.chains(0)]
        joints = lights.joint_colours(len(show.acts[0].performer.skeleton.names))
        show.chooser.point(at)
        show.chooser.look()
        bright = [chain.width for chain in lights.chains(0)]
        assert max(bright) > max(dark)
        assert bright.count(max(bright)) == 1
        lit = lights.joint_colours(len(joints))
        chain = show.pickable.performer.chains[show.pickable.performer.named(source)]
        assert (lit[list(chain[1:])] > joints[list(chain[1:])]).any()
        show.perform(1)


def test_all_that_can_be_clicked_is_seen_in_the_window_and_never_in_outputs(
    show: HandShow,
) -> None:
    class Camera:
        """An output that sees every picture."""

        pictures_a_second = np.inf

        def __init__(self) -> None:
            self.seen: list[np.ndarray] = []

        def show(self, picture: np.ndarray) -> None:
            self.seen.append(picture)

        def write(self, frame: object) -> None: ...

    camera = Camera()
    assert isinstance(camera, Screen)
    scene = show.scene
    show.controls.loop.draw()
    plain = scene.picture()
    show.press("map-by-hand")
    show.controls.loop.draw()
    assert (scene.picture() != plain).any(axis=2).mean() > 0.002
    schedule = show.controls.loop._pictures
    np.testing.assert_array_equal(schedule._read(scene, show.controls.loop.draw), plain)
    assert (scene.picture() != plain).any(axis=2).mean() > 0.002, "the window shows it on"
    scene.draw_for_audience()
    audience = scene.picture()
    show.press("leave")
    scene.draw_for_audience()
    np.testing.assert_array_equal(scene.picture(), audience)


def test_nobody_is_rushed_while_choosing(context: moderngl.Context) -> None:
    with HandShow(context, rehearse=False, patience=0.5) as show:
        assert show.controls.match_controls.matching
        show.press("map-by-hand")
        show.perform(40)
        assert show.controls.match_controls.matching
        show.press("clear-pairs")
        show.pair("left arm", "tentacle 3")
        show.press("accept")
        show.perform(40)
        assert not show.controls.match_controls.matching
        assert show.driven == [("left arm", "tentacle 3")]


def test_the_anatomy_of_a_body_is_beaten_too(context: moderngl.Context) -> None:
    with HandShow(context, ["mannequin"]) as show:
        show.press("map-by-hand")
        assert ("left arm", "left arm") in show.pairs
        show.press("clear-pairs")
        show.pair("left arm", "right leg")
        show.press("accept")
        assert show.driven == [("left arm", "right leg")]
        show.perform(20)


def test_each_character_has_its_own_pairs(context: moderngl.Context) -> None:
    with HandShow(context, ["squid", "cactus"]) as show:
        before = show.driven
        show.press("map-by-hand")
        show.controls.select(1)
        show.press("clear-pairs")
        show.pair("left arm", "crown", 1)
        show.press("accept")
        assert show.said == "cactus follows 1 pair by hand"
        assert show.driven == before
        second = show.controls.match_controls.matches[1]
        assert [part.target_name for part in second.parts] == ["crown"]


def test_the_widest_view_is_told_of_and_turned_to(context: moderngl.Context) -> None:
    with HandShow(context, ["cactus"]) as show:
        show.scene.camera = show.scene.camera.orbit(SIDEWAYS, 0.0)
        show.press("map-by-hand")
        assert "F7 turns to where more of it is seen." in told(show)[1]
        show.press("widest-view")
        assert show.scene.shown_share(None) > 0.99
        assert "F7" not in told(show)[1]
        show.perform(2)
        assert show.pickable.under(show.of_character("crown")) is not None


def test_where_no_performer_is_seen_nothing_can_be_chosen(context: moderngl.Context) -> None:
    with HandShow(context) as show:
        show.scene._inset = None
        show.press("map-by-hand")
        assert not show.chooser.on
        assert show.said == "no small picture of the performer is shown to click on"
        show.press("clear-pairs")
        assert show.said == "no pairs are chosen now: F6 begins"


def test_every_action_is_tried_here() -> None:
    assert set(CHOOSING_ACTIONS) == {
        "map-by-hand",
        "together",
        "clear-pairs",
        "widest-view",
        "phase",
        "phase-up",
        "phase-down",
    }


def test_the_phase_goes_back_and_stays_in_its_range(show: HandShow) -> None:
    show.press("map-by-hand", "clear-pairs", "together")
    show.pair("right arm", "tentacle 6")
    show.press("phase-down")
    assert show.said == "One after the other: 0.00 s"
    show.put("phase", 1.0)
    show.press("phase-up")
    assert show.said == "One after the other: 1.00 s"
    assert show.chooser.status is not None
    assert show.chooser.status.changed
