"""What a show says to people fits what it sees, and names the key that helps."""

from __future__ import annotations

from dataclasses import replace

import pytest

from runtime.driving.choices import Candidate
from runtime.status.prompts import advice, countdown, headline, news
from runtime.status.show_status import CharacterStatus, PlaybackStatus, ShowStatus
from runtime.status.stream_watch import Sight, Sighting

SQUID = CharacterStatus("squid", [], True, False, None, None)
LIVE = ShowStatus("vmc://127.0.0.1:39539", Sighting(Sight.SEEN, 2.0), [SQUID], [], None, False, 9)


def seen(sight: Sight, **more: object) -> ShowStatus:
    return replace(LIVE, sighting=Sighting(sight, 12.0, **more))


def test_each_sight_has_words_of_its_own() -> None:
    headlines = {headline(seen(sight)) for sight in Sight}
    assert len(headlines) == len(Sight)
    assert len({advice(seen(sight)) for sight in Sight}) == len(Sight)
    assert all(len(words) <= 34 for words in headlines), "to be read from two metres"


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
    waits = replace(proposed, countdown=float("inf"))
    assert countdown(replace(LIVE, characters=[waits])) is None
    assert "Enter accepts" in advice(replace(LIVE, characters=[waits]))


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
