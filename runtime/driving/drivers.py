"""The table of drivers by name, and what makes one."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from devices.errors import InputError
from runtime.characters.sheet import is_sheet
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.driver import Driver
from runtime.driving.pairing import Pairing
from runtime.driving.polyline_driver import PolylineDriver, SkinnedPolylineDriver

DriverFactory = Callable[[Pairing], Driver]
"""Makes a driver for a performer and a character."""


def best_driver(pairing: Pairing) -> Driver:
    """Return the driver that suits: limb by limb where both have limbs, else by matched chains.

    A mapping made by hand is followed as it is. A page crumples better between rings of handles
    than by a skin, which takes it for a body.
    """
    character = pairing.character
    if is_sheet(character.vertices, character.faces):
        return PolylineDriver(pairing)
    if pairing.by_hand is not None:
        return SkinnedPolylineDriver(pairing)
    try:
        return BodyDriver(pairing)
    except InputError:
        return SkinnedPolylineDriver(pairing)


DRIVERS: Mapping[str, DriverFactory] = {
    "auto": best_driver,
    "relative": PolylineDriver,
    "absolute": BodyDriver,
}
"""Every driver by its name. A new driver is one more line here."""
