"""The space that a character needs on the stage: around its place, and on its way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from runtime.driving.driver import Driver
from runtime.driving.performer import Pose
from runtime.driving.targets import HandleTargets, SkinnedTargets, Targets
from runtime.puppet.placement import put_on_stage

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """The room that a character takes, in its own coordinates.

    Attributes:
        around: (2, 3) [m] least and greatest corner of all that it fills if it stays in place.
        path: (2, 3) [m] of all that it fills on its way over the stage.
    """

    around: Array
    path: Array

    @property
    def way(self) -> Array:
        """(2, 2) [m] least and greatest x and z of its travel."""
        way: Array = (self.path - self.around)[:, ::2]
        return way


def reach_of(driver: Driver, root: Array, around: Array, poses: Sequence[Pose]) -> Reach:
    """Return the room that a character takes in poses that are not all tried.

    The targets of each pose are placed, which deforms no surface; what the surface reaches beyond
    them is known from the poses that were tried.

    Args:
        driver: moves the character, prepared; it is reset.
        root: (3,) [m] the character's root node at rest.
        around: (2, 3) [m] corners of what it fills in place, in the poses that were tried.
        poses: poses of the whole way, in any order; at least one.
    """
    boxes, ways = np.empty((len(poses), 2, 3)), np.zeros((len(poses), 3))
    for number, pose in enumerate(poses):
        driver.reset()
        targets = driver.targets(pose)
        boxes[number] = _box_in_place(targets, root)
        ways[number, ::2] = targets.placement.travel
    driver.reset()
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    around = np.array([np.minimum(around[0], low), np.maximum(around[1], high)])
    path = np.array([(boxes[:, 0] + ways).min(axis=0), (boxes[:, 1] + ways).max(axis=0)])
    return Reach(around, path + (around - [low, high]))


def _box_in_place(targets: Targets, root: Array) -> Array:
    """The corners (2, 3) [m] of a character's targets on the stage, without its travel."""
    shape = targets.shape
    points = shape.positions if isinstance(shape, HandleTargets | SkinnedTargets) else shape
    points = np.ascontiguousarray(points, dtype=np.float64)
    placed = np.empty_like(points)
    put_on_stage(points, replace(targets.placement, travel=(0.0, 0.0)), root, placed)
    return np.array([placed.min(axis=0), placed.max(axis=0)])
