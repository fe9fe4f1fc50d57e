"""Setups of a session: what drives its actors comes back by undo, and when it is opened again."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.recording import Recording
from runtime.characters.open_character import load_character
from runtime.control.actions import press, set_value
from runtime.driving.by_hand.parts import character_parts
from runtime.driving.mapping import Drive, Mapping
from runtime.puppet.deformable_surface import Elasticity
from runtime.session.document import Actor, Session
from runtime.session.files.codec import as_json, from_json
from runtime.session.files.store import SessionStore
from runtime.session.live_session import LiveSession
from runtime.session.setup import Pair, Setup, StruckMatch
from runtime.show.open_stream import play
from runtime.show.settings import CharacterSettings, MatchSettings, ShowSettings
from runtime.show.show import Show

NUMBERS = st.floats(-10.0, 10.0)
POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def ticking() -> Callable[[], float]:
    """A clock on which two seconds pass with each look."""
    times: Iterator[float] = iter(np.arange(0.0, 1e6, 2.0).tolist())
    return lambda: next(times)


def open_show(
    path: Path,
    character: str = "squid",
    recording: Recording | None = None,
    own: CharacterSettings | None = None,
    warnings: list[str] | None = None,
    **options: object,
) -> Show:
    """A show in which a performer has to be matched, as a live one."""
    match = MatchSettings(rehearse=False, patience=math.inf, **options)  # type: ignore[arg-type]  # of various types
    settings = ShowSettings(match=match, characters=(own or CharacterSettings(),))
    return Show(
        play(recording or builtin_recording("wave"), every_frame=True, loop=True),
        [load_character(character)],
        settings,
        session=SessionStore(path),
        clock=ticking(),
        warn=None if warnings is None else warnings.append,
    )


def ticks(show: Show, count: int) -> list[np.ndarray]:
    seen = []
    for _ in range(count):
        assert show.tick()
        seen.append(show.vertices[0])
    return seen


def session_of(show: Show) -> LiveSession:
    assert show.controls.session is not None
    return show.controls.session


def setup_of(show: Show) -> Setup:
    setup = session_of(show).session.actors[0].setup
    assert setup is not None
    return setup


@pytest.mark.parametrize("drive", ["auto", "relative"])
@pytest.mark.parametrize("character", ["squid", "mannequin"])
def test_an_accepted_match_is_a_step_and_comes_back(
    tmp_path: Path, character: str, drive: str
) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path, character, driver=drive) as show:
        assert setup_of(show).match is None
        ticks(show, 10)
        press("accept", show.controls)
        ticks(show, 3)
        (act,) = show.acts
        (match,) = act.match_session.matches
        accepted, setup = match.setup, setup_of(show)
        assert accepted.rest is not None
        assert setup.match is not None
        press("undo", show.controls)
        ticks(show, 3)
        assert match.rest is None
        assert match.matching
        assert setup_of(show).match is None
        press("redo", show.controls)
        ticks(show, 3)
        assert setup_of(show) == setup
        assert match.rest is not None
        assert_array_equal(match.rest.positions, accepted.rest.positions)
        assert match.setup.mapping.drives == accepted.mapping.drives
        shown = ticks(show, 60)[-1]
    with open_show(path, character, driver=drive) as show:
        assert setup_of(show) == setup
        again = ticks(show, 79)[-1]  # the frame that was shown last
    assert np.abs(again - shown).max() < 1e-3 * np.ptp(shown[:, 1])


@pytest.mark.parametrize("character", ["squid", "mannequin"])
def test_a_mapping_made_by_hand_is_a_step_and_comes_back(tmp_path: Path, character: str) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path, character) as show:
        ticks(show, 10)
        press("accept", show.controls)
        ticks(show, 3)
        (match,) = show.acts[0].match_session.matches
        usual, puppet = setup_of(show), show.acts[0].puppets[0]
        parts = character_parts(puppet.character, puppet.bound_skeleton)
        chains = [puppet.bound_skeleton.limb(parts.chains[one]) for one in parts.groups[0][:2]]
        arm = show.acts[0].performer.skeleton.index("ShoulderLeft")
        source = (arm, arm + 1, arm + 2)
        by_hand = Mapping((Drive(source, chains[0]), Drive(source, chains[1], delay=0.2)))
        show.controls.match_controls.choose(0, by_hand)
        ticks(show, 3)
        setup = setup_of(show)
        assert setup.match is not None
        assert setup.match.by_hand
        assert [pair.delay for pair in setup.match.pairs] == [0.0, 0.2]
        press("undo", show.controls)
        ticks(show, 3)
        assert setup_of(show) == usual
        assert match.setup.mapping.drives != by_hand.drives
        press("redo", show.controls)
        ticks(show, 3)
        assert match.setup.mapping.drives == by_hand.drives
    with open_show(path, character) as show:
        ticks(show, 2)
        assert setup_of(show) == setup
        (match,) = show.acts[0].match_session.matches
        assert match.setup.mapping.drives == by_hand.drives
        assert match.setup.by_hand


def test_a_match_stepped_to_goes_before_the_anatomy_again(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path, "mannequin") as show:
        ticks(show, 5)
        press("accept", show.controls)
        ticks(show, 5)
        press("next-match", show.controls)
        ticks(show, 5)
        press("accept", show.controls)
        ticks(show, 2)
        stepped = setup_of(show)
        assert stepped.match is not None
        assert stepped.match.matched
        assert stepped.match.pairs
    with open_show(path, "mannequin") as show:
        ticks(show, 5)
        (match,) = show.acts[0].match_session.matches
        assert match.setup.matched
        names = show.acts[0].performer.skeleton.names
        sources = [tuple(names[j] for j in drive.source) for drive in match.mapping.drives]
        assert sources == [pair.source for pair in stepped.match.pairs]
        press("undo", show.controls)  # nothing was done yet
        assert match.setup.matched


def test_a_slider_is_one_step_while_it_is_dragged(tmp_path: Path) -> None:
    with open_show(tmp_path / "s.bunraku") as show:
        versions = session_of(show).store.versions
        surface = show.puppets[0].surface
        ticks(show, 3)
        for share in (0.1, 0.4, 0.5):
            set_value("cartoon", share, show.controls)
            ticks(show, 1)
        assert versions.undone == "change the surface of squid"
        ticks(show, 3)  # longer than a second by this clock
        set_value("cartoon", 0.9, show.controls)
        ticks(show, 1)
        press("undo", show.controls)
        assert surface.elasticity == Elasticity(0.5)
        press("undo", show.controls)
        assert surface.elasticity == Elasticity()
        assert versions.undone == ""


def test_travel_is_a_step(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path, "mannequin") as show:
        ticks(show, 2)
        press("in-place", show.controls)
        ticks(show, 1)
        assert session_of(show).store.versions.undone == "keep mannequin in place"
    with open_show(path, "mannequin") as show:
        assert show.puppets[0].travel.in_place
        press("in-place", show.controls)
        ticks(show, 1)
        assert session_of(show).store.versions.undone == "let mannequin travel"


def test_options_go_before_what_the_session_says(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path) as show:
        set_value("stiffness", 0.5, show.controls)
        ticks(show, 5)
        kept = show.puppets[0].surface.elasticity
    with open_show(path) as show:
        assert show.puppets[0].surface.elasticity == kept
    with open_show(path, own=CharacterSettings(cartoon=0.3)) as show:
        assert show.puppets[0].surface.elasticity == Elasticity(0.3)


def test_a_match_of_another_kind_of_performer_is_kept_but_not_used(tmp_path: Path) -> None:
    path = tmp_path / "s.bunraku"
    with open_show(path) as show:
        ticks(show, 10)
        press("accept", show.controls)
        ticks(show, 2)
        setup = setup_of(show)
    wave, warnings = builtin_recording("wave"), list[str]()
    renamed = tuple(f"{name} of another" for name in wave.skeleton.names)
    other = replace(wave, skeleton=replace(wave.skeleton, names=renamed))
    with open_show(path, recording=other, warnings=warnings) as show:
        ticks(show, 5)
        (line,) = warnings
        assert "other joints" in line
        assert "press m" in line
        assert setup_of(show) == setup
        assert show.acts[0].match_session.matches[0].rest is None


@given(
    st.integers(0, 4),
    st.data(),
    st.booleans(),
    st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 10.0), st.floats(0.0, 0.99)),
)
def test_setups_come_back_from_json(
    joints: int, data: st.DataObject, on: bool, surface: tuple[float, float, float]
) -> None:
    pairs = st.builds(
        Pair,
        st.lists(st.text(max_size=9), max_size=3).map(tuple),
        st.lists(st.integers(0, 99), max_size=3).map(tuple),
        st.booleans(),
        st.floats(1e-3, 1.0),
        st.floats(0.0, 4.0),
    )
    match = StruckMatch(
        tuple(f"joint {k}" for k in range(joints)),
        tuple(data.draw(POINTS) for _ in range(joints)),
        data.draw(NUMBERS),
        data.draw(NUMBERS),
        mirrored=on,
        view=data.draw(st.tuples(POINTS, POINTS, POINTS)),
        pairs=tuple(data.draw(st.lists(pairs, max_size=3))),
        matched=not on,
        by_hand=on,
    )
    for struck in (None, match):
        setup = Setup(struck, Elasticity(*surface), on)
        session = Session((Actor(1, "a", "squid", "auto", 5, setup),))
        text = json.dumps(as_json(session))
        assert from_json(json.loads(text), pytest.fail) == session


def test_a_session_without_setups_is_read(tmp_path: Path) -> None:
    older = as_json(Session((Actor(1, "a", "squid", "auto", 5),)))
    older["version"] = 1
    del older["actors"][0]["setup"]
    session = from_json(older, pytest.fail)
    assert session.actors[0].setup is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stiffness": 1.0}, "stiffness"),
        ({"cartoon": True}, "number"),
        ({"in_place": 1}, "neither true nor false"),
        ({"match": []}, "no object"),
        ({"match": {"view": [[1, 0, 0]]}}, "view"),
    ],
)
def test_a_damaged_setup_is_refused_in_words(change: dict[str, object], message: str) -> None:
    document = as_json(Session((Actor(1, "a", "squid", "auto", 5, Setup()),)))
    document["actors"][0]["setup"] |= change
    with pytest.raises(InputError, match=message):
        from_json(document, pytest.fail)
