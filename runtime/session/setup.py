"""Setups as immutable values: what drives an actor of a session, and how its surface deforms."""

from __future__ import annotations

from dataclasses import dataclass

from devices.errors import InputError
from runtime.puppet.deformable_surface import Elasticity
from solvers.signal.delay_line import MOST

Point = tuple[float, float, float]
RIGID = Elasticity()
FRONT: tuple[Point, Point, Point] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Pair:
    """A chain of the performer that drives a chain of the actor.

    Attributes:
        source: joints by name, from the trunk outward.
        target: nodes, from the trunk outward.
        flip: whether the turns are mirrored.
        gain: share of the performer's turns that is carried over, in (0, 1].
        delay: [s] how much later it follows.
    """

    source: tuple[str, ...]
    target: tuple[int, ...]
    flip: bool = False
    gain: float = 1.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.delay <= MOST:
            raise InputError(f"a chain follows {self.delay:g} s later: expected 0 to {MOST:g} s")
        if not 0.0 < self.gain <= 1.0:
            raise InputError(f"a chain is driven by {self.gain:g} of the turns: expected 0 to 1")


@dataclass(frozen=True, slots=True)
class StruckMatch:
    """A match that was accepted, with the pose that was struck.

    Attributes:
        joints: of the performer, by name.
        rest: [m] where they were in the rest state.
        heading: [rad] of the performer then, about +Y from +Z.
        height: [m] of the hips above the floor while the performer stands.
        mirrored: whether left and right were exchanged.
        view: row by row the rotation from the stage to the camera.
        pairs: which chains drive which; none where the anatomy of both tells that.
        matched: whether matches were stepped to in place of the anatomy's choice.
        by_hand: whether the user made the pairs.
    """

    joints: tuple[str, ...]
    rest: tuple[Point, ...]
    heading: float
    height: float
    mirrored: bool = False
    view: tuple[Point, Point, Point] = FRONT
    pairs: tuple[Pair, ...] = ()
    matched: bool = False
    by_hand: bool = False

    def __post_init__(self) -> None:
        if len(self.joints) != len(self.rest) or len(set(self.joints)) != len(self.joints):
            raise InputError("a match states no place, or several, for some of its joints")


@dataclass(frozen=True, slots=True)
class Setup:
    """What an actor is driven by, and how it deforms, besides the poses of its performer.

    Attributes:
        match: None while nobody has struck a pose.
        elasticity: the material of its surface.
        in_place: whether it stays where it is.
    """

    match: StruckMatch | None = None
    elasticity: Elasticity = RIGID
    in_place: bool = False
