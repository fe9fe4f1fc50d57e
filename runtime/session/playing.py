"""What an actor does at a moment, as a function of the session and the time alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from runtime.driving.targets import Placement, PosedNodes
from runtime.session.document import Clip, Session
from runtime.session.performance import Moment
from solvers.skeleton.layers import LayeredNodes, LayerFrame
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """An actor at one moment, before it is put on the stage.

    Attributes:
        nodes: all nodes.
        placement: where the whole character is.
        face: (M,) weights of the morph targets.
    """

    nodes: PosedNodes
    placement: Placement
    face: Array


@dataclass(frozen=True, slots=True, eq=False)
class LiveLayer:
    """The layer on top: what a performer makes of the actor at this moment.

    Attributes:
        moment: of all nodes that the performer moves.
        weight: how much of it counts, in [0, 1].
    """

    moment: Moment
    weight: float


class ActorPlayer:
    """Plays the clips of one actor.

    Args:
        actor: its id in the session.
        tree: its nodes at rest.
        morphs: how many morph targets it has.
    """

    def __init__(self, actor: int, tree: Tree, morphs: int = 0) -> None:
        self.layered = LayeredNodes(tree)
        self._actor, self._count, self._morphs = actor, len(tree), morphs

    def play(self, session: Session, time: float, live: LiveLayer | None = None) -> Played:
        """Return the actor at `time` [s] of the session."""
        layered = self.layered
        layered.clear()
        placement, face = Placement(), np.zeros(self._morphs)
        for clip, take in session.played(self._actor):
            weight = clip.presence(time)
            if weight <= 0.0:
                continue
            moment = take.performance.at(clip.take_time(time))
            nodes = moment.nodes if clip.nodes is None else _only(moment.nodes, clip.nodes)
            placement, face = self._put_on(
                replace(moment, nodes=nodes), weight, clip, placement, face
            )
        if live is not None and live.weight > 0.0:
            placement, face = self._put_on(live.moment, live.weight, None, placement, face)
        positions, rotations = layered.world()
        return Played(PosedNodes(positions, rotations), placement, face)

    def _put_on(
        self, moment: Moment, weight: float, clip: Clip | None, placement: Placement, face: Array
    ) -> tuple[Placement, Array]:
        """Put one layer on the nodes; return placement and face with it."""
        additive = clip is not None and clip.additive
        if len(moment.nodes.nodes) and moment.nodes.nodes[-1] >= self._count:
            return placement, face  # of another skeleton: nothing fits
        (self.layered.add if additive else self.layered.override)(moment.nodes, weight)
        if moment.placement is not None and (clip is None or clip.placed):
            placement = (added if additive else blended)(placement, moment.placement, weight)
        if moment.face is not None and len(moment.face) == len(face):
            below = face if additive else (1.0 - weight) * face
            face = np.clip(below + weight * moment.face, 0.0, 1.0)
        return placement, face


def blended(below: Placement, over: Placement, weight: float) -> Placement:
    """Return a placement a share `weight` of the way from one to another, by the shorter turn."""
    if weight >= 1.0:
        return over
    turn = math.remainder(over.turn - below.turn, 2.0 * math.pi)
    travel = (
        (1.0 - weight) * below.travel[0] + weight * over.travel[0],
        (1.0 - weight) * below.travel[1] + weight * over.travel[1],
    )
    lift = (1.0 - weight) * below.lift + weight * over.lift
    low, high = _clearances(below, over)
    clearance = None if low is None or high is None else (1.0 - weight) * low + weight * high
    if (low is None) is not (high is None):
        clearance = low if weight < 0.5 else high
    return Placement(below.turn + weight * turn, travel, lift, clearance)


def added(below: Placement, over: Placement, weight: float) -> Placement:
    """Return a placement, followed by a share `weight` of another."""
    low, high = _clearances(below, over)
    return Placement(
        below.turn + weight * over.turn,
        (
            below.travel[0] + weight * over.travel[0],
            below.travel[1] + weight * over.travel[1],
        ),
        below.lift + weight * over.lift,
        None if low is None and high is None else (low or 0.0) + weight * (high or 0.0),
    )


def _clearances(below: Placement, over: Placement) -> tuple[float | None, float | None]:
    """Both clearances; a character that nothing has placed yet stands on the floor."""
    low, high = below.clearance, over.clearance
    if low is None and high is not None and below.lift == 0.0:
        low = 0.0
    if high is None and low is not None and over.lift == 0.0:
        high = 0.0
    return low, high


def _only(frame: LayerFrame, nodes: tuple[int, ...]) -> LayerFrame:
    """The rows of some nodes."""
    rows = np.flatnonzero(np.isin(frame.nodes, nodes))
    (first, second), (before, after) = frame.turns, frame.shifts
    return LayerFrame(
        frame.nodes[rows],
        (first[rows], second[rows]),
        (before[rows], after[rows]),
        frame.share,
    )
