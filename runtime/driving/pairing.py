"""A performer and a character that belong together: everything that a driver is made from."""

from __future__ import annotations

from dataclasses import dataclass

from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.driving.mapping import Mapping
from runtime.puppet.bound_skeleton import BoundSkeleton
from runtime.puppet.deformable_surface import DeformableSurface


@dataclass(frozen=True, slots=True, eq=False)
class Pairing:
    """What a driver is made from.

    Attributes:
        performer: the performer's whole skeleton.
        joints: those of its joints that may drive, as chosen by `--source`.
        character: what is moved.
        skeleton: the character's bound skeleton.
        surface: the character's surface.
        by_hand: the mapping that the user chose; None to find one.
    """

    performer: Skeleton
    joints: tuple[int, ...]
    character: Character
    skeleton: BoundSkeleton
    surface: DeformableSurface
    by_hand: Mapping | None = None
