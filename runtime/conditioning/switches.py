"""What is done to a stream before it drives: one switch for each step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

from devices.errors import InputError


@dataclass(slots=True)
class Conditioning:
    """The steps of conditioning, each on or off; see the package for what they do.

    Read once a frame, so that a key, the command line or a remote control may set any of them while
    the show runs, from any thread.

    Attributes:
        order: drop duplicates and what comes late, and go on where a clock jumps.
        identities: keep who is who when the sensor gives somebody a new number.
        swaps: put limbs right whose left and right are exchanged.
        outliers: do not believe joints that jump or bones that stretch.
        filter: smooth (One-Euro).
        predict: show where joints will be one frame later.
        level: make the floor level, at y = 0.
        mirror: show the performer as in a mirror: left is right.
        scale: make everybody as tall as the skeleton's rest pose.
        recalibrate: take a T or A pose that is held for a second as the rest state.
    """

    order: bool = True
    identities: bool = True
    swaps: bool = True
    outliers: bool = True
    filter: bool = True
    predict: bool = False
    level: bool = True
    mirror: bool = False
    scale: bool = True
    recalibrate: bool = False

    def switch(self, name: str, on: bool | None = None) -> bool:
        """Set one switch, or turn it over where `on` is None; what it is now.

        Raises:
            InputError: there is no such switch.
        """
        if name not in SWITCHES:
            raise InputError(f"no switch is called {name!r}; there are: {', '.join(SWITCHES)}")
        now = not getattr(self, name) if on is None else bool(on)
        setattr(self, name, now)
        return now


SWITCHES = tuple(field.name for field in fields(Conditioning))


def for_live() -> Conditioning:
    """What a live stream is given unless asked otherwise."""
    return Conditioning()


def for_recording() -> Conditioning:
    """What a recording is given: only faults are mended.

    Readers have put its frames in order and its floor level, nobody waits for it, so that smoothing
    would only take detail away, and clean motion capture passes unchanged.
    """
    return Conditioning(order=False, filter=False, level=False, scale=False)


def asked_for(switches: Conditioning, wanted: Mapping[str, bool | None]) -> Conditioning:
    """The switches with those set that somebody asked for; None where nobody did."""
    for name in SWITCHES:
        if wanted.get(name) is not None:
            switches.switch(name, wanted[name])
    return switches


def filled_only() -> Conditioning:
    """Nothing but what nothing after can do without: every joint has a place."""
    return Conditioning(**dict.fromkeys(SWITCHES, False))
