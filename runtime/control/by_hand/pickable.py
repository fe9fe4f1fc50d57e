"""What lies under a point of the picture: a part of the performer, or of a character."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from runtime.driving.by_hand.choosing import Target
from runtime.driving.by_hand.parts import (
    Parts,
    chains_of_vertices,
    character_parts,
    performer_parts,
)
from runtime.puppet.puppet import Puppet
from runtime.render.picking import nearest_polyline, on_screen, ray_through
from runtime.show.scene import Scene
from solvers.surface.ray_hit import ray_hit

ON_LINE = 0.010  # of the picture's height, from which a click on a line counts
BESIDE = 0.035  # likewise, where there is no surface
IN_INSET = 0.11  # of the inset's radius

Place = tuple[float, float]
"""x and y [px] from the upper left corner of the picture."""
Part = int | Target
"""A chain of the performer, by its number, or a chain of a character."""


class Pickable:
    """The parts of performer and characters, and where they are in the picture.

    Parts are found when they are first asked for, which takes up to a tenth of a second.

    Args:
        scene: the picture.
        puppets: the characters in it, from left to right.
        performer: the skeleton of whoever the inset shows.
    """

    def __init__(self, scene: Scene, puppets: Sequence[Puppet], performer: Skeleton) -> None:
        self._scene, self._puppets, self._skeleton = scene, puppets, performer
        self._parts: dict[int, Parts] = {}
        self._of_vertex: dict[int, NDArray[np.int64]] = {}

    @cached_property
    def performer(self) -> Parts:
        """The parts of the performer."""
        return performer_parts(self._skeleton)

    def character(self, number: int) -> Parts:
        """Return the parts of a character, by its number."""
        if number not in self._parts:
            puppet = self._puppets[number]
            self._parts[number] = character_parts(puppet.character, puppet.bound_skeleton)
        return self._parts[number]

    def nodes(self, target: Target) -> tuple[int, ...]:
        """Return the nodes of a chain of a character that lie outside its trunk."""
        chain = self.character(target.character).chains[target.chain]
        return self._puppets[target.character].bound_skeleton.limb(chain)

    def name(self, part: Part) -> str:
        """Return what a part is called."""
        if isinstance(part, Target):
            return self.character(part.character).names[part.chain]
        return self.performer.names[part]

    def under(self, at: Place) -> Part | None:
        """Return what lies under a place: the inset first, then lines, then surfaces."""
        scene = self._scene
        centre, radius = scene.inset_circle
        if np.hypot(at[0] - centre[0], at[1] - centre[1]) <= radius:
            joints = scene.performer_on_screen
            return None if joints is None else self._in_inset(at, joints, IN_INSET * radius)
        height = scene.stage.size[1]
        targets, lines = self._lines()
        for reach, otherwise in ((ON_LINE, self._on_surface), (BESIDE, lambda _: None)):
            nearest = nearest_polyline(at, lines, reach * height)
            found = otherwise(at) if nearest is None else targets[nearest]
            if found is not None:
                return found
        return None

    def _in_inset(self, at: Place, joints: NDArray[np.float64], reach: float) -> int | None:
        lines = []
        for chain in self.performer.chains:
            line = joints[list(chain)]
            seen = line[np.isfinite(line).all(axis=1)]
            lines.append(seen if len(seen) > 1 else line[:2])
        return nearest_polyline(at, lines, reach)

    def _lines(self) -> tuple[list[Target], list[NDArray[np.float64]]]:
        """Every chain of every character, and its line in the picture."""
        targets, lines = [], []
        for number, puppet in enumerate(self._puppets):
            points = puppet.places + self._scene.position(number)
            places = on_screen(self._scene.seen_by, self._scene.stage.size, points)
            for chain in range(len(self.character(number).chains)):
                targets.append(Target(number, chain))
                lines.append(places[list(self.nodes(targets[-1]))])
        return targets, lines

    def _on_surface(self, at: Place) -> Target | None:
        """The chain of the surface that is seen there."""
        origin, direction = ray_through(self._scene.seen_by, self._scene.stage.size, at)
        nearest, found = np.inf, None
        for number, puppet in enumerate(self._puppets):
            start = origin - self._scene.position(number)
            hit = ray_hit(puppet.shown, puppet.character.faces, start, direction)
            if hit is not None and hit.distance < nearest:
                chain = int(self._chains_of_vertices(number)[hit.corner])
                nearest, found = hit.distance, (Target(number, chain) if chain >= 0 else None)
        return found

    def _chains_of_vertices(self, number: int) -> NDArray[np.int64]:
        if number not in self._of_vertex:
            bound = self._puppets[number].bound_skeleton
            self._of_vertex[number] = chains_of_vertices(self.character(number), bound)
        return self._of_vertex[number]
