"""Decides what drives what: shows the best match while a pose is struck, then lets it perform.

AniMesh section 3: the performer strikes a pose, the best match is shown at once and can be cycled
through, a comfortable pose becomes the rest state, and from there the motion is transferred.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.skeleton import SkeletonFrame
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.performer import Performer, Pose, Rest, rest_state
from runtime.driving.turn_limits import limit_turns
from runtime.puppet.puppet import STRAIGHT_ON, Puppet, RootMotion, root_motion
from solvers.matching import SIZE_PREFERENCE, Match, TargetHierarchy
from solvers.retarget.abstraction import simplify
from solvers.retarget.match_hysteresis import MatchHysteresis
from solvers.retarget.posture import likeness, most_different

LEAST_SEEN = 0.5  # share of the driving joints that must be in view to strike a pose
CANDIDATES = 20  # matches that can be cycled through
CHOICES = 32  # poses of a rehearsal, evenly, that the rest state is chosen from
TRIED = 16  # poses of a rehearsal that are gone through: those that differ most

Array = NDArray[np.float64]
View = Callable[[], Array]


@dataclass(frozen=True, slots=True)
class Choices:
    """What a puppeteer may ask of the matching.

    Attributes:
        rank: which match to show first, 1 the best.
        extend: drive a chain on to its longest leaf, or stop at the sub-tree's root (figure 5).
        flip: turn the targets' y-axes round (section 5.2).
        patience: seconds that a match must be shown before it performs by itself; 0 at once,
            infinite only when accepted.
    """

    rank: int = 1
    extend: bool = True
    flip: bool = False
    patience: float = 0.0


class MatchSession:
    """Matches puppets to the performer's pose until a match is accepted, then lets them perform.

    Args:
        performer: whose pose is matched.
        puppets: who is to follow.
        view: gives the rotation (3, 3) from the stage to the camera, as it is now.
        choices: what the puppeteer asks for.
        by_hand: for each puppet the mapping to use instead of a match, or None.
    """

    def __init__(
        self,
        performer: Performer,
        puppets: Sequence[Puppet],
        view: View,
        choices: Choices,
        by_hand: Sequence[Mapping | None],
    ) -> None:
        self.matching = True
        self._performer = performer
        self._puppets = puppets
        self._view = view
        self._choices = choices
        self._by_hand = by_hand
        self._targets = [TargetHierarchy(puppet.tree, puppet.root) for puppet in puppets]
        self._shown = [MatchHysteresis(choices.rank - 1) for _ in puppets]
        self._source = simplify(performer.rest_tree())
        for target in self._targets:  # so that no frame waits for what it has to load
            target.rank(self._source, np.eye(3), limit=1)
        self._since = float("nan")
        self._before: Pose | None = None

    def sees(self, frame: SkeletonFrame) -> bool:
        """Whether enough of the driving joints are in view to strike a pose."""
        return bool(np.mean(frame.confidence[self._performer.joints] > 0.0) >= LEAST_SEEN)

    def rehearse(self, poses: Sequence[Pose]) -> Array:
        """Let each puppet perform from the one of these poses that is most like it.

        A recorded performer cannot be asked to strike a pose, so the recording is looked through
        for one: its match is taken, and it is the rest state. The performer is seen facing the
        stage, whichever way the body had turned.

        Returns:
            (A, 2, 3) [m] for each puppet the corners of all that it fills in those poses.
        """
        view = self._view()
        evenly = np.unique(np.linspace(0, len(poses) - 1, CHOICES).round().astype(int))
        states = [rest_state(poses[index], heading=0.0) for index in evenly]
        for number, puppet in enumerate(self._puppets):
            choices = []
            for state in states:  # each by itself: no pose waits for the one before
                shown = MatchHysteresis(self._choices.rank - 1)
                mapping = self._choose(number, shown, state.positions, 0.0)
                choices.append((mapping, state, shown))
            worths = [_worth(puppet, mapping, state, view) for mapping, state, _ in choices]
            mapping, rest, self._shown[number] = choices[int(np.argmax(worths))]
            puppet.take(mapping, rest, view, self._body(puppet, mapping, rest))
        self.matching = False
        facing = np.array([pose.facing(0.0) - pose.hips for pose in poses])
        tried = [poses[index] for index in most_different(facing, TRIED)]
        return np.array([limit_turns(puppet, tried) for puppet in self._puppets])

    def direct(self, frame: SkeletonFrame) -> None:
        """While matching, show the best match of the newest pose; accept it in time."""
        pose = self._performer.pose
        if pose is not None:
            self._turn_over(pose)
        if not self.matching or pose is None:
            return
        if not self.sees(frame):
            self._since = float("nan")  # who comes back strikes a pose anew
            return
        changed = False
        for number, puppet in enumerate(self._puppets):
            mapping = self._choose(number, self._shown[number], pose.seen, frame.time)
            changed = changed or mapping.drives != puppet.mapping.drives
            puppet.show(mapping)
        if changed or np.isnan(self._since):
            self._since = frame.time
        if frame.time - self._since >= self._choices.patience:
            self.accept()

    def _choose(
        self, number: int, shown: MatchHysteresis, positions: Array, time: float
    ) -> Mapping:
        """The mapping of one puppet for a pose (J, 3) [m]: by hand, or by the match shown."""
        by_hand = self._by_hand[number]
        if by_hand is not None:
            return by_hand
        ranked = self._targets[number].rank(
            self._source,
            self._view(),
            positions[self._performer.joints],
            limit=CANDIDATES + self._choices.rank,
            size_preference=SIZE_PREFERENCE,
        )
        match = shown.update(ranked, time)
        if len(ranked) < self._choices.rank or match is None:
            raise InputError(
                f"{self._puppets[number].character.name} has {len(ranked)} matches with this part "
                f"of the performer, so there is no --match {self._choices.rank}"
            )
        return self._mapping(number, match)

    def _body(self, puppet: Puppet, mapping: Mapping, rest: Rest) -> RootMotion:
        return root_motion(mapping, self._performer.legs, rest.positions, puppet.tree.positions)

    def _mapping(self, number: int, match: Match) -> Mapping:
        chosen = match if self._choices.extend else match.stopped()
        joints, puppet = self._performer.joints, self._puppets[number]
        drives = []
        for pair, (nodes, matched) in enumerate(chosen.pairs):
            source = tuple(joints[node] for node in nodes)
            target = puppet.limb(matched) if pair < match.limbs else matched
            if len(target) < len(matched):
                source = self._performer.limb(source)
            if len(source) > 1 and len(target) > 1:
                drives.append(Drive(source, target, self._choices.flip))
        return Mapping(tuple(drives), match.score)

    def accept(self) -> None:
        """Let the matches shown perform from now on; the pose just struck is the rest state."""
        pose = self._performer.pose
        if pose is None or any(not puppet.mapping.drives for puppet in self._puppets):
            return
        rest = rest_state(pose)
        for puppet in self._puppets:
            body = self._body(puppet, puppet.mapping, rest)
            puppet.take(puppet.mapping, rest, self._view(), body)
        self.matching = False

    def take_rest(self) -> None:
        """Take the pose just struck as the rest state, whether a match is looked for or not."""
        self.accept()

    def calibrate(self) -> None:
        """Take the pose just struck as the rest state, and measure floor and sizes anew."""
        self._performer.recalibrate()
        self.accept()

    def _turn_over(self, pose: Pose) -> None:
        """Where the mirror or the scale was switched, let the rest states follow."""
        before, self._before = self._before, pose
        if before is None or (before.mirrored, before.scaled) == (pose.mirrored, pose.scaled):
            return
        mirror = before.mirrored != pose.mirrored
        ratio = pose.scale / before.scale if before.scaled != pose.scaled else 1.0
        for puppet in self._puppets:
            rest = puppet.source_rest
            if rest is None:
                continue
            rest = self._performer.restated(rest, mirror=mirror, scale=ratio)
            gains = puppet.gains
            body = self._body(puppet, puppet.mapping, rest)
            puppet.take(puppet.mapping, rest, self._view(), body)
            puppet.gains = gains

    def match_again(self) -> None:
        """Return to matching, by the pose alone, whatever was stepped to by hand."""
        for shown in self._shown:
            shown.release()
        self._return_to_matching()

    def next_match(self) -> None:
        """Show the match after the one shown, and stay there; also in the midst of performing."""
        self._step(1)

    def previous_match(self) -> None:
        """Show the match before the one shown, and stay there; also in the midst of performing."""
        self._step(-1)

    def _step(self, ranks: int) -> None:
        for shown in self._shown:
            shown.cycle(ranks)
        if not self.matching:
            self._return_to_matching()

    def _return_to_matching(self) -> None:
        self.matching = True
        self._since = float("nan")
        for puppet in self._puppets:
            puppet.rest()


def _worth(puppet: Puppet, mapping: Mapping, rest: Rest, view: Array) -> float:
    """How well a rest state suits: the match's own score, and how alike the limbs' shapes are."""
    shapes = sum(
        likeness(
            rest.positions[list(drive.source)],
            puppet.tree.positions[list(drive.target)],
            STRAIGHT_ON,
            view,
        )
        for drive in mapping.drives
    )
    return shapes + (mapping.score if np.isfinite(mapping.score) else 0.0)
