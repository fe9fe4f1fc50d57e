"""The table of drivers by name, and the choice of the driver that suits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress

from devices.errors import InputError
from runtime.characters.sheet import is_sheet
from runtime.driving.body.body_driver import AbsoluteBodyDriver, BodyDriver
from runtime.driving.driver import Driver
from runtime.driving.pairing import Pairing
from runtime.driving.polyline_driver import PolylineDriver, SkinnedPolylineDriver

DriverFactory = Callable[[Pairing], Driver]
"""Makes a driver for a performer and a character."""


def best_driver(pairing: Pairing) -> Driver:
    """Return the driver that suits: limb by limb where both have limbs, else by matched chains.

    A mapping made by hand is followed as it is.
    """
    if pairing.by_hand is None:
        with suppress(InputError):
            return BodyDriver(pairing)
    return matched_driver(pairing)


def matched_driver(pairing: Pairing) -> Driver:
    """Return the driver that suits where the user chooses among matches on the screen.

    A page crumples better between rings of handles than by a skin, which takes it for a body.
    """
    character = pairing.character
    if is_sheet(character.vertices, character.faces):
        return PolylineDriver(pairing)
    return SkinnedPolylineDriver(pairing)


def driver_of_joints(make_driver: DriverFactory, pairing: Pairing) -> Driver:
    """Return a new driver for a performer of whom only joints are known.

    Raises:
        InputError: the driver needs a surface of the performer, or cannot drive the character.
    """
    driver = make_driver(pairing)
    if driver.needs.surface:
        raise InputError(
            f"the driver of {pairing.character.name} needs a surface of the performer, and "
            "this source gives joints only: choose a driver that follows a skeleton"
        )
    return driver


DRIVERS: Mapping[str, DriverFactory] = {
    "auto": best_driver,
    "relative": PolylineDriver,
    "absolute": AbsoluteBodyDriver,
}
"""Every driver by its name. A new driver is one more line here."""

LIMB_BY_LIMB = (best_driver, AbsoluteBodyDriver)
"""Drivers that move a body limb by limb, with the nodes that it has for that."""
