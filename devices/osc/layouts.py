"""Recognise OSC packets that differ from an earlier packet only in their numbers.

Sizes, addresses, type tags and texts determine what an OSC packet contains. If all of these equal,
byte for byte, those of a packet that was parsed strictly, the packet has the same messages with
other numbers and need not be parsed again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from devices.osc.messages import BUNDLE, Message, numbers_at_end
from solvers.kernels.compiled import exact_kernel

Bytes = NDArray[np.uint8]
Span = tuple[int, int]
Plan = TypeVar("Plan")

MOST_LENGTHS = 16
MOST_A_LENGTH = 4
_TIME_TAG = slice(8, 16)  # of the outer bundle


@dataclass(frozen=True, slots=True, eq=False)
class _Layout(Generic[Plan]):
    """The bits (N,) that are constant, their values, and the plan that the decoder made."""

    mask: Bytes
    pattern: Bytes
    plan: Plan


class Layouts(Generic[Plan]):
    """The layouts of one sender's packets; it needs as many as a sender has packets per frame."""

    def __init__(self) -> None:
        self._by_length: dict[int, deque[_Layout[Plan]]] = {}
        nothing = np.zeros(0, dtype=np.uint8)
        _same(np.frombuffer(b"", np.uint8), nothing, nothing)  # compile before the first packet

    def find(self, data: bytes) -> Plan | None:
        """Return the plan of a packet that differs only in its numbers; None if there is none."""
        known = self._by_length.get(len(data))
        if known is None:
            return None
        there = np.frombuffer(data, np.uint8)
        for layout in known:
            if _same(there, layout.mask, layout.pattern):
                return layout.plan
        return None

    def learn(self, data: bytes, messages: Iterable[tuple[Span, Message]], plan: Plan) -> None:
        """Remember the plan of a packet for any numbers at the ends of its messages.

        Args:
            data: a well-formed packet.
            messages: its messages, and where each begins and ends.
            plan: result of `find`, independent of the numbers.
        """
        mask = np.full(len(data), 255, dtype=np.uint8)
        if data.startswith(BUNDLE):
            mask[_TIME_TAG] = 0
        for (_, end), message in messages:
            mask[end - numbers_at_end(message.tags) : end] = 0
        there = np.frombuffer(data, np.uint8)
        layout = _Layout(mask, there & mask, plan)
        if len(data) not in self._by_length and len(self._by_length) == MOST_LENGTHS:
            del self._by_length[next(iter(self._by_length))]
        self._by_length.setdefault(len(data), deque(maxlen=MOST_A_LENGTH)).append(layout)

    def clear(self) -> None:
        """Forget all layouts."""
        self._by_length.clear()


@exact_kernel
def _same(data: Bytes, mask: Bytes, pattern: Bytes) -> bool:
    """Whether packets (N,) agree in the bits of a mask."""
    other = np.uint8(0)
    for place in range(len(data)):
        other |= (data[place] & mask[place]) ^ pattern[place]
    return bool(other == 0)
