"""The switches of conditioning: one for each step that a stream goes through."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

from devices.errors import InputError


@dataclass(slots=True)
class Conditioning:
    """The steps of conditioning, each on or off; the package's docstring describes them.

    The switches are read once a frame. Keys, the command line and the remote may set them while the
    show runs, from any thread.

    Attributes:
        order: drop duplicate and late frames, and keep time rising where a clock jumps.
        identities: keep each performer's number when the sensor gives a new one.
        swaps: put limbs right whose left and right are exchanged.
        outliers: reject joints that jump or are only guessed, and bones that stretch.
        filter: smooth (One-Euro).
        predict: predict joints one frame ahead.
        level: make the floor level, at y = 0.
        mirror: exchange left and right.
        scale: scale every performer to the size of the skeleton's rest pose.
        recalibrate: take a T or A pose kept still for a second as the rest state.
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
        """Set one switch, or reverse it where `on` is None; return its new value.

        Raises:
            InputError: no switch has this name.
        """
        if name not in SWITCHES:
            raise InputError(f"no switch is called {name!r}; there are: {', '.join(SWITCHES)}")
        now = not getattr(self, name) if on is None else bool(on)
        setattr(self, name, now)
        return now


STEPS: Mapping[str, tuple[str, str]] = {
    "order": (
        "Leave out late frames",
        "drop late and duplicate frames, and go on where a clock jumps",
    ),
    "identities": (
        "Tell people apart",
        "recognise performers who get a new number",
    ),
    "swaps": ("Put swapped limbs right", "correct limbs whose left and right are exchanged"),
    "outliers": (
        "Leave out wild jumps",
        "ignore joints that jump or are only guessed, and bones that stretch",
    ),
    "filter": ("Smooth trembling", "smooth every joint (One-Euro)"),
    "predict": ("Make up for delay", "show where joints will be one frame later"),
    "level": ("Level the floor", "keep the floor level"),
    "mirror": ("Mirror left and right", "exchange left and right, as in a mirror"),
    "scale": ("Same size for all", "make all performers the same size"),
    "recalibrate": (
        "Learn from a T pose",
        "take a T or A pose kept still for a second as the rest pose",
    ),
}
"""What people call each switch, and what it does: for panel, keys, remote and command line."""

SWITCHES = tuple(field.name for field in fields(Conditioning))


def for_live() -> Conditioning:
    """The default switches of a live stream."""
    return Conditioning()


def for_recording() -> Conditioning:
    """The default switches of a recording: only faults are mended.

    Readers have put its frames in order and made its floor level. Smoothing would only remove
    detail. Clean motion capture passes unchanged.
    """
    return Conditioning(order=False, filter=False, level=False, scale=False)


def asked_for(switches: Conditioning, wanted: Mapping[str, bool | None]) -> Conditioning:
    """Set the switches that `wanted` gives a value for; None leaves a switch as it is."""
    for name in SWITCHES:
        if wanted.get(name) is not None:
            switches.switch(name, wanted[name])
    return switches


def filled_only() -> Conditioning:
    """All switches off: only unseen joints are filled, which later stages require."""
    return Conditioning(**dict.fromkeys(SWITCHES, False))
