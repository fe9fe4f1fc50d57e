"""Notices reach the terminal and, for a while, the panel."""

from __future__ import annotations

import threading

from runtime.status.notices import SHOWN, Notices, SecondPress


class Told:
    """Notices with the clock and the terminal in a test's hands."""

    def __init__(self) -> None:
        self.now = 100.0
        self.said: list[str] = []
        self.warned: list[str] = []
        self.notices = Notices(self.said.append, self.warned.append, lambda: self.now)

    @property
    def shown(self) -> list[str]:
        return [notice.text for notice in self.notices.current]


def test_lines_go_to_the_terminal_and_to_the_panel() -> None:
    told = Told()
    told.notices.tell("a take began")
    told.notices.warn("the disk is full")
    told.notices.show("frozen")
    assert told.said == ["a take began"]
    assert told.warned == ["the disk is full"]
    assert told.shown == ["a take began", "the disk is full", "frozen"]
    assert [notice.fault for notice in told.notices.current] == [False, True, False]


def test_a_notice_goes_after_a_while_and_the_same_line_again_begins_anew() -> None:
    told = Told()
    told.notices.show("frozen")
    told.now += 0.9 * SHOWN
    told.notices.show("frozen")
    told.now += 0.9 * SHOWN
    assert told.shown == ["frozen"]
    told.now += 0.2 * SHOWN
    assert told.shown == []
    assert told.notices.latest is not None


def test_long_lines_and_many_lines_stay_bounded() -> None:
    told = Told()
    for number in range(1000):
        told.notices.show(f"{number} " + "x" * 10_000 + "\n\n")
    assert len(told.shown) < 10
    assert all(len(text) < 400 and "\n" not in text for text in told.shown)


def test_threads_may_speak_at_once() -> None:
    told = Told()
    threads = [
        threading.Thread(target=lambda: [told.notices.tell("x") for _ in range(200)])
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(told.said) == 800


def test_a_second_press_counts_only_soon_after_the_first() -> None:
    now = 0.0
    asked = SecondPress(lambda: now)
    assert not asked.again()
    assert asked.again()
    assert not asked.again(), "the third is a first again"
    now = 2.0 * SHOWN
    assert not asked.again()
