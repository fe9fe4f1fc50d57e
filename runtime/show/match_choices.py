"""From the settings of matching to drivers and countdowns, with the usual values for the rest."""

from __future__ import annotations

import math

from devices.errors import InputError
from runtime.driving.choices import Choices
from runtime.driving.drivers import DRIVERS, DriverFactory, matched_driver
from runtime.show.settings import MatchSettings

COUNTDOWN = 3.0  # [s] that a live performer keeps still before a match performs by itself
STEADY = 1.0  # [s] that a match is shown before it performs where nobody sees a countdown
STRAY = 0.15  # share of the performer's size that a joint may stray while keeping still


def choices_of(match: MatchSettings, *, recorded: bool, attended: bool) -> Choices:
    """Return the choices that settings ask for, or else what is usual.

    A recorded performer cannot be asked to keep still: the first match performs, and whatever is
    looked for later waits to be accepted.

    Args:
        match: the settings.
        recorded: whether the stream is a recording.
        attended: whether there is a window, in which a performer sees the countdown.
    """
    patience = again = match.patience
    if recorded:
        patience = 0.0 if patience is None else patience
        again = math.inf if again is None else again
    elif patience is None:
        patience = again = COUNTDOWN if attended else STEADY
    stray = STRAY if attended and not recorded else math.inf
    return Choices(match.rank, match.extend, match.flip, patience, again, stray)


def driver_of(match: MatchSettings) -> DriverFactory:
    """Return what makes the driver that the settings name.

    Raises:
        InputError: no driver has this name.
    """
    name = match.driver
    if name == "auto" and (match.rank > 1 or match.flip or not match.extend):
        return matched_driver  # who chooses among matches beats the anatomy
    if name not in DRIVERS:
        raise InputError(
            f"MatchSettings.driver: no driver is called {name!r}; there are: {', '.join(DRIVERS)}"
        )
    return DRIVERS[name]
