"""Pairs in words drive what they name, in the words that the window uses itself."""

from __future__ import annotations

import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.driving.by_hand.pair_words import WordedPair, read_pair
from runtime.show.open_stream import play
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show


def driven(*pairs: str, characters: tuple[str, ...] = ("squid",)) -> list[dict[str, str]]:
    """What drives what of each character, after a frame: by the name of what is driven."""
    settings = ShowSettings(match=MatchSettings(pairs=tuple(map(read_pair, pairs))))
    stream = play(builtin_recording("wave"), every_frame=True)
    with Show(stream, list(map(load_character, characters)), settings) as show:
        assert show.tick()
        status = show._opened.status()
    return [{part.target_name: part.name for part in each.parts} for each in status.characters]


def test_a_pair_has_two_parts_with_an_arrow_between_them() -> None:
    assert read_pair(" left arm->tentacle 3 ") == WordedPair("left arm", "tentacle 3")
    assert read_pair("head → squid: mantle").target_of("Squid") == "mantle"
    assert read_pair("head → squid: mantle").target_of("pig") is None
    for wrong in ("", "->", "left arm", "left arm -> ", "a -> b -> c"):
        with pytest.raises(InputError, match="is no pair: expected one such as"):
            read_pair(wrong)


def test_pairs_drive_what_they_name_and_nothing_else() -> None:
    (parts,) = driven("left arm -> tentacle 3", "Right_Leg -> mantle")
    assert sorted(parts.values()) == ["left arm", "right leg"]
    assert any(name.startswith("tentacle 3") for name in parts)


def test_the_words_of_the_window_can_be_given_back() -> None:
    settings = ShowSettings()
    stream = play(builtin_recording("wave"), every_frame=True)
    with Show(stream, [load_character("squid")], settings) as show:
        assert show.tick()
        shown = show._opened.status().characters[0].parts
    words = [f"{part.name} -> {part.target_name}" for part in shown]
    (parts,) = driven(*words)
    assert parts == {part.target_name: part.name for part in shown}


def test_bodies_that_follow_limb_by_limb_are_mapped_by_their_limbs() -> None:
    (parts,) = driven("left arm -> right leg", characters=("mannequin",))
    assert parts == {"right leg": "left arm"}


def test_a_character_that_is_named_takes_its_pairs_alone() -> None:
    squid, cactus = driven("left leg -> squid: tentacle 1", characters=("squid", "cactus"))
    assert list(squid.values()) == ["left leg"]
    assert len(cactus) > 1, "it is matched"


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        ("left arm -> wheel", "squid: 'wheel' is no part; there are: .*mantle"),
        ("left arm -> tentacle", "squid: 'tentacle' means several parts; there are: tentacle 1"),
        ("left arm -> pig: snout", "no character is called 'pig'; there are: squid"),
        ("left wing -> mantle", "the performer: 'left wing' is no part; there are: .*left arm"),
    ],
)
def test_what_is_not_known_is_told_with_what_is(pair: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as refusal:
        driven(pair)
    assert "\n" not in str(refusal.value)


def test_a_part_is_driven_once() -> None:
    with pytest.raises(InputError, match="is driven by two parts"):
        driven("left arm -> mantle", "right arm -> mantle")
