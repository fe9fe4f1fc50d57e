"""Pauses that the language makes, kept out of a show."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def collector_paused() -> Iterator[None]:
    """Within the block the garbage collector does not look for what may go.

    For what is loaded and built before a show: nearly all of it stays, and the collector would look
    through it again and again, a tenth of the time that it takes. What refers to itself and is
    dropped there is collected afterwards, or with what is `objects_frozen`.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@contextmanager
def objects_frozen() -> Iterator[None]:
    """Within the block the garbage collector leaves alone what was there before it.

    It looks through everything now and then, and what is loaded for a show takes it 0.1 s: six
    frames. What is made within the block is collected as ever.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
