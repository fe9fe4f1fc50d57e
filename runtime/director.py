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
from runtime.mapping import Drive, Mapping
from runtime.performer import Performer, Pose
from runtime.puppet import Puppet, body_of
from solvers.abstraction import simplify
from solvers.match_hysteresis import MatchHysteresis
from solvers.matching import SIZE_PREFERENCE, Match, TargetHierarchy

LEAST_SEEN = 0.5  # share of the driving joints that must be in view to strike a pose
CANDIDATES = 20  # matches that can be cycled through

View = Callable[[], NDArray[np.float64]]


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


class Director:
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
        self._since = float("nan")

    def direct(self, frame: SkeletonFrame) -> None:
        """While matching, show the best match of this frame's pose; accept it in time.

        A pose counts only with at least half of the driving joints in view.
        """
        pose = self._performer.pose
        seen = np.mean(frame.confidence[self._performer.joints] > 0.0)
        if not self.matching or pose is None or seen < LEAST_SEEN:
            return
        changed = self._match(pose, frame.time)
        if changed or np.isnan(self._since):
            self._since = frame.time
        if frame.time - self._since >= self._choices.patience:
            self.accept()

    def _match(self, pose: Pose, time: float) -> bool:
        changed = False
        positions = pose.seen[self._performer.joints]
        for puppet, target, shown, by_hand in zip(
            self._puppets, self._targets, self._shown, self._by_hand, strict=True
        ):
            mapping = by_hand
            if mapping is None:
                ranked = target.rank(
                    self._source,
                    self._view(),
                    positions,
                    limit=CANDIDATES + self._choices.rank,
                    size_preference=SIZE_PREFERENCE,
                )
                if len(ranked) < self._choices.rank:
                    raise InputError(
                        f"{puppet.character.name} has {len(ranked)} matches with this part of the "
                        f"performer, so there is no --match {self._choices.rank}"
                    )
                match = shown.update(ranked, time)
                assert match is not None  # there was one to show
                mapping = self._mapping(match)
            changed = changed or mapping.drives != puppet.mapping.drives
            puppet.show(mapping)
        return changed

    def _mapping(self, match: Match) -> Mapping:
        chosen = match if self._choices.extend else match.stopped()
        joints = self._performer.joints
        drives = tuple(
            Drive(tuple(joints[node] for node in source), target, self._choices.flip)
            for source, target in chosen.pairs
            if len(source) > 1 and len(target) > 1
        )
        return Mapping(drives, match.score, match.root)

    def accept(self) -> None:
        """Let the matches shown perform from now on; the pose just struck is the rest state."""
        rest = self._performer.rest()
        for puppet in self._puppets:
            body = body_of(puppet.mapping, self._performer.legs, rest, puppet.tree.positions)
            puppet.take(puppet.mapping, rest, self._view(), body)
        self.matching = False

    def match_again(self) -> None:
        """Return to matching."""
        self.matching = True
        self._since = float("nan")
        for puppet in self._puppets:
            puppet.rest()

    def next_match(self) -> None:
        """Show the match after the one shown, and stay there."""
        for shown in self._shown:
            shown.cycle(1)

    def previous_match(self) -> None:
        """Show the match before the one shown, and stay there."""
        for shown in self._shown:
            shown.cycle(-1)
