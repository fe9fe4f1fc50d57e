"""What is loaded before a show does not make it pause."""

from __future__ import annotations

import gc
import weakref

import pytest

from runtime.show.collector_pauses import collector_paused, objects_frozen


class Ring:
    """Garbage that only the collector can find."""

    def __init__(self) -> None:
        self.itself = self


def test_what_was_there_is_left_alone_and_what_comes_is_collected() -> None:
    before = Ring()
    old = weakref.ref(before)
    with objects_frozen():
        del before
        new = weakref.ref(Ring())
        gc.collect()
        assert old() is not None
        assert new() is None
    gc.collect()
    assert old() is None


def test_nothing_is_looked_for_while_a_show_is_set_up() -> None:
    with collector_paused():
        assert not gc.isenabled()
    assert gc.isenabled()
    with pytest.raises(KeyboardInterrupt), collector_paused():
        raise KeyboardInterrupt
    assert gc.isenabled()
    gc.disable()
    try:
        with collector_paused():
            pass
        assert not gc.isenabled()  # whoever had switched it off is not overruled
    finally:
        gc.enable()


def test_a_show_that_fails_leaves_the_collector_as_it_was() -> None:
    frozen = gc.get_freeze_count()
    with pytest.raises(KeyboardInterrupt), objects_frozen():
        raise KeyboardInterrupt
    assert gc.get_freeze_count() == frozen == 0
