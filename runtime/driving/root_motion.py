"""How far the whole character turns, rises and falls with the whole performer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.source_joints import available_presets, source_joints
from devices.skeleton import Skeleton
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.performer import Pose, Rest
from runtime.driving.targets import Placement

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RootMotion:
    """How far the whole character goes along with the whole performer.

    Attributes:
        turns: whether it turns as the performer turns.
        lift: how many metres it rises for each metre that the performer's hips rise.
    """

    turns: bool = False
    lift: float = 0.0

    def placement(self, pose: Pose, rest: Rest) -> Placement:
        """Return where the whole character is while the performer strikes this pose."""
        turn = pose.heading - rest.heading if self.turns else 0.0
        return Placement(turn, lift=self.lift * float(pose.hips[1] - rest.height))


def root_motion(
    mapping: Mapping, legs: Sequence[frozenset[int]], source: Array, target: Array
) -> RootMotion:
    """Return the root motion of a mapping: all of it if both legs drive, else none.

    Args:
        mapping: what drives the character.
        legs: the joints of each of the performer's legs.
        source: (J, 3) [m] the performer's rest state.
        target: (K, 3) [m] the character's nodes at rest.
    """
    driving = [
        [drive for drive in mapping.drives if len(leg.intersection(drive.source)) > 1]
        for leg in legs
    ]
    if len(legs) < 2 or not all(driving):
        return RootMotion()
    legs_drive = [drive for drives in driving for drive in drives]
    return RootMotion(turns=True, lift=_ratio(legs_drive, target, source))


def legs_of(skeleton: Skeleton) -> list[frozenset[int]]:
    """Return the joints of each leg of a performer; empty for a skeleton without any."""
    there = available_presets(skeleton)
    return [
        frozenset(source_joints(skeleton, leg)) for leg in ("left-leg", "right-leg") if leg in there
    ]


def chain_length(points: Array, chain: Iterable[int]) -> float:
    """Return the length [m] of the polyline through some of the points (n, 3) [m]."""
    return float(np.linalg.norm(np.diff(points[list(chain)], axis=0), axis=1).sum())


def _ratio(drives: list[Drive], target: Array, source: Array) -> float:
    """The length of the driven chains for each metre of the chains that drive them."""
    ours = sum(chain_length(target, drive.target) for drive in drives)
    theirs = sum(chain_length(source, drive.source) for drive in drives)
    return ours / theirs if theirs > 0.0 else 0.0
