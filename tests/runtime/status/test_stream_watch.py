"""What is seen of a performer, from what comes and when."""

from __future__ import annotations

from devices.transport.traffic import Traffic
from runtime.status.prompts import news
from runtime.status.stream_watch import LOST, PATIENCE, Sight, StreamWatch


class Source:
    """A live source of which only counts and the end matter here."""

    def __init__(self) -> None:
        self.traffic = Traffic()
        self.ended = False


class Watched:
    def __init__(self, *, live: bool = True) -> None:
        self.now = 0.0
        self.source = Source()
        self.watch = StreamWatch(self.source, live=live, clock=lambda: self.now)

    @property
    def sight(self) -> Sight:
        return self.watch.look().sight


def test_waiting_garbage_seen_lost_back_and_the_end_are_told_apart() -> None:
    watched = Watched()
    assert watched.sight is Sight.WAITING
    watched.source.traffic = Traffic(packets=5, refused=5)
    assert watched.sight is Sight.NOT_UNDERSTOOD
    watched.watch.note()
    assert watched.sight is Sight.SEEN
    watched.now += 1.5 * LOST
    assert watched.sight is Sight.LOST
    watched.watch.note()
    assert watched.sight is Sight.SEEN
    watched.source.ended = True
    assert watched.sight is Sight.ENDED


def test_a_lost_performer_is_lost_since_the_last_frame() -> None:
    watched = Watched()
    watched.now = 3.0
    watched.watch.note()
    watched.now = 3.0 + 4.0 * LOST
    assert watched.watch.look().seconds == 4.0 * LOST


def test_a_change_is_told_once() -> None:
    watched = Watched()
    assert watched.watch.changed() is None, "waiting is how it begins"
    watched.watch.note()
    before, sighting = watched.watch.changed()
    assert (before, sighting.sight) == (Sight.WAITING, Sight.SEEN)
    assert watched.watch.changed() is None


def test_packets_without_a_frame_are_told_once_and_only_when_they_last() -> None:
    watched = Watched()
    watched.source.traffic = Traffic(packets=1, refused=1)
    assert watched.watch.changed() is None, "a sender may begin with a greeting"
    watched.now = PATIENCE
    watched.source.traffic = Traffic(packets=300, refused=7)
    told = watched.watch.changed()
    assert told is not None
    said = news(*told, "vmc://127.0.0.1:39539")
    assert "300 packets" in said
    assert "7 of them unreadable" in said
    assert "vmc" in said
    watched.now = 10.0 * PATIENCE
    assert watched.watch.changed() is None


def test_a_recording_that_pauses_is_not_lost() -> None:
    watched = Watched(live=False)
    watched.watch.note()
    watched.now += 100.0
    assert watched.sight is Sight.SEEN
    assert watched.watch.silence == 0.0
