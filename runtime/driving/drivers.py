"""The table of drivers by name, and what makes one."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.driving.driver import Driver
from runtime.driving.polyline_driver import PolylineDriver
from runtime.puppet.bound_skeleton import BoundSkeleton
from runtime.puppet.deformable_surface import DeformableSurface

DriverFactory = Callable[[Skeleton, Character, BoundSkeleton, DeformableSurface], Driver]
"""Makes a driver from the performer's skeleton, a character, its bound skeleton and its surface."""

DRIVERS: Mapping[str, DriverFactory] = {"relative": PolylineDriver}
"""Every driver by its name. A new driver is one more line here."""
