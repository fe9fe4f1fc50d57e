"""Plays an actor of a session: its clips, and the performer's motion as a layer on top."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.targets import Targets
from runtime.puppet.puppet import Puppet
from runtime.session.document import Session
from runtime.session.performance import STILL, Moment, Performance, PerformanceRecorder
from runtime.session.playing import ActorPlayer, LiveLayer
from solvers.skeleton.layers import LayerFrame

EASE = 0.3  # [s] in which a performer takes over a character, or lets it go
KEPT = 30.0  # [s] that the replay buffer reaches back
LONGEST_STEP = 0.1  # [s] that a frame counts for at most

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Cue:
    """What an actor does at a frame of the show.

    Attributes:
        session: what plays.
        position: [s] of the session's time.
        live: whether a performer moves the actor.
        seeks: whether a match is looked for with a performer who would move it.
        recording: whether that is recorded.
    """

    session: Session
    position: float
    live: bool
    seeks: bool
    recording: bool


class ActorLayers:
    """Stacks the clips of an actor and the motion of its performer, frame by frame.

    Args:
        actor: its id in the session.
        puppet: the character on the stage.
        cue: says what to do at a frame of the show at a time [s].
        named: gives the nodes that the puppet's driver names as driven.

    Attributes:
        seeks: whether a match is looked for, so that what it would move lights up.
    """

    def __init__(
        self,
        actor: int,
        puppet: Puppet,
        cue: Callable[[float], Cue],
        named: Callable[[], frozenset[int]],
    ) -> None:
        self.actor, self.puppet = actor, puppet
        self._cue, self._named = cue, named
        tree = puppet.bound_skeleton.tree
        self._player = ActorPlayer(actor, tree, len(puppet.face.weights))
        self._weight, self._at = 1.0, math.nan
        self.seeks = False
        self._driver: object = None
        self._moved = np.zeros(len(tree), dtype=np.bool_)
        self._recorder: PerformanceRecorder | None = None
        self._buffer = self._fresh()

    @property
    def shows_driver(self) -> bool:
        """Whether the performer alone moves the nodes that the driver names."""
        return self._weight == 1.0

    def start(self) -> None:
        """Record from the next frame on."""
        self._recorder = self._fresh()

    def stop(self) -> Performance | None:
        """Return what was recorded; None of no frame."""
        recorder, self._recorder = self._recorder, None
        return None if recorder is None else recorder.performance()

    def recall(self) -> Performance | None:
        """Return what the performer did in the last `KEPT` seconds; None of no frame."""
        return self._buffer.performance()

    def over(self, targets: Targets, time: float) -> Targets:
        """Return the targets of all layers at a frame of the show, and show their face.

        Args:
            targets: what the driver makes of the performer's pose.
            time: [s] of the frame.
        """
        cue = self._cue(time)
        face = self.puppet.face.weights
        weight, self.seeks = self._follow(cue.live, time), cue.seeks
        if targets.nodes is None:
            return targets
        if cue.live:
            self._keep(targets, face, time, cue.recording)
        idle = not any(clip.presence(cue.position) for clip, _ in cue.session.played(self.actor))
        if weight == 1.0 and idle:
            return targets  # nobody else moves the character: exactly what the driver says
        live = LiveLayer(self._moment(targets, face), weight) if weight > 0.0 else None
        played = self._player.play(cue.session, cue.position, live)
        self.puppet.face.show(played.face)
        skinned = self.puppet.bound_skeleton.skinned(played.nodes)
        return Targets(skinned, played.placement, played.nodes)

    def at(self, session: Session, time: float) -> Array | None:
        """Return the vertices (N, 3) [m] at `time` [s] of a session; None where no clip plays."""
        if not any(clip.presence(time) > 0.0 for clip, _ in session.played(self.actor)):
            return None
        played = self._player.play(session, time)
        skinned = self.puppet.bound_skeleton.skinned(played.nodes)
        return self.puppet.stood(skinned, played.placement)

    def _follow(self, live: bool, time: float) -> float:
        """How much of the performer counts, eased from frame to frame."""
        passed, self._at = time - self._at, time
        goal = float(live)
        if math.isnan(passed):
            self._weight = goal
        step = min(max(passed, 0.0), LONGEST_STEP) / EASE if math.isfinite(passed) else 0.0
        self._weight += min(max(goal - self._weight, -step), step)
        return self._weight * self._weight * (3.0 - 2.0 * self._weight)

    def _keep(self, targets: Targets, face: Array, time: float, recording: bool) -> None:
        """Take a frame into the replay buffer, and into the take that is recorded."""
        assert targets.nodes is not None
        self._buffer.named = named = self._named()
        self._buffer.add(time, targets.nodes, targets.placement, face)
        self._buffer.forget(time - KEPT)
        if recording and self._recorder is not None:
            self._recorder.named = named
            self._recorder.add(time, targets.nodes, targets.placement, face)

    def _moment(self, targets: Targets, face: Array) -> Moment:
        """What the performer makes of the nodes that the driver moves, or has moved."""
        assert targets.nodes is not None
        if self._driver is not self.puppet.driver:
            self._driver = self.puppet.driver
            self._moved[:] = False
        turns, shifts = self._player.layered.local(targets.nodes.positions, targets.nodes.rotations)
        self._moved |= np.abs(turns[:, :3]).max(axis=1) > STILL
        self._moved |= np.abs(shifts).max(axis=1) > STILL
        self._moved[list(self._named())] = True
        nodes = np.flatnonzero(self._moved)
        own, off = turns[nodes].astype(np.float32), shifts[nodes].astype(np.float32)
        frame = LayerFrame(nodes, (own, own), (off, off))
        return Moment(frame, targets.placement, face if face.any() else None)

    def _fresh(self) -> PerformanceRecorder:
        return PerformanceRecorder(self._player.layered)
