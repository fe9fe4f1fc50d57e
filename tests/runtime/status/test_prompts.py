"""What a show says to people fits what it sees, and names the key that helps."""

from __future__ import annotations

from dataclasses import replace

import pytest

from runtime.driving.choices import Candidate
from runtime.status.prompts import (
    advice,
    countdown,
    counted_down,
    details,
    headline,
    news,
    place_of_match,
)
from runtime.status.show_status import (
    CharacterStatus,
    PerformerStatus,
    PlaybackStatus,
    ShowStatus,
)
from runtime.status.stream_watch import Sight, Sighting

SQUID = CharacterStatus("squid", [], True, False, None, None, counts=False)
LIVE = ShowStatus("vmc://127.0.0.1:39539", Sighting(Sight.SEEN, 2.0), [SQUID], [], None, False, 9)


def seen(sight: Sight, **more: object) -> ShowStatus:
    return replace(LIVE, sighting=Sighting(sight, 12.0, **more))


def test_each_sight_has_words_of_its_own() -> None:
    headlines = {headline(seen(sight)) for sight in Sight}
    assert len(headlines) == len(Sight)
    assert len({advice(seen(sight)) for sight in Sight}) == len(Sight)
    assert all(len(words) <= 34 for words in headlines), "to be read from two metres"


def test_it_is_said_who_is_seen_and_what_of_them_is_lost() -> None:
    whole, half = PerformerStatus(25, 25, []), PerformerStatus(19, 25, ["left arm", "head"])
    said = details(replace(LIVE, performers=[whole, half]))
    assert "vmc://127.0.0.1:39539" in said
    assert "2 people" in said
    assert "19 of 25 joints seen (left arm and head lost)" in said
    assert "for 2 s" in said
    assert "2 performers" in headline(replace(LIVE, performers=[whole, half]))
    assert "nobody" in details(replace(LIVE, performers=[PerformerStatus(0, 25, [])]))


def test_since_when_it_is_so_can_be_read_from_afar() -> None:
    assert "12 s" in headline(seen(Sight.WAITING))
    assert "12 s" in headline(seen(Sight.LOST))


def test_a_recording_that_plays_is_named_and_asks_nobody_to_perform() -> None:
    plays = replace(LIVE, origin="dab.bvh", playback=PlaybackStatus(1.0, 9.0, False))
    assert headline(plays) == "dab.bvh plays"
    assert "Perform" not in advice(plays)
    assert "Perform" in advice(LIVE)
    by_path = replace(plays, origin="/shows/motions/dab.bvh")
    assert headline(by_path) == "dab.bvh plays"
    assert "home" not in details(by_path)
    matched = replace(plays, characters=[replace(SQUID, matching=True)])
    assert headline(matched) == "Looking for a match"
    assert "dab.bvh" in details(matched)


def test_waiting_says_where_it_listens() -> None:
    assert "vmc://127.0.0.1:39539" in advice(seen(Sight.WAITING))


def test_what_is_not_understood_is_counted() -> None:
    said = advice(seen(Sight.NOT_UNDERSTOOD, packets=120, refused=7))
    assert "120 packets" in said
    assert "7 of them unreadable" in said
    assert "vmc" in said


def test_trouble_of_the_connection_is_told_first() -> None:
    assert advice(seen(Sight.WAITING, trouble="the port is taken")) == "the port is taken"


def test_a_lost_performer_is_told_since_when() -> None:
    assert "12 s" in advice(seen(Sight.LOST))


def test_matching_names_the_match_and_the_seconds_left() -> None:
    proposed = replace(SQUID, matching=True, candidate=Candidate(2, 7, 0.8), countdown=2.2)
    said = advice(replace(LIVE, characters=[proposed]))
    assert "match 2 of 7" in said
    assert "starts in 3" in said
    assert countdown(replace(LIVE, characters=[proposed, SQUID])) == pytest.approx(2.2)
    assert counted_down(replace(LIVE, characters=[proposed, SQUID])) is None, "who moves sees none"
    still = replace(proposed, counts=True)
    assert counted_down(replace(LIVE, characters=[still, SQUID])) == pytest.approx(2.2)
    waits = replace(proposed, countdown=float("inf"))
    assert countdown(replace(LIVE, characters=[waits])) is None
    assert "Enter accepts" in advice(replace(LIVE, characters=[waits]))


def test_the_place_of_a_match_says_for_whom_and_nothing_where_there_is_none() -> None:
    pig = replace(SQUID, name="pig")
    squid = replace(SQUID, candidate=Candidate(1, 21, 0.8))
    both = replace(LIVE, characters=[pig, squid])
    assert place_of_match(both, None) == "match 1 of 21 for squid"
    assert place_of_match(both, 0) == ""
    assert place_of_match(both, 1) == "match 1 of 21 for squid"
    assert place_of_match(replace(LIVE, characters=[squid]), None) == "match 1 of 21"
    by_hand = replace(squid, candidate=Candidate(0, 21, 0.8))
    assert "by hand" in place_of_match(replace(LIVE, characters=[by_hand]), None)


def test_pauses_and_freezes_say_how_to_go_on() -> None:
    paused = replace(LIVE, playback=PlaybackStatus(1.0, 9.0, True))
    assert headline(paused) == "Paused"
    assert "Space" in advice(paused)
    frozen = replace(LIVE, frozen=True)
    assert headline(frozen) == "Frozen"
    assert "Press e" in advice(frozen)


def test_news_tell_a_return_from_a_first_sight() -> None:
    came, back = Sighting(Sight.SEEN, 0.0), Sighting(Sight.SEEN, 0.0)
    assert news(Sight.WAITING, came, "x") != news(Sight.LOST, back, "x")
    assert "rest" in news(Sight.SEEN, Sighting(Sight.LOST, 0.0), "x")


def test_who_has_no_hand_free_is_not_asked_for_a_key_while_a_match_is_looked_for() -> None:
    proposed = replace(SQUID, matching=True, candidate=Candidate(2, 7, 0.8), countdown=2.2)
    asked = replace(LIVE, characters=[proposed], hands_free=("Clap three times", 0.0))
    assert "Make the gesture below" in advice(asked)
    assert "Enter" not in advice(asked)
