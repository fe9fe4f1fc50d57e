"""The settings of the flow: how a show goes on from one step of the puppeteer to the next."""

from __future__ import annotations

from dataclasses import dataclass

from devices.errors import InputError

MOST_COUNT_IN = 60.0  # [s]
GESTURES = ("pose", "clap", "raise")


@dataclass(frozen=True, slots=True)
class FlowSettings:
    """How a show goes on from one step of the puppeteer to the next.

    Attributes:
        count_in: [s] that are counted down before a take begins, and before a match that was
            accepted performs; 0 to 60.
        hands_free: which gesture of a performer does the next step, one of `GESTURES`; "" for none.

    Raises:
        InputError: a value is out of range; the message names the setting.
    """

    count_in: float = 0.0
    hands_free: str = ""

    def __post_init__(self) -> None:
        value: object = self.count_in
        right = isinstance(value, int | float) and not isinstance(value, bool)
        if not right or not 0.0 <= self.count_in <= MOST_COUNT_IN:
            raise InputError(
                f"FlowSettings.count_in: expected a number from 0 to {MOST_COUNT_IN:g}, "
                f"got {value!r}"
            )
        if self.hands_free and self.hands_free not in GESTURES:
            raise InputError(
                f"FlowSettings.hands_free: expected one of {', '.join(GESTURES)}, "
                f"got {self.hands_free!r}"
            )
